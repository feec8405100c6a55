#include "geostat/precise_kriging.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <tuple>

#include "geostat/kriging_names.h"
#include "geostat/precise_system.h"

namespace vlx {
namespace {

using precise::Data;
using precise::Factor;
using precise::System;

/// Sets next's errors to its differences from the last answer; whether all are within the tolerance.
bool agree(const PreciseAnswer& last, PreciseAnswer& next, double tolerance) {
    const Index rows = next.estimate.rows();
    next.accurate.assign(static_cast<std::size_t>(rows), false);
    next.estimateError = MatrixXd::Constant(rows, next.estimate.cols(), kInfinity);
    next.varianceError = VectorXd::Constant(rows, kInfinity);
    bool all = true;
    for (Index i = 0; i < rows; ++i) {
        const auto at = static_cast<std::size_t>(i);
        if (!next.determined.empty() && !next.determined[at]) {
            next.accurate[at] = !last.determined[at];
            all = all && next.accurate[at];
            continue;
        }
        // Differences, and the rounding to double of both.
        next.estimateError.row(i) = (next.estimate.row(i) - last.estimate.row(i)).cwiseAbs() +
                                    kEpsilon * next.estimate.row(i).cwiseAbs();
        next.varianceError[i] =
            std::abs(next.variance[i] - last.variance[i]) + kEpsilon * std::abs(next.variance[i]);
        bool good = next.varianceError[i] <=
                    tolerance * next.varianceScale[i] + 4 * kEpsilon * std::abs(next.variance[i]);
        for (Index c = 0; c < next.estimate.cols(); ++c)
            good = good && next.estimateError(i, c) <= tolerance * next.estimateScale(i, c) +
                                                           4 * kEpsilon * std::abs(next.estimate(i, c));
        next.accurate[at] = good;
        all = all && good;
    }
    return all;
}

}  // namespace

struct PreciseKriging::Levels {
    template <unsigned digits>
    struct Level {
        static constexpr int kDigits = digits;
        std::optional<System<PreciseReal<digits>>> system;
    };

    Data data;
    std::mutex mutex;
    std::tuple<Level<50>, Level<100>, Level<200>, Level<400>> all;

    /// Asks with more and more digits. If no two answers agree: the last one, with what it differs by.
    template <class Question>
    PreciseAnswer settle(const PreciseAnswer& known, const Question& question) {
        const KrigingAccuracy& accuracy = data.problem.accuracy;
        PreciseAnswer last = known;
        bool done = false;
        const auto ask = [&](auto& level) {
            if (done || level.kDigits > accuracy.mostDigits) return;
            {
                const std::lock_guard lock(mutex);
                if (!level.system) level.system.emplace(data);
            }
            done = level.system->state() == Factor::Indefinite;
            if (level.system->state() != Factor::Ok) return;
            PreciseAnswer next = question(*level.system);
            next.digits = level.kDigits;
            if (!next.estimate.allFinite() || !next.variance.allFinite()) return;
            done = agree(last, next, accuracy.tolerance);
            last = std::move(next);
        };
        std::apply([&](auto&... level) { (ask(level), ...); }, all);
        return last;
    }
};

PreciseKriging::PreciseKriging(const KrigingProblem& problem, const VectorXd& origin,
                               const std::vector<Index>& row, const std::vector<Index>& drift)
    : levels_(std::make_unique<Levels>()) {
    levels_->data = {problem, origin, row, drift, 0};
    for (const Index r : row) levels_->data.rows = std::max(levels_->data.rows, r + 1);
}

PreciseKriging::~PreciseKriging() = default;

PreciseAnswer PreciseKriging::predict(const PreciseAnswer& known, const KrigingTargets& targets,
                                      const std::vector<Index>& which,
                                      const KrigingPredictOptions& options) const {
    return levels_->settle(known, [&](const auto& s) { return s.predict(targets, which, options); });
}

PreciseAnswer PreciseKriging::drift(const PreciseAnswer& known) const {
    return levels_->settle(known, [](const auto& s) { return s.drift(); });
}

PreciseAnswer PreciseKriging::leaveOneOut(const PreciseAnswer& known) const {
    return levels_->settle(known, [](const auto& s) { return s.leaveOneOut(); });
}

}  // namespace vlx
