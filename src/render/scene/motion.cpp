#include "render/scene/motion.h"

#include <algorithm>
#include <cmath>

namespace vlx::render {
namespace {

constexpr std::size_t kMostSteps = 64;
constexpr double kTolerance = 1e-4;

Transform between(const Transform& a, const Transform& b, double t) {
    Transform r;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 4; ++j) r.m[i][j] = a.m[i][j] * (1 - t) + b.m[i][j] * t;
    return r;
}

/// Greatest difference of two matrices' entries.
double distance(const Transform& a, const Transform& b) {
    double d = 0;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 4; ++j) d = std::max(d, std::abs(a.m[i][j] - b.m[i][j]));
    return d;
}

}  // namespace

Transform Motion::at(float time) const {
    if (!moves()) return places.front();
    const auto steps = static_cast<float>(places.size() - 1);
    const float position = std::clamp(time, 0.f, 1.f) * steps;
    const auto first = std::min(static_cast<std::size_t>(position), places.size() - 2);
    return between(places[first], places[first + 1],
                   static_cast<double>(position) - static_cast<double>(first));
}

Motion followed(const std::function<Transform(double)>& placeAt) {
    Motion motion;
    motion.places = {placeAt(0), placeAt(1)};
    for (;;) {
        const std::size_t steps = motion.places.size() - 1;
        std::vector<Transform> finer;
        double extent = 0, error = 0;
        for (std::size_t i = 0; i < steps; ++i) {
            const Transform& a = motion.places[i];
            const Transform& b = motion.places[i + 1];
            const Transform middle = placeAt((static_cast<double>(i) + 0.5) / static_cast<double>(steps));
            finer.push_back(a);
            finer.push_back(middle);
            error = std::max(error, distance(middle, between(a, b, 0.5)));
            extent = std::max({extent, distance(motion.places[0], b), distance(motion.places[0], middle)});
        }
        finer.push_back(motion.places.back());
        // Two halves of a step can be wrong together where a motion goes there and back.
        const bool fine = steps >= 4 && error <= kTolerance * extent;
        const bool straight = steps >= 4 && error <= 1e-9 * extent;
        if (extent == 0 && steps >= 4) return {};
        if (straight) {
            const std::vector<Transform> line{motion.places.front(), motion.places.back()};
            double off = 0;
            for (std::size_t i = 0; i < finer.size(); ++i)
                off = std::max(off, distance(finer[i], between(line[0], line[1],
                                                               static_cast<double>(i) /
                                                                   static_cast<double>(finer.size() - 1))));
            if (off <= 1e-9 * extent) motion.places = line;
            return motion;
        }
        if (fine || steps >= kMostSteps) return motion;
        motion.places = std::move(finer);
    }
}

bool alike(const Motion& a, const Motion& b) {
    constexpr double kRounding = 1e-12;
    Transform nowhere;
    nowhere.m = {};
    const std::size_t steps = std::max({a.places.size(), b.places.size(), std::size_t{2}}) - 1;
    for (std::size_t i = 0; i <= steps; ++i) {
        const float time = static_cast<float>(i) / static_cast<float>(steps);
        const Transform there = a.at(time);
        if (!(distance(there, b.at(time)) <= kRounding * distance(there, nowhere))) return false;
    }
    return true;
}

}  // namespace vlx::render
