#pragma once

#include <cstdint>
#include <random>

#include "variolux/geostat/kriging.h"

namespace vlx::testing {

/// Random numbers that are the same on every platform.
class Random {
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    /// [0, 1)
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    double logUniform(double low, double high);
    double normal();
    /// 0 .. count - 1
    int below(int count) { return static_cast<int>(uniform() * count); }
    bool chance(double probability) { return uniform() < probability; }

  private:
    std::mt19937_64 engine_;
};

struct RandomProblemOptions {
    int fewestData = 1, mostData = 40;
    int targets = 4;
    /// Nearly coincident data, long ranges, smooth models without errors: condition numbers up to 1e16 and
    /// beyond.
    bool hard = false;
    bool coincident = true;
    bool unbounded = true;
};

struct RandomProblem {
    KrigingProblem problem;
    KrigingTargets targets;
};

/// Any model, any drift, any layout of data; the last target is at a datum.
RandomProblem randomProblem(Random& random, const RandomProblemOptions& options);

}  // namespace vlx::testing
