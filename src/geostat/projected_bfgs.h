#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace vlx {

struct BfgsResult {
    double value = 0;
    Eigen::VectorXd x;
    bool converged = false;
};

/// BFGS in a box by gradient projection (Nocedal and Wright, Numerical Optimization, 2nd ed., ch. 6
/// and 16.7): variables at a bound whose gradient points outwards are held; the others follow the
/// quasi-Newton direction with a backtracking (Armijo) line search along the projected path. `objective(x,
/// gradient)` returns the value (infinite where it does not exist; finite at the start) and fills the
/// gradient unless it is null. Converged when no free gradient component exceeds 1e-5 or progress falls below
/// rounding.
template <class Objective>
BfgsResult minimizeBfgs(const Objective& objective, Eigen::VectorXd x, const Eigen::VectorXd& lower,
                        const Eigen::VectorXd& upper, int iterations) {
    using Eigen::Index;
    const Index d = x.size();
    constexpr double longestStep = 1.5;
    Eigen::VectorXd gradient(d);
    double value = objective(x, &gradient);
    Eigen::MatrixXd inverseHessian = Eigen::MatrixXd::Identity(d, d);
    bool fresh = true;  // the inverse Hessian is a guess
    for (int iteration = 0; iteration < iterations; ++iteration) {
        Eigen::VectorXd free(d);
        for (Index i = 0; i < d; ++i)
            free[i] = (x[i] <= lower[i] && gradient[i] > 0) || (x[i] >= upper[i] && gradient[i] < 0) ? 0 : 1;
        const Eigen::VectorXd reduced = gradient.cwiseProduct(free);
        if (reduced.lpNorm<Eigen::Infinity>() < 1e-5) return {value, x, true};
        Eigen::VectorXd direction = -(inverseHessian * reduced).cwiseProduct(free);
        if (!(direction.dot(reduced) < 0)) {
            direction = -reduced;
            inverseHessian.setIdentity();
            fresh = true;
        }
        const double size = direction.lpNorm<Eigen::Infinity>();
        if (fresh) direction *= std::min(1.0, 0.3 / size);
        if (!fresh && size > longestStep) direction *= longestStep / size;

        Eigen::VectorXd next, nextGradient(d);
        double nextValue = 0;
        bool found = false;
        for (double t = 1; t > 1e-8 && !found; t *= 0.4) {
            next = (x + t * direction).cwiseMax(lower).cwiseMin(upper);
            nextValue = objective(next, nullptr);
            found = nextValue <= value + 1e-4 * reduced.dot(next - x) && next != x;
        }
        if (!found) {
            if (fresh) return {value, x, reduced.lpNorm<Eigen::Infinity>() < 1e-3};
            inverseHessian.setIdentity();
            fresh = true;
            continue;
        }
        nextValue = objective(next, &nextGradient);
        const Eigen::VectorXd s = next - x, y = nextGradient - gradient;
        const double sy = s.dot(y);
        const double gain = value - nextValue;
        x = next;
        gradient = nextGradient;
        value = nextValue;
        if (sy > 1e-10 * s.norm() * y.norm()) {
            if (fresh) inverseHessian = Eigen::MatrixXd::Identity(d, d) * (sy / y.squaredNorm());
            const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(d, d) - s * y.transpose() / sy;
            inverseHessian = left * inverseHessian * left.transpose() + s * s.transpose() / sy;
            fresh = false;
        }
        if (gain < 1e-12 * (1 + std::abs(value))) return {value, x, true};
    }
    return {value, x, false};
}

}  // namespace vlx
