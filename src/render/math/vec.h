#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/math/lanes.h"
#include "variolux/base/luminance.h"

namespace vlx::render {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

/// Three floats: a point, a direction, or a colour (Rgb); of Lanes, four of them side by side.
template <class Real>
struct Vec3Of {
    Real x{};
    Real y{};
    Real z{};

    constexpr Vec3Of() = default;
    constexpr Vec3Of(Real px, Real py, Real pz) : x(px), y(py), z(pz) {}
    constexpr explicit Vec3Of(Real v) : x(v), y(v), z(v) {}

    constexpr bool operator==(const Vec3Of&) const = default;
    constexpr Vec3Of operator-() const { return {-x, -y, -z}; }
    constexpr Vec3Of& operator+=(const Vec3Of& o) { return *this = {x + o.x, y + o.y, z + o.z}; }
    constexpr Vec3Of& operator*=(const Vec3Of& o) { return *this = {x * o.x, y * o.y, z * o.z}; }
    constexpr Vec3Of& operator*=(Real s) { return *this = {x * s, y * s, z * s}; }

    friend constexpr Vec3Of operator+(const Vec3Of& a, const Vec3Of& b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend constexpr Vec3Of operator-(const Vec3Of& a, const Vec3Of& b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend constexpr Vec3Of operator*(const Vec3Of& a, const Vec3Of& b) {
        return {a.x * b.x, a.y * b.y, a.z * b.z};
    }
    friend constexpr Vec3Of operator/(const Vec3Of& a, const Vec3Of& b) {
        return {a.x / b.x, a.y / b.y, a.z / b.z};
    }
    friend constexpr Vec3Of operator*(const Vec3Of& a, Real s) { return {a.x * s, a.y * s, a.z * s}; }
    friend constexpr Vec3Of operator*(Real s, const Vec3Of& a) { return a * s; }
    friend constexpr Vec3Of operator/(const Vec3Of& a, Real s) { return a * (1.f / s); }

    friend constexpr Real dot(const Vec3Of& a, const Vec3Of& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    friend constexpr Vec3Of cross(const Vec3Of& a, const Vec3Of& b) {
        return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    }
    friend constexpr Real lengthSquared(const Vec3Of& a) { return dot(a, a); }
    friend Real length(const Vec3Of& a) { return squareRoot(lengthSquared(a)); }
    friend Vec3Of normalized(const Vec3Of& a) { return a * (1.f / length(a)); }
    friend Vec3Of absolute(const Vec3Of& a) { return {magnitude(a.x), magnitude(a.y), magnitude(a.z)}; }
    friend constexpr Real maxComponent(const Vec3Of& a) { return larger(a.x, larger(a.y, a.z)); }
    friend constexpr auto isBlack(const Vec3Of& c) { return (c.x == 0) & (c.y == 0) & (c.z == 0); }
    /// The one or the other, lane by lane.
    friend constexpr Vec3Of select(Mask<Real> first, const Vec3Of& a, const Vec3Of& b) {
        return {first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z};
    }
};

using Vec3 = Vec3Of<float>;
/// Scene-linear colour; products are by component.
template <class Real>
using RgbOf = Vec3Of<Real>;
using Rgb = Vec3;

/// The same vector in each lane.
template <class Real>
constexpr Vec3Of<Real> everywhere(const Vec3& v) {
    return {spread<Real>(v.x), spread<Real>(v.y), spread<Real>(v.z)};
}

inline const Vec3& lane(const Vec3& v, std::size_t) { return v; }
inline Vec3 lane(const Vec3Of<Lanes>& v, std::size_t i) { return {v.x[i], v.y[i], v.z[i]}; }
/// Side by side, of f(0) to f(3).
template <class Function>
Vec3Of<Lanes> vectorsOf(const Function& f) {
    const Vec3 a = f(0), b = f(1), c = f(2), d = f(3);
    return {Lanes{a.x, b.x, c.x, d.x}, Lanes{a.y, b.y, c.y, d.y}, Lanes{a.z, b.z, c.z, d.z}};
}

inline bool isFinite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
/// Relative luminance of Rec. 709 primaries.
constexpr float luminance(const Rgb& c) { return vlx::luminance(c.x, c.y, c.z); }
template <class Real>
constexpr Real square(Real v) {
    return v * v;
}

/// What is in a scene lies no further from the origin along an axis, metres: a triangle's squared area is a
/// float still.
inline constexpr float kFarthest = 1e9f;
inline constexpr const char* kFarthestText = "1e9 m";

/// Two numbers in [0, 1), or two texture coordinates.
template <class Real>
struct Vec2Of {
    Real x{};
    Real y{};

    constexpr bool operator==(const Vec2Of&) const = default;
};
using Vec2 = Vec2Of<float>;

constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }

/// Right-handed orthonormal basis whose third axis is the given unit vector (Duff et al., "Building an
/// orthonormal basis, revisited", 2017).
template <class Real>
struct FrameOf {
    Vec3Of<Real> tangent{Real{} + 1, Real{}, Real{}};
    Vec3Of<Real> bitangent{Real{}, Real{} + 1, Real{}};
    Vec3Of<Real> normal{Real{}, Real{}, Real{} + 1};

    FrameOf() = default;
    explicit FrameOf(const Vec3Of<Real>& n) : normal(n) {
        const Real sign = signOf(n.z);
        const Real a = -1.f / (sign + n.z);
        const Real b = n.x * n.y * a;
        tangent = {1.f + sign * n.x * n.x * a, sign * b, -sign * n.x};
        bitangent = {b, sign + n.y * n.y * a, -n.y};
    }

    Vec3Of<Real> toLocal(const Vec3Of<Real>& v) const {
        return {dot(v, tangent), dot(v, bitangent), dot(v, normal)};
    }
    Vec3Of<Real> toWorld(const Vec3Of<Real>& v) const {
        return tangent * v.x + bitangent * v.y + normal * v.z;
    }
};
using Frame = FrameOf<float>;

struct Ray {
    Vec3 origin;
    Vec3 direction;  ///< unit length
    float time = 0;  ///< from 0 when the shutter opens to 1 when it closes
};

}  // namespace vlx::render
