#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

/// Four floats side by side, and what formulas that are written once for a float and for four (`Real`) use.
/// Every function gives each lane the bits that the float's version gives.
namespace vlx::render {

inline constexpr std::size_t kLanes = 4;
using Lanes [[gnu::vector_size(16)]] = float;
using LaneMask [[gnu::vector_size(16)]] = std::int32_t;

/// What stands for a float's and for four's.
template <class Real, class OfOne, class OfFour>
using PerReal = std::conditional_t<std::is_same_v<Real, float>, OfOne, OfFour>;

/// Of comparisons.
template <class Real>
using Mask = PerReal<Real, bool, LaneMask>;

inline bool any(bool mask) { return mask; }
inline bool any(LaneMask mask) {
    using Halves [[gnu::vector_size(16)]] = std::int64_t;
    const Halves halves = reinterpret_cast<Halves>(mask);
    return (halves[0] | halves[1]) != 0;
}
inline bool all(bool mask) { return mask; }
inline bool all(LaneMask mask) { return !any(~mask); }

/// std::max and std::min: of an undefined number and another, the first argument.
template <class Real>
constexpr Real larger(Real a, Real b) {
    return a < b ? b : a;
}
template <class Real>
constexpr Real smaller(Real a, Real b) {
    return b < a ? b : a;
}
template <class Real>
constexpr Real clamped(Real v, Real low, Real high) {
    return v < low ? low : high < v ? high : v;
}

inline float squareRoot(float v) { return std::sqrt(v); }
inline Lanes squareRoot(Lanes v) {
    return Lanes{std::sqrt(v[0]), std::sqrt(v[1]), std::sqrt(v[2]), std::sqrt(v[3])};
}

inline float magnitude(float v) { return std::abs(v); }
inline Lanes magnitude(Lanes v) {
    return reinterpret_cast<Lanes>(reinterpret_cast<LaneMask>(v) & 0x7fffffff);
}

/// 1 with the sign of v.
inline float signOf(float v) { return std::copysign(1.f, v); }
inline Lanes signOf(Lanes v) {
    constexpr Lanes kOne = {1, 1, 1, 1};
    const LaneMask sign = reinterpret_cast<LaneMask>(v) & static_cast<std::int32_t>(0x80000000u);
    return reinterpret_cast<Lanes>(reinterpret_cast<LaneMask>(kOne) | sign);
}

/// f of each lane.
template <class Function>
float each(float v, const Function& f) {
    return f(v);
}
template <class Function>
Lanes each(Lanes v, const Function& f) {
    return Lanes{f(v[0]), f(v[1]), f(v[2]), f(v[3])};
}

template <class Real>
constexpr Real spread(float v) {
    return Real{} + v;
}

/// True in every lane.
template <class Real>
constexpr Mask<Real> always() {
    return Real{} == 0;
}

/// f(i) of each lane where `there` is, 0 elsewhere.
template <class Function>
float eachLane(bool there, const Function& f) {
    return there ? f(0) : 0.f;
}
template <class Function>
Lanes eachLane(LaneMask there, const Function& f) {
    Lanes v{};
    for (std::size_t i = 0; i < kLanes; ++i)
        if (there[i] != 0) v[i] = f(i);
    return v;
}

inline float laneOf(float v, std::size_t) { return v; }
inline float laneOf(Lanes v, std::size_t i) { return v[i]; }

/// Side by side, of f(0) to f(3).
template <class Function>
Lanes lanesOf(const Function& f) {
    return Lanes{f(0), f(1), f(2), f(3)};
}

template <class Function>
LaneMask maskOf(const Function& f) {
    return LaneMask{-f(0), -f(1), -f(2), -f(3)};
}

}  // namespace vlx::render
