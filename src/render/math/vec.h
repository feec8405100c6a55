#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "variolux/base/luminance.h"

namespace vlx::render {

inline constexpr float kPi = std::numbers::pi_v<float>;
inline constexpr float kInvPi = std::numbers::inv_pi_v<float>;

/// Three floats: a point, a direction, or a colour (Rgb).
struct Vec3 {
    float x = 0;
    float y = 0;
    float z = 0;

    constexpr Vec3() = default;
    constexpr Vec3(float px, float py, float pz) : x(px), y(py), z(pz) {}
    constexpr explicit Vec3(float v) : x(v), y(v), z(v) {}

    constexpr bool operator==(const Vec3&) const = default;
    constexpr Vec3 operator-() const { return {-x, -y, -z}; }
    constexpr Vec3& operator+=(const Vec3& o) { return *this = {x + o.x, y + o.y, z + o.z}; }
    constexpr Vec3& operator*=(const Vec3& o) { return *this = {x * o.x, y * o.y, z * o.z}; }
    constexpr Vec3& operator*=(float s) { return *this = {x * s, y * s, z * s}; }
};

/// Scene-linear colour; products are by component.
using Rgb = Vec3;

constexpr Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr Vec3 operator/(const Vec3& a, const Vec3& b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
constexpr Vec3 operator*(const Vec3& a, float s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(float s, const Vec3& a) { return a * s; }
constexpr Vec3 operator/(const Vec3& a, float s) { return a * (1.f / s); }

constexpr float dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
constexpr float lengthSquared(const Vec3& a) { return dot(a, a); }
inline float length(const Vec3& a) { return std::sqrt(lengthSquared(a)); }
inline Vec3 normalized(const Vec3& a) { return a * (1.f / length(a)); }
inline Vec3 absolute(const Vec3& a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
constexpr float maxComponent(const Vec3& a) { return std::max(a.x, std::max(a.y, a.z)); }
constexpr bool isBlack(const Rgb& c) { return c.x == 0 && c.y == 0 && c.z == 0; }
inline bool isFinite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
/// Relative luminance of Rec. 709 primaries.
constexpr float luminance(const Rgb& c) { return vlx::luminance(c.x, c.y, c.z); }
constexpr float square(float v) { return v * v; }

/// What is in a scene lies no further from the origin along an axis, metres: a triangle's squared area is a
/// float still.
inline constexpr float kFarthest = 1e9f;
inline constexpr const char* kFarthestText = "1e9 m";

/// Two numbers in [0, 1), or two texture coordinates.
struct Vec2 {
    float x = 0;
    float y = 0;

    constexpr bool operator==(const Vec2&) const = default;
};

constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }

/// Right-handed orthonormal basis whose third axis is the given unit vector (Duff et al., "Building an
/// orthonormal basis, revisited", 2017).
struct Frame {
    Vec3 tangent{1, 0, 0};
    Vec3 bitangent{0, 1, 0};
    Vec3 normal{0, 0, 1};

    Frame() = default;
    explicit Frame(const Vec3& n) : normal(n) {
        const float sign = std::copysign(1.f, n.z);
        const float a = -1.f / (sign + n.z);
        const float b = n.x * n.y * a;
        tangent = {1.f + sign * n.x * n.x * a, sign * b, -sign * n.x};
        bitangent = {b, sign + n.y * n.y * a, -n.y};
    }

    Vec3 toLocal(const Vec3& v) const { return {dot(v, tangent), dot(v, bitangent), dot(v, normal)}; }
    Vec3 toWorld(const Vec3& v) const { return tangent * v.x + bitangent * v.y + normal * v.z; }
};

struct Ray {
    Vec3 origin;
    Vec3 direction;  ///< unit length
    float time = 0;  ///< from 0 when the shutter opens to 1 when it closes
};

}  // namespace vlx::render
