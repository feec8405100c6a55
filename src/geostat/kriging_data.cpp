// KrigingSystem's preparation of data: validation, scales, coincident data.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "geostat/kriging_names.h"
#include "variolux/geostat/kriging.h"

namespace vlx {
namespace {

/// 2^-floor(log2(x)): brings x > 0 into [1, 2) without rounding anything.
double unitScale(double x) {
    return x > 0 && std::isfinite(x) ? std::ldexp(1.0, std::clamp(-std::ilogb(x), -1000, 1000)) : 1;
}

std::string invalidDatum(Index datum, const char* field, double found, const char* expected) {
    std::ostringstream text;
    text << "datum " << datum << ": " << field << " must be " << expected << ", found " << found;
    return text.str();
}

}  // namespace

/// Says nothing: whatever its other numbers, it is left out.
bool KrigingSystem::ignored(Index datum) const { return problem_.errorVariances[datum] == kInfinity; }

bool KrigingSystem::validate() {
    KrigingProblem& problem = problem_;
    const Index n = problem.positions.rows(), d = problem.positions.cols();
    const auto fail = [&](std::string message) {
        report_.message = std::move(message);
        return false;
    };
    if (problem.drift.axes == 0) problem.drift.axes = d;
    if (const auto broken = problem.model.validate()) return fail("model: " + *broken);
    const bool shapes = (d > 0 || n == 0) && problem.values.rows() == n &&
                        (problem.errorVariances.size() == 0 || problem.errorVariances.size() == n) &&
                        (problem.drift.external.size() == 0 || problem.drift.external.rows() == n);
    if (!shapes)
        return fail("positions, values, error variances and external drift must have one row a datum");
    if (problem.transform.size() > 0 && (problem.transform.cols() != d || !problem.transform.allFinite()))
        return fail("the transform must be finite, with one column a coordinate");
    if (problem.drift.axes < 0 || problem.drift.axes > d)
        return fail("the drift's axes must be between 0 and the number of coordinates");
    if (problem.drift.mean.size() != 0 &&
        (problem.drift.mean.size() != problem.values.cols() || !problem.drift.mean.allFinite()))
        return fail("the known mean must be finite, one number a value column");
    if (problem.errorVariances.size() == 0) problem.errorVariances = VectorXd::Zero(n);
    if (problem.drift.external.size() == 0) problem.drift.external.resize(n, 0);
    const bool good = problem.positions.allFinite() && problem.values.allFinite() &&
                      problem.drift.external.allFinite() && (problem.errorVariances.array() >= 0).all();
    for (Index i = 0; !good && i < n; ++i) {  // which one
        if (ignored(i)) continue;
        for (Index j = 0; j < d; ++j)
            if (!std::isfinite(problem.positions(i, j)))
                return fail(invalidDatum(i, "coordinate", problem.positions(i, j), "finite"));
        for (Index j = 0; j < problem.values.cols(); ++j)
            if (!std::isfinite(problem.values(i, j)))
                return fail(invalidDatum(i, "value", problem.values(i, j), "finite"));
        for (Index j = 0; j < problem.drift.external.cols(); ++j)
            if (!std::isfinite(problem.drift.external(i, j)))
                return fail(invalidDatum(i, "external drift", problem.drift.external(i, j), "finite"));
        if (!(problem.errorVariances[i] >= 0))
            return fail(invalidDatum(i, "error variance", problem.errorVariances[i], ">= 0"));
    }
    if (!problem.model.bounded() && constantColumn() < 0)
        return fail("an unbounded variogram needs a constant among the drift functions");
    return true;
}

/// The drift column that is constant over the data, or -1: what the generalised covariance needs.
Index KrigingSystem::constantColumn() const {
    if (problem_.drift.polynomial != DriftPolynomial::None) return 0;
    const MatrixXd& external = problem_.drift.external;
    Index first = 0;
    while (first < external.rows() && ignored(first)) ++first;
    for (Index j = 0; j < external.cols() && first < external.rows(); ++j) {
        bool constant = external(first, j) != 0;
        for (Index i = first; i < external.rows() && constant; ++i)
            constant = ignored(i) || external(i, j) == external(first, j);
        if (constant) return j;
    }
    return -1;
}

void KrigingSystem::chooseScales() {
    const Index n = problem_.positions.rows();
    origin_ = VectorXd::Zero(problem_.positions.cols());
    double extent = 0;
    for (Index j = 0; n > 0 && j < problem_.positions.cols(); ++j) {
        double low = kInfinity, high = -kInfinity;
        for (Index i = 0; i < n; ++i) {
            if (ignored(i)) continue;
            low = std::min(low, problem_.positions(i, j));
            high = std::max(high, problem_.positions(i, j));
        }
        if (low > high) break;
        origin_[j] = low == high ? low : low / 2 + high / 2;
        extent = std::max(extent, high / 2 - low / 2);
    }
    coordinateScale_ = unitScale(extent);

    model_ = problem_.model;
    double sill = model_.nugget;
    for (const VariogramStructure& s : model_.structures) sill += s.sill;
    if (sill == 0)
        for (Index i = 0; i < n; ++i)
            if (std::isfinite(problem_.errorVariances[i])) sill = std::max(sill, problem_.errorVariances[i]);
    varianceScale_ = unitScale(sill);
    nugget_ = model_.nugget * varianceScale_;
    model_.nugget = 0;
    std::erase_if(model_.structures, [](const VariogramStructure& s) { return s.sill == 0; });
    for (VariogramStructure& s : model_.structures) {
        s.sill *= varianceScale_;
        s.range = std::clamp(s.range * coordinateScale_, 1e-300, 1e300);
        structureSill_ += s.sill;
    }
}

/// Data sorted by a sum of their coordinates: coincident data have equal sums, and whether equal sums are
/// coincident is then looked at. Ignored data are left out.
std::vector<std::pair<double, Index>> KrigingSystem::sortedSums() const {
    std::vector<std::pair<double, Index>> sums;
    sums.reserve(row_.size());
    for (Index i = 0; i < problem_.positions.rows(); ++i) {
        if (!std::isfinite(problem_.errorVariances[i] * varianceScale_)) continue;
        double sum = 0, factor = 1;
        for (Index j = 0; j < problem_.positions.cols(); ++j, factor *= 0.6180339887498949)
            sum += factor * (problem_.positions(i, j) * coordinateScale_);
        sums.emplace_back(sum, i);
    }
    std::sort(sums.begin(), sums.end());
    return sums;
}

void KrigingSystem::merge() {
    const Index n = problem_.positions.rows();
    row_.assign(static_cast<std::size_t>(n), -1);
    share_ = VectorXd::Zero(n);
    const auto sums = sortedSums();
    report_.ignored = n - static_cast<Index>(sums.size());
    const auto equal = [](const auto& a, const auto& b) { return a.first == b.first; };
    if (report_.ignored == 0 && std::adjacent_find(sums.begin(), sums.end(), equal) == sums.end()) {
        std::iota(row_.begin(), row_.end(), Index{0});
        share_.setOnes();
        positions_ = problem_.positions.transpose();
        external_ = problem_.drift.external;
        errors_ = problem_.errorVariances * varianceScale_;
        values_ = problem_.values;
    } else {
        mergeGroups(sums);
    }
    // Padded with zeros to whole vectors.
    const Index rows = errors_.size();
    places_ = MatrixXd::Zero((rows + 7) / 8 * 8, problem_.transform.size() > 0 ? problem_.transform.rows()
                                                                               : problem_.positions.cols());
    places_.topRows(rows) = place(positions_.transpose());
}

void KrigingSystem::mergeGroups(const std::vector<std::pair<double, Index>>& sums) {
    const Index d = problem_.positions.cols(), q = problem_.drift.external.cols();
    const auto samePlace = [&](Index a, Index b) {
        return problem_.positions.row(a) == problem_.positions.row(b);
    };
    const auto sameDrift = [&](Index a, Index b) {
        return q == 0 || problem_.drift.external.row(a) == problem_.drift.external.row(b);
    };
    std::vector<std::vector<Index>> groups;      // of coincident data, each in the order given
    std::vector<std::pair<Index, Index>> twins;  // at one place, with different drift
    groups.reserve(sums.size());
    for (std::size_t first = 0, last = 0; first < sums.size(); first = last) {
        const std::size_t run = groups.size();
        for (last = first; last < sums.size() && sums[last].first == sums[first].first; ++last) {
            const Index i = sums[last].second;
            std::size_t g = run;
            for (; g < groups.size(); ++g) {
                if (!samePlace(groups[g][0], i)) continue;
                if (sameDrift(groups[g][0], i)) break;
                twins.emplace_back(groups[g][0], i);
            }
            if (g == groups.size())
                groups.push_back({i});
            else
                groups[g].push_back(i);
        }
    }
    std::sort(groups.begin(), groups.end());
    const auto rows = static_cast<Index>(groups.size());
    report_.merged = static_cast<Index>(sums.size()) - rows;

    positions_.resize(d, rows);
    external_.resize(rows, q);
    errors_.resize(rows);
    values_.resize(rows, problem_.values.cols());
    for (Index r = 0; r < rows; ++r) {
        const std::vector<Index>& group = groups[static_cast<std::size_t>(r)];
        positions_.col(r) = problem_.positions.row(group[0]).transpose();
        external_.row(r) = problem_.drift.external.row(group[0]);
        double lowest = kInfinity;
        for (const Index i : group) lowest = std::min(lowest, problem_.errorVariances[i]);
        double sum = 0;
        for (const Index i : group) {
            row_[static_cast<std::size_t>(i)] = r;
            share_[i] =
                lowest > 0 ? lowest / problem_.errorVariances[i] : (problem_.errorVariances[i] == 0 ? 1 : 0);
            sum += share_[i];
        }
        errors_[r] = lowest * varianceScale_ / sum;
        // Differences from one member: equal values merge exactly.
        const RowVectorXd first = problem_.values.row(group[0]);
        RowVectorXd mean = RowVectorXd::Zero(first.size());
        if (group.size() > 1)
            for (const Index i : group) {
                share_[i] /= sum;
                mean += share_[i] * (problem_.values.row(i) - first);
            }
        values_.row(r) = first + mean;
    }
    for (const auto& [a, b] : twins)
        if (row_[static_cast<std::size_t>(a)] != row_[static_cast<std::size_t>(b)])
            twins_.emplace_back(row_[static_cast<std::size_t>(a)], row_[static_cast<std::size_t>(b)]);
}

}  // namespace vlx
