#include "variolux/geostat/neighbourhood.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nanoflann.hpp>

namespace vlx {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct NearestPoints::Tree {
    using Distance = nanoflann::L2_Simple_Adaptor<double, Tree, double, Index>;
    using KdTree = nanoflann::KDTreeSingleIndexAdaptor<Distance, Tree, -1, Index>;

    explicit Tree(const MatrixXd& all) {
        for (Index i = 0; i < all.rows(); ++i)
            if (all.row(i).allFinite()) original.push_back(i);
        points.resize(all.cols(), static_cast<Index>(original.size()));
        for (std::size_t k = 0; k < original.size(); ++k)
            points.col(static_cast<Index>(k)) = all.row(original[k]).transpose();
        index = std::make_unique<KdTree>(static_cast<int>(points.rows()), *this);
    }

    // nanoflann's view of the data.
    std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.cols()); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const {
        return points(static_cast<Index>(axis), static_cast<Index>(i));
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }

    /// All points with squared distance <= limit, in order.
    std::vector<Index> ordered(const VectorXd& target, double limit) const {
        std::vector<std::pair<Index, double>> found;
        // radiusSearch keeps distances strictly below its limit.
        const double above = std::nextafter(limit, std::numeric_limits<double>::infinity());
        index->radiusSearch(target.data(), above, found, nanoflann::SearchParams());
        std::sort(found.begin(), found.end(), [&](const auto& a, const auto& b) {
            if (a.second != b.second) return a.second < b.second;
            for (Index j = 0; j < points.rows(); ++j)
                if (points(j, a.first) != points(j, b.first)) return points(j, a.first) < points(j, b.first);
            return a.first < b.first;
        });
        std::vector<Index> out;
        for (const auto& entry : found) out.push_back(original[static_cast<std::size_t>(entry.first)]);
        return out;
    }

    MatrixXd points;  // d x finite points
    std::vector<Index> original;
    std::unique_ptr<KdTree> index;
};

NearestPoints::NearestPoints(const MatrixXd& points) : tree_(std::make_unique<Tree>(points)) {}
NearestPoints::~NearestPoints() = default;
NearestPoints::NearestPoints(NearestPoints&&) noexcept = default;
NearestPoints& NearestPoints::operator=(NearestPoints&&) noexcept = default;

std::vector<Index> NearestPoints::nearest(const VectorXd& target, Index count) const {
    const Index available = tree_->points.cols();
    count = std::min(count, available);
    if (count <= 0 || target.size() != tree_->points.rows() || !target.allFinite()) return {};
    std::vector<Index> indices(static_cast<std::size_t>(count));
    std::vector<double> squared(static_cast<std::size_t>(count));
    const auto found = tree_->index->knnSearch(target.data(), static_cast<std::size_t>(count), indices.data(),
                                               squared.data());
    if (found == 0) return {};
    // All that tie with the last one, then the rule.
    std::vector<Index> out = tree_->ordered(target, squared[found - 1]);
    out.resize(std::min(out.size(), static_cast<std::size_t>(count)));
    return out;
}

std::vector<Index> NearestPoints::within(const VectorXd& target, double radius) const {
    if (target.size() != tree_->points.rows() || !target.allFinite() || !(radius >= 0)) return {};
    return tree_->ordered(target, radius * radius);
}

NeighbourhoodPrediction predictLocally(const KrigingProblem& problem, const KrigingTargets& targets,
                                       const NeighbourhoodOptions& options) {
    const Index m = targets.count(), columns = problem.values.cols(), q = problem.drift.external.cols();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    NeighbourhoodPrediction out;
    KrigingPrediction& prediction = out.prediction;
    prediction.estimate = MatrixXd::Constant(m, columns, nan);
    prediction.variance = VectorXd::Constant(m, nan);
    prediction.estimateError = prediction.estimate;
    prediction.varianceError = prediction.variance;
    prediction.status.assign(static_cast<std::size_t>(m), TargetStatus::InvalidTarget);
    const auto fail = [&](std::string message) {
        out.report.status = KrigingStatus::InvalidInput;
        out.report.message = std::move(message);
        return out;
    };
    if (!targets.begin.empty()) return fail("local neighbourhoods are for point targets");
    if (targets.points.cols() != problem.positions.cols() || (q > 0 && targets.externalDrift.rows() != m))
        return fail("targets must have the data's coordinates and external drift");
    if (options.most < 1 || !(options.radius >= 0))
        return fail("a neighbourhood needs at least one datum and a radius >= 0");
    if (problem.values.rows() != problem.positions.rows())
        return fail("positions and values must have one row a datum");

    const auto transformed = [&](const MatrixXd& x) {
        return problem.transform.size() > 0 ? MatrixXd(x * problem.transform.transpose()) : x;
    };
    const NearestPoints points(transformed(problem.positions));
    const MatrixXd places = transformed(targets.points);
    std::vector<Index> current;
    std::unique_ptr<KrigingSystem> system;
    for (Index t = 0; t < m; ++t) {
        const VectorXd place = places.row(t).transpose();
        if (!place.allFinite()) continue;
        std::vector<Index> chosen = points.nearest(place, options.most);
        if (options.radius > 0)
            std::erase_if(chosen, [&](Index i) {
                return !((transformed(problem.positions.row(i)) - places.row(t)).norm() <= options.radius);
            });
        std::sort(chosen.begin(), chosen.end());
        if (!system || chosen != current) {
            KrigingProblem local = problem;
            local.positions = problem.positions(chosen, Eigen::all);
            local.values = problem.values(chosen, Eigen::all);
            if (problem.errorVariances.size() > 0) local.errorVariances = problem.errorVariances(chosen);
            if (q > 0) local.drift.external = problem.drift.external(chosen, Eigen::all);
            system = std::make_unique<KrigingSystem>(local);
            current = chosen;
            ++out.systems;
            const KrigingReport& r = system->report();
            if (r.status == KrigingStatus::InvalidInput)
                return fail("neighbourhood of target " + std::to_string(t) + ": " + r.message);
            out.report.used += r.used;
            out.report.merged += r.merged;
            out.report.ignored += r.ignored;
            out.report.droppedDrift += r.droppedDrift;
            out.report.jitter = std::max(out.report.jitter, r.jitter);
            out.report.indefinite |= r.indefinite;
            out.report.degenerate |= r.degenerate;
            out.report.generalisedCovariance |= r.generalisedCovariance;
            out.report.conditionEstimate = std::max(out.report.conditionEstimate, r.conditionEstimate);
        }
        KrigingTargets one;
        one.points = targets.points.row(t);
        if (q > 0) one.externalDrift = targets.externalDrift.row(t);
        const KrigingPrediction p = system->predict(one);
        prediction.estimate.row(t) = p.estimate.row(0);
        prediction.variance[t] = p.variance[0];
        prediction.estimateError.row(t) = p.estimateError.row(0);
        prediction.varianceError[t] = p.varianceError[0];
        prediction.moreDigits += p.moreDigits;
        prediction.digits = std::max(prediction.digits, p.digits);
        prediction.status[static_cast<std::size_t>(t)] = p.status[0];
        prediction.lowestVariance = std::min(prediction.lowestVariance, p.lowestVariance);
    }
    return out;
}

}  // namespace vlx
