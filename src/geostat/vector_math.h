#pragma once

#include <utility>

/// Elementary functions of several doubles at a time, in GCC's vector types of 16, 32 or 64 bytes: no
/// branches, accurate to about an ulp, and the same bits for every width. Always inlined, so that they are
/// compiled for the instruction set of their caller. Translation units that include this header are compiled
/// with -ffp-contract=off -fno-math-errno.
namespace vlx::kernels {

template <class T, int bytes>
struct Vectors {
    using Type [[gnu::vector_size(bytes)]] = T;
    /// For memory that is aligned like its elements only.
    using Loose [[gnu::vector_size(bytes), gnu::aligned(alignof(T)), gnu::may_alias]] = T;
};

template <class V>
inline constexpr int kLanes = static_cast<int>(sizeof(V) / sizeof(std::declval<V>()[0]));

template <class V>
using IntegersLike = typename Vectors<long long, sizeof(V)>::Type;

template <class V, class T>
[[gnu::always_inline]] inline V load(const T* p) {
    return *reinterpret_cast<const typename Vectors<T, sizeof(V)>::Loose*>(p);
}
template <class V, class T>
[[gnu::always_inline]] inline void store(T* p, V x) {
    *reinterpret_cast<typename Vectors<T, sizeof(V)>::Loose*>(p) = x;
}

template <class V>
[[gnu::always_inline]] inline V spread(double x) {
    return x - V{};
}
template <class V>
[[gnu::always_inline]] inline V maximum(V a, V b) {
    return a > b ? a : b;
}
template <class V>
[[gnu::always_inline]] inline V minimum(V a, V b) {
    return a < b ? a : b;
}
template <class V>
[[gnu::always_inline]] inline V squareRoot(V x) {
    V y;
    for (int i = 0; i < kLanes<V>; ++i) y[i] = __builtin_sqrt(x[i]);
    return y;
}

/// exp(y) = scale + scale * rest for |y| <= 708: y = k ln 2 + r, |r| <= ln 2 / 2, scale = 2^k, and rest =
/// expm1(r) by its Taylor series to r^13 (truncation below 2e-17 r).
template <class V>
struct Exponential {
    V scale;
    V rest;
};

template <class V>
[[gnu::always_inline]] inline Exponential<V> exponential(V y) {
    const V shift = spread<V>(0x1.8p52);
    const V shifted = y * 1.4426950408889634074 + shift;
    const V k = shifted - shift;
    const V r = (y - k * 0x1.62e42fee00000p-1) - k * 0x1.a39ef35793c76p-33;
    // Estrin's order: short chains of dependent operations.
    const V r2 = r * r, r4 = r2 * r2;
    const V low = (0.5 + r * (1.0 / 6)) + r2 * (1.0 / 24 + r * (1.0 / 120));
    const V middle = (1.0 / 720 + r * (1.0 / 5040)) + r2 * (1.0 / 40320 + r * (1.0 / 362880));
    const V high = (1.0 / 3628800 + r * (1.0 / 39916800)) + r2 * (1.0 / 479001600 + r * (1.0 / 6227020800));
    const V p = low + r4 * (middle + r4 * high);
    // The low bits of `shifted` are the integer k.
    const IntegersLike<V> bits = (reinterpret_cast<IntegersLike<V>>(shifted) << 52) + 0x3ff0000000000000;
    return {reinterpret_cast<V>(bits), r + r2 * p};
}

/// exp(-x) for x >= 0.
template <class V>
[[gnu::always_inline]] inline V decay(V x) {
    const Exponential<V> e = exponential(-minimum(x, spread<V>(708.0)));
    return x > 708.0 ? V{} : e.scale + e.scale * e.rest;
}

/// 1 - exp(-x) for x >= 0, accurate relative to itself.
template <class V>
[[gnu::always_inline]] inline V decayComplement(V x) {
    const Exponential<V> e = exponential(-minimum(x, spread<V>(708.0)));
    return (1.0 - e.scale) - e.scale * e.rest;
}

/// log(x) for normal x > 0: x = 2^k m with m in [sqrt(1/2), sqrt(2)), log m = 2 artanh((m - 1) / (m + 1)).
template <class V>
[[gnu::always_inline]] inline V logarithm(V x) {
    const IntegersLike<V> bits = reinterpret_cast<IntegersLike<V>>(x);
    // Subtracting the bits of sqrt(1/2) carries into the exponent exactly where m reaches sqrt(2).
    const IntegersLike<V> exponent = (bits - 0x3fe6a09e667f3bcd) >> 52;
    const V m = reinterpret_cast<V>(bits - (exponent << 52));
    const V shift = spread<V>(0x1.8p52);
    const V k = reinterpret_cast<V>(exponent + reinterpret_cast<IntegersLike<V>>(shift)) - shift;
    const V s = (m - 1.0) / (m + 1.0);
    const V s2 = s * s;
    const V s4 = s2 * s2, s8 = s4 * s4;
    const V low = (2.0 / 3 + s2 * (2.0 / 5)) + s4 * (2.0 / 7 + s2 * (2.0 / 9));
    const V middle = (2.0 / 11 + s2 * (2.0 / 13)) + s4 * (2.0 / 15 + s2 * (2.0 / 17));
    const V high = (2.0 / 19 + s2 * (2.0 / 21)) + s4 * (2.0 / 23);
    const V p = low + s8 * (middle + s8 * high);
    return k * 0x1.62e42fefa39efp-1 + (2.0 * s + s * s2 * p);
}

/// x^a for x >= 0 and a > 0, to about (1 + |a log x|) ulp; 0^a = 0.
template <class V>
[[gnu::always_inline]] inline V power(V x, V a) {
    const V y = a * logarithm(maximum(x, spread<V>(0x1p-1000)));
    const Exponential<V> e = exponential(maximum(minimum(y, spread<V>(700.0)), spread<V>(-700.0)));
    return x > 0.0 ? e.scale + e.scale * e.rest : V{};
}

}  // namespace vlx::kernels
