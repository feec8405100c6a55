#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "geostat/kriging_names.h"
#include "geostat/precise_kriging.h"
#include "geostat/precise_model.h"

namespace vlx::precise {

/// What a system is made of: the problem as given, all of it exact.
struct Data {
    KrigingProblem problem;
    VectorXd origin;
    std::vector<Index> row;
    std::vector<Index> drift;
    Index rows = 0;

    bool samePlace(Index a, Index b) const { return problem.positions.row(a) == problem.positions.row(b); }
};

template <class Real>
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
template <class Real>
using Vector = std::vector<Real>;

template <class Real>
Real dot(const Real* a, const Real* b, Index n) {
    Real sum = 0;
    for (Index k = 0; k < n; ++k) sum += a[k] * b[k];
    return sum;
}

enum class Factor { Ok, TooFewDigits, Indefinite };

/// a = L L' in place, lower half. Pivots lost in rounding need more digits; one that is negative by half of
/// all digits will stay so.
template <class Real>
Factor factorise(Matrix<Real>& a) {
    const Real epsilon = std::numeric_limits<Real>::epsilon();
    const Index n = a.rows();
    for (Index i = 0; i < n; ++i) {
        const Real diagonal = a(i, i);
        for (Index j = 0; j < i; ++j) a(i, j) = (a(i, j) - dot(&a(i, 0), &a(j, 0), j)) / a(j, j);
        const Real pivot = diagonal - dot(&a(i, 0), &a(i, 0), i);
        if (pivot < -sqrt(epsilon) * diagonal) return Factor::Indefinite;
        if (!(pivot > Real(n) * epsilon * diagonal)) return Factor::TooFewDigits;
        a(i, i) = sqrt(pivot);
    }
    return Factor::Ok;
}

/// L^-1 x in place; entries of x before `first` are zero.
template <class Real>
void solveLower(const Matrix<Real>& l, Vector<Real>& x, Index first = 0) {
    for (Index i = first; i < l.rows(); ++i)
        x[static_cast<std::size_t>(i)] = (x[static_cast<std::size_t>(i)] -
                                          dot(&l(i, first), &x[static_cast<std::size_t>(first)], i - first)) /
                                         l(i, i);
}

/// L^-T x in place.
template <class Real>
void solveUpper(const Matrix<Real>& l, Vector<Real>& x) {
    for (Index i = l.rows(); i-- > 0;) {
        const Real value = x[static_cast<std::size_t>(i)] / l(i, i);
        for (Index k = 0; k < i; ++k) x[static_cast<std::size_t>(k)] -= l(i, k) * value;
        x[static_cast<std::size_t>(i)] = value;
    }
}

/// The system with one number of digits: K = L L', A = L^-1 F, A'A = S = M M', zeta = L^-1 z.
template <class Real>
class System {
  public:
    explicit System(const Data& data)
        : data_(data), model_(data.problem.model), n_(data.rows), p_(static_cast<Index>(data.drift.size())) {
        merge();
        assemble();
        state_ = factorise(l_);
        if (state_ != Factor::Ok) return;
        for (Vector<Real>& column : drift_) solveLower(l_, column);
        for (Vector<Real>& column : values_) solveLower(l_, column);
        m_.resize(p_, p_);
        for (Index a = 0; a < p_; ++a)
            for (Index b = 0; b <= a; ++b) m_(a, b) = product(drift_[at(a)], drift_[at(b)]);
        state_ = factorise(m_);
        if (state_ == Factor::Indefinite) state_ = Factor::TooFewDigits;
    }

    Factor state() const { return state_; }

    PreciseAnswer predict(const KrigingTargets& targets, const std::vector<Index>& which,
                          const KrigingPredictOptions& options) const {
        PreciseAnswer out = sized(static_cast<Index>(which.size()));
        if (options.weights)
            out.matrix = MatrixXd::Zero(out.estimate.rows(), static_cast<Index>(data_.row.size()));
        for (std::size_t t = 0; t < which.size(); ++t) {
            Target target = makeTarget(targets, which[t], options.quantity);
            solveLower(l_, target.covariance);
            // l = k + A S^-1 (f0 - A'k): weights L^-T l, estimate l'zeta.
            Vector<Real> gain = target.drift;
            for (Index j = 0; j < p_; ++j) gain[at(j)] -= product(drift_[at(j)], target.covariance);
            Real variance = target.variance - product(target.covariance, target.covariance);
            solveLower(m_, gain);
            variance += product(gain, gain);
            solveUpper(m_, gain);
            for (Index j = 0; j < p_; ++j)
                for (Index i = 0; i < n_; ++i) target.covariance[at(i)] += drift_[at(j)][at(i)] * gain[at(j)];
            const auto row = static_cast<Index>(t);
            out.variance[row] = toDouble(variance);
            out.varianceScale[row] = std::max(out.variance[row], fieldVariance_);
            for (Index c = 0; c < columns(); ++c) {
                const Real residual = product(target.covariance, values_[at(c)]);
                out.estimate(row, c) = toDouble(residual + mean(c));
                out.estimateScale(row, c) =
                    std::max(spread_[c], std::abs(out.estimate(row, c) - reference_[c]));
            }
            if (!options.weights) continue;
            solveUpper(l_, target.covariance);
            for (std::size_t i = 0; i < data_.row.size(); ++i)
                if (data_.row[i] >= 0)
                    out.matrix(row, static_cast<Index>(i)) =
                        toDouble(target.covariance[at(data_.row[i])] * share_[i]);
        }
        return out;
    }

    /// beta = S^-1 A'zeta, covariance S^-1. With increments for an unbounded model the covariance is
    /// w'(errors - gamma)w, which is the same where weights sum to 0 and all there is for the constant.
    PreciseAnswer drift() const {
        PreciseAnswer out = sized(p_);
        Matrix<Real> inverse(p_, p_), weights(p_, n_);
        for (Index j = 0; j < p_; ++j) {
            Vector<Real> unit(at(p_), Real(0));
            unit[at(j)] = 1;
            solveLower(m_, unit);
            solveUpper(m_, unit);
            Vector<Real> w(at(n_), Real(0));
            for (Index k = 0; k < p_; ++k) {
                inverse(j, k) = unit[at(k)];
                for (Index i = 0; i < n_; ++i) w[at(i)] += drift_[at(k)][at(i)] * unit[at(k)];
            }
            for (Index c = 0; c < columns(); ++c) {
                out.estimate(j, c) = toDouble(product(w, values_[at(c)]));
                out.estimateScale(j, c) = std::max(spread_[c] / reach_[j], std::abs(out.estimate(j, c)));
            }
            solveUpper(l_, w);
            for (Index i = 0; i < n_; ++i) weights(j, i) = w[at(i)];
        }
        if (!model_.bounded()) inverse = weights * errorsLessSemivariances() * weights.transpose();
        out.matrix = inverse.template cast<double>();
        out.variance = out.matrix.diagonal();
        out.varianceScale = out.variance.cwiseAbs();
        return out;
    }

    PreciseAnswer leaveOneOut() const {
        PreciseAnswer out = sized(n_);
        out.determined.assign(at(n_), false);
        const Real threshold = sqrt(std::numeric_limits<Real>::epsilon());
        for (Index i = 0; i < n_; ++i) {
            Vector<Real> w(at(n_), Real(0));
            w[at(i)] = 1;
            solveLower(l_, w, i);
            const Real full = product(w, w);
            Vector<Real> gain(at(p_));
            for (Index j = 0; j < p_; ++j) gain[at(j)] = product(drift_[at(j)], w);
            solveLower(m_, gain);
            const Real qii = full - product(gain, gain);
            if (!(qii > threshold * full)) continue;
            out.determined[at(i)] = true;
            solveUpper(m_, gain);
            for (Index j = 0; j < p_; ++j)
                for (Index k = 0; k < n_; ++k) w[at(k)] -= drift_[at(j)][at(k)] * gain[at(j)];
            out.variance[i] = toDouble(1 / qii);
            out.varianceScale[i] = std::max(out.variance[i], fieldVariance_);
            for (Index c = 0; c < columns(); ++c) {
                const Real estimate = raw_[at(c)][at(i)] - product(w, values_[at(c)]) / qii;
                out.estimate(i, c) = toDouble(estimate + mean(c));
                out.estimateScale(i, c) = std::max(spread_[c], std::abs(out.estimate(i, c) - reference_[c]));
            }
        }
        return out;
    }

  private:
    struct Target {
        Vector<Real> covariance, drift;
        Real variance;
    };

    static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
    static double toDouble(const Real& x) { return static_cast<double>(x); }
    static Real product(const Vector<Real>& a, const Vector<Real>& b) {
        return dot(a.data(), b.data(), static_cast<Index>(a.size()));
    }
    Index columns() const { return data_.problem.values.cols(); }
    Real mean(Index c) const {
        return p_ == 0 && data_.problem.drift.mean.size() > 0 ? Real(data_.problem.drift.mean[c]) : Real(0);
    }

    PreciseAnswer sized(Index rows) const {
        PreciseAnswer out;
        out.estimate = out.estimateScale = MatrixXd::Zero(rows, columns());
        out.variance = out.varianceScale = VectorXd::Zero(rows);
        return out;
    }

    /// Coincident data: error-free ones are averaged, others weighed by the inverse of their variance.
    void merge() {
        const KrigingProblem& problem = data_.problem;
        std::vector<double> lowest(at(n_), kInfinity);
        for (std::size_t i = 0; i < data_.row.size(); ++i)
            if (data_.row[i] >= 0)
                lowest[at(data_.row[i])] =
                    std::min(lowest[at(data_.row[i])], problem.errorVariances[static_cast<Index>(i)]);
        first_.assign(at(n_), -1);
        share_.assign(data_.row.size(), Real(0));
        Vector<Real> sum(at(n_), Real(0));
        const auto used = [&](const auto& visit) {
            for (std::size_t i = 0; i < data_.row.size(); ++i)
                if (data_.row[i] >= 0) visit(i, at(data_.row[i]), static_cast<Index>(i));
        };
        used([&](std::size_t i, std::size_t r, Index datum) {
            if (first_[r] < 0) first_[r] = datum;
            const Real error = problem.errorVariances[datum];
            share_[i] = lowest[r] > 0 ? 1 / error : Real(error == 0 ? 1 : 0);
            sum[r] += share_[i];
        });
        errors_.assign(at(n_), Real(0));
        for (Index r = 0; r < n_; ++r)
            if (lowest[at(r)] > 0) errors_[at(r)] = 1 / sum[at(r)];
        used([&](std::size_t i, std::size_t r, Index) { share_[i] /= sum[r]; });
        values_.assign(at(columns()), Vector<Real>(at(n_), Real(0)));
        reference_ = RowVectorXd::Zero(columns());
        spread_ = RowVectorXd::Zero(columns());
        for (Index c = 0; c < columns(); ++c) {
            used([&](std::size_t i, std::size_t r, Index datum) {
                if (share_[i] == 0) return;
                values_[at(c)][r] += share_[i] * (Real(problem.values(datum, c)) - mean(c));
            });
            double total = 0;
            for (const Real& z : values_[at(c)]) total += toDouble(z) / static_cast<double>(n_);
            reference_[c] = p_ > 0 ? total : toDouble(mean(c));
            for (const Real& z : values_[at(c)])
                spread_[c] = std::max(spread_[c], std::abs(toDouble(z) - (p_ > 0 ? total : 0)));
        }
        raw_ = values_;
    }

    void assemble() {
        const KrigingProblem& problem = data_.problem;
        for (Index i = 0; i < n_; ++i) places_.push_back(place(problem.positions.row(first_[at(i)])));
        if (!model_.bounded()) {
            centre_ = place(data_.origin.transpose());
            for (Index i = 0; i < n_; ++i) centreGamma_.push_back(semivariance(places_[at(i)], centre_));
            level_ = *std::max_element(centreGamma_.begin(), centreGamma_.end());
            if (level_ == 0) level_ = 1;
        }
        l_.resize(n_, n_);
        fieldVariance_ = kInfinity;
        const Real nugget = problem.model.nugget;
        for (Index i = 0; i < n_; ++i) {
            for (Index j = 0; j <= i; ++j) {
                l_(i, j) = covariance(places_[at(i)], fromCentre(i), places_[at(j)], fromCentre(j));
                if (data_.samePlace(first_[at(i)], first_[at(j)])) l_(i, j) += nugget;
            }
            l_(i, i) += errors_[at(i)];
            fieldVariance_ = std::min(fieldVariance_, toDouble(l_(i, i)));
        }
        drift_.assign(at(p_), Vector<Real>(at(n_)));
        reach_ = VectorXd::Zero(p_);
        for (Index i = 0; i < n_; ++i) {
            const Index datum = first_[at(i)];
            const Vector<Real> row = driftRow(problem.positions.row(datum), problem.drift.external, datum);
            for (Index j = 0; j < p_; ++j) {
                drift_[at(j)][at(i)] = row[at(j)];
                reach_[j] = std::max(reach_[j], std::abs(toDouble(row[at(j)])));
            }
        }
    }

    Vector<Real> place(const RowVectorXd& x) const {
        const MatrixXd& transform = data_.problem.transform;
        if (transform.size() == 0) return Vector<Real>(x.data(), x.data() + x.size());
        Vector<Real> out(at(transform.rows()), Real(0));
        for (Index a = 0; a < transform.rows(); ++a)
            for (Index b = 0; b < x.size(); ++b) out[at(a)] += Real(transform(a, b)) * Real(x[b]);
        return out;
    }

    static Real squaredDistance(const Vector<Real>& a, const Vector<Real>& b) {
        Real sum = 0;
        for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
        return sum;
    }
    Real semivariance(const Vector<Real>& a, const Vector<Real>& b) const {
        return model_.semivariance(squaredDistance(a, b));
    }
    Real fromCentre(Index i) const { return model_.bounded() ? Real(0) : centreGamma_[at(i)]; }

    /// Covariance of the field without its nugget, or of its increments to the centre.
    Real covariance(const Vector<Real>& a, const Real& gammaA, const Vector<Real>& b,
                    const Real& gammaB) const {
        if (model_.bounded()) return model_.covariance(squaredDistance(a, b));
        return level_ + gammaA + gammaB - semivariance(a, b);
    }

    /// The chosen columns at x.
    Vector<Real> driftRow(const RowVectorXd& x, const MatrixXd& external, Index externalRow) const {
        const DriftModel& drift = data_.problem.drift;
        Vector<Real> all;
        if (drift.polynomial != DriftPolynomial::None) all.push_back(1);
        Vector<Real> centred;
        for (Index a = 0; a < drift.axes; ++a) centred.push_back(Real(x[a]) - Real(data_.origin[a]));
        if (drift.polynomial >= DriftPolynomial::Linear)
            all.insert(all.end(), centred.begin(), centred.end());
        if (drift.polynomial == DriftPolynomial::Quadratic)
            for (std::size_t a = 0; a < centred.size(); ++a)
                for (std::size_t b = a; b < centred.size(); ++b) all.push_back(centred[a] * centred[b]);
        for (Index k = 0; k < data_.problem.drift.external.cols(); ++k)
            all.push_back(external(externalRow, k));
        Vector<Real> chosen;
        for (const Index j : data_.drift) chosen.push_back(all[at(j)]);
        return chosen;
    }

    Target makeTarget(const KrigingTargets& targets, Index t, KrigingQuantity quantity) const {
        const bool point = targets.begin.empty(), field = quantity == KrigingQuantity::Field;
        const Index first = point ? t : targets.begin[at(t)], last = point ? t + 1 : targets.begin[at(t) + 1];
        Vector<Real> weights, gamma;
        std::vector<Vector<Real>> places;
        Real sum = 0;
        for (Index a = first; a < last; ++a) {
            weights.push_back(point || targets.weights.size() == 0 ? 1.0 : targets.weights[a]);
            sum += weights.back();
            places.push_back(place(targets.points.row(a)));
            gamma.push_back(model_.bounded() ? Real(0) : semivariance(places.back(), centre_));
        }
        Target out{Vector<Real>(at(n_), Real(0)), Vector<Real>(at(p_), Real(0)), 0};
        for (std::size_t a = 0; a < weights.size(); ++a) {
            weights[a] /= sum;
            const Vector<Real> row =
                driftRow(targets.points.row(first + static_cast<Index>(a)), targets.externalDrift, t);
            for (Index j = 0; j < p_; ++j) out.drift[at(j)] += weights[a] * row[at(j)];
            if (!field) continue;
            for (Index i = 0; i < n_; ++i)
                out.covariance[at(i)] +=
                    weights[a] * covariance(places[a], gamma[a], places_[at(i)], fromCentre(i));
            for (std::size_t b = 0; b <= a; ++b)
                out.variance += (a == b ? 1 : 2) * weights[a] * weights[b] *
                                covariance(places[a], gamma[a], places[b], gamma[b]);
        }
        const Index axes = point ? targets.points.cols() : targets.cellAxes;
        const Real nugget = data_.problem.model.nugget;
        for (Index a = first; a < last && axes > 0 && field; ++a) {
            const Real& weight = weights[at(a - first)];
            out.variance += weight * weight * nugget;
            const RowVectorXd cell = targets.points.row(a).head(axes);
            for (Index i = 0; i < n_; ++i)
                if (data_.problem.positions.row(first_[at(i)]).head(axes) == cell)
                    out.covariance[at(i)] += weight * nugget;
        }
        return out;
    }

    Matrix<Real> errorsLessSemivariances() const {
        Matrix<Real> out(n_, n_);
        for (Index i = 0; i < n_; ++i)
            for (Index j = 0; j < n_; ++j) {
                out(i, j) = -semivariance(places_[at(i)], places_[at(j)]);
                if (data_.samePlace(first_[at(i)], first_[at(j)])) out(i, j) += data_.problem.model.nugget;
                if (i == j) out(i, j) += errors_[at(i)];
            }
        return out;
    }

    const Data& data_;
    PreciseModel<Real> model_;
    Index n_, p_;
    Factor state_ = Factor::Ok;
    std::vector<Index> first_;  // a datum of each row
    Vector<Real> share_;        // of each datum in its row
    Vector<Real> errors_;
    std::vector<Vector<Real>> places_;
    Vector<Real> centre_, centreGamma_;  // unbounded models: increments to the centre
    Real level_ = 0;
    std::vector<Vector<Real>> drift_, values_, raw_;  // A, zeta, and z
    Matrix<Real> l_, m_;
    VectorXd reach_;
    RowVectorXd reference_, spread_;
    double fieldVariance_ = 0;
};

}  // namespace vlx::precise
