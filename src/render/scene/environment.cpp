#include <cassert>

#include "render/light/light.h"

namespace vlx::render {

Environment::Environment(const Rgb& constant) : present_(true), constant_(constant), mean_(constant) {}

Environment::Environment(int width, int height, std::vector<Rgb> pixels)
    : present_(true), width_(width), height_(height), pixels_(std::move(pixels)) {
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    assert(pixels_.size() == w * h && w > 0 && h > 0);
    std::vector<float> rowWeights(h);
    columns_.reserve(h);
    double mean[3] = {0, 0, 0};
    for (std::size_t y = 0; y < h; ++y) {
        std::vector<float> weights(w);
        double sum = 0;
        // Solid angle of a pixel of this row, as a fraction of the sphere.
        const double top = std::cos(std::numbers::pi * static_cast<double>(y) / static_cast<double>(h));
        const double bottom =
            std::cos(std::numbers::pi * static_cast<double>(y + 1) / static_cast<double>(h));
        const double part = 0.5 * (top - bottom) / static_cast<double>(w);
        for (std::size_t x = 0; x < w; ++x) {
            const Rgb& p = pixels_[y * w + x];
            weights[x] = std::max(luminance(p), maxComponent(p) * 0.1f);
            sum += weights[x];
            mean[0] += part * p.x;
            mean[1] += part * p.y;
            mean[2] += part * p.z;
        }
        columns_.emplace_back(weights);
        rowWeights[y] = static_cast<float>(sum * part);
    }
    rows_ = Distribution(rowWeights);
    mean_ = {static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2])};
}

namespace {

struct PixelIndex {
    std::size_t x;
    std::size_t y;
};

PixelIndex pixelOf(const Vec3& d, int width, int height) {
    const float phi = std::atan2(d.x, -d.z);  // 0 in the middle, positive to the right
    const float theta = std::acos(std::clamp(d.y, -1.f, 1.f));
    const auto index = [](float t, int size) {
        return static_cast<std::size_t>(
            std::clamp(static_cast<int>(t * static_cast<float>(size)), 0, size - 1));
    };
    return {index(phi / (2 * kPi) + 0.5f, width), index(theta / kPi, height)};
}

/// Directions of a row of pixels: cosines of its upper and lower border.
struct RowBorders {
    float top;
    float bottom;
};

RowBorders rowBorders(std::size_t y, int height) {
    return {std::cos(kPi * static_cast<float>(y) / static_cast<float>(height)),
            std::cos(kPi * static_cast<float>(y + 1) / static_cast<float>(height))};
}

float solidAngle(std::size_t y, int width, int height) {
    const auto [top, bottom] = rowBorders(y, height);
    return 2 * kPi * (top - bottom) / static_cast<float>(width);
}

}  // namespace

Rgb Environment::radiance(const Vec3& direction) const {
    if (pixels_.empty()) return constant_;
    const auto [x, y] = pixelOf(direction, width_, height_);
    return pixels_[y * static_cast<std::size_t>(width_) + x];
}

Environment::Sample Environment::sample(const Vec3& normal, bool bothSides, Vec2 u) const {
    if (!pixels_.empty()) {
        const Distribution::Sample row = rows_.sample(u.y);
        const Distribution::Sample column = columns_[row.index].sample(u.x);
        const auto [top, bottom] = rowBorders(row.index, height_);
        const float cosTheta = top + (bottom - top) * row.remapped;
        const float sinTheta = std::sqrt(std::max(0.f, 1 - cosTheta * cosTheta));
        const float phi =
            2 * kPi *
            ((static_cast<float>(column.index) + column.remapped) / static_cast<float>(width_) - 0.5f);
        return {{sinTheta * std::sin(phi), cosTheta, -sinTheta * std::cos(phi)},
                row.probability * column.probability / solidAngle(row.index, width_, height_)};
    }
    if (bothSides) {
        const Vec3 d = uniformCone(u, 2);
        return {d, 0.25f * kInvPi};
    }
    const Vec3 local = cosineHemisphere(u);
    return {Frame(normal).toWorld(local), local.z * kInvPi};
}

float Environment::pdf(const Vec3& direction, const Vec3& normal, bool bothSides) const {
    if (!pixels_.empty()) {
        const auto [x, y] = pixelOf(direction, width_, height_);
        return rows_.probability(y) * columns_[y].probability(x) / solidAngle(y, width_, height_);
    }
    return bothSides ? 0.25f * kInvPi : std::max(0.f, dot(direction, normal)) * kInvPi;
}

}  // namespace vlx::render
