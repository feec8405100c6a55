#pragma once

#include <utility>

// SIMD, with the same bits on every instruction set; two ways to it. Files that use either are compiled with
// -ffp-contract=off -fno-math-errno.

/// Where the compiler vectorises by itself: marks a function with long loops over floats, which is compiled
/// for AVX2 as well and chosen at run time. Not under sanitizers, whose instrumented resolvers run before
/// their runtime is ready; nor without optimisation, which has no use for it. What takes or returns vectors
/// is always inlined: compiled by itself, for another instruction set than its caller, it would look for them
/// in other registers.
#if defined(__x86_64__) && defined(__OPTIMIZE__) && !defined(VARIOLUX_SANITIZED)
#define VLX_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define VLX_WIDE
#endif

/// Where it cannot: elementary functions of several doubles at a time, in GCC's vector types of 16, 32 or 64
/// bytes: no branches, accurate to about an ulp. Always inlined, so that they are compiled for the
/// instruction set of their caller.
namespace vlx::simd {

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

/// Eight floats: two registers with SSE, one with AVX; the same sums in both, since their order is fixed.
using Eight = Vectors<float, 32>::Type;
using EightIntegers = Vectors<int, 32>::Type;
inline constexpr EightIntegers kEightLanes = {0, 1, 2, 3, 4, 5, 6, 7};

/// Lane i is v[from[i]].
template <class V, class Integers>
[[gnu::always_inline]] inline V permute(V v, Integers from) {
#ifdef __clang__
    V permuted = {};
    for (int i = 0; i < kLanes<V>; ++i) permuted[i] = v[from[i]];
    return permuted;
#else
    return __builtin_shuffle(v, from);
#endif
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
    for (int i = 0; i < kLanes<V>; ++i) x[i] = __builtin_sqrt(x[i]);
    return x;
}

/// scale + scale * rest, scale = 2^k.
template <class V>
struct Exponential {
    V scale;
    V rest;
};

/// Adding this to |k| < 2^51 rounds it to an integer, which is then in the low bits of the sum.
inline constexpr double kRounding = 0x1.8p52;

/// 2^k exp(r) for |r| <= ln 2 / 2 and k in the low bits of `shifted`: rest = expm1(r) = r + r^2 p(r), p of
/// degree 9 with the smallest error of r p(r) (1.8e-17, by Remez's exchange).
template <class V>
[[gnu::always_inline]] inline Exponential<V> scaledExponential(V shifted, V r) {
    // Estrin's order: short chains of dependent operations.
    const V r2 = r * r, r4 = r2 * r2;
    const V low = (0x1.0000000000005p-1 + r * 0x1.555555555555cp-3) +
                  r2 * (0x1.5555555552139p-5 + r * 0x1.111111110e701p-7);
    const V middle = (0x1.6c16c17f2969ap-10 + r * 0x1.a01a01b5c9715p-13) +
                     r2 * (0x1.a019a6a93c039p-16 + r * 0x1.71ddea2558614p-19);
    const V high = 0x1.28a28ce1d3300p-22 + r * 0x1.af767addad9b0p-26;
    const V p = low + r4 * (middle + r4 * high);
    const IntegersLike<V> bits = (reinterpret_cast<IntegersLike<V>>(shifted) << 52) + 0x3ff0000000000000;
    return {reinterpret_cast<V>(bits), r + r2 * p};
}

/// exp(y) for |y| <= 708.
template <class V>
[[gnu::always_inline]] inline Exponential<V> exponential(V y) {
    const V shifted = y * 1.4426950408889634074 + kRounding;
    const V k = shifted - kRounding;
    return scaledExponential(shifted, (y - k * 0x1.62e42fee00000p-1) - k * 0x1.a39ef35793c76p-33);
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

/// log2(x) for normal x > 0: x = 2^k m with m in [sqrt(1/2), sqrt(2)), log2 m = 2 artanh(s) / ln 2 =
/// 2 s / ln 2 + s^3 p(s^2), s = (m - 1) / (m + 1), p of degree 6 likewise (s^2 p to 2e-18).
template <class V>
[[gnu::always_inline]] inline V binaryLogarithm(V x) {
    const IntegersLike<V> bits = reinterpret_cast<IntegersLike<V>>(x);
    // Subtracting the bits of sqrt(1/2) carries into the exponent exactly where m reaches sqrt(2).
    const IntegersLike<V> exponent = (bits - 0x3fe6a09e667f3bcd) >> 52;
    const V m = reinterpret_cast<V>(bits - (exponent << 52));
    const V k =
        reinterpret_cast<V>(exponent + reinterpret_cast<IntegersLike<V>>(spread<V>(kRounding))) - kRounding;
    const V s = (m - 1.0) / (m + 1.0);
    const V s2 = s * s;
    const V s4 = s2 * s2, s8 = s4 * s4;
    const V low =
        (0.9617966939259842 + s2 * 0.5770780163477706) + s4 * (0.4121985854577889 + s2 * 0.3205985676900475);
    const V high = (0.26233286684395196 + s2 * 0.2209471693992593) + s4 * 0.21334733564523684;
    const V p = low + s8 * high;
    return k + (s * 2.8853900817779268 + s * s2 * p);
}

/// The two halves of power(): log2(x^a), and 2^y = x^a given x.
template <class V>
[[gnu::always_inline]] inline V powerLogarithm(V x, V a) {
    return a * binaryLogarithm(minimum(x, spread<V>(0x1p1000)));
}
template <class V>
[[gnu::always_inline]] inline V powerOfTwo(V x, V y) {
    const V shifted = y + kRounding;
    const V k = shifted - kRounding;
    const Exponential<V> e = scaledExponential(shifted, (y - k) * 0x1.62e42fefa39efp-1);
    return x > 0.0 ? e.scale + e.scale * e.rest : V{};
}

/// x^a for x >= 0 and 0 < a <= 1, to about (1 + |a log x|) ulp; 0^a = 0. x counts as at most 2^1000, and as
/// at least 2^-1023 if positive.
template <class V>
[[gnu::always_inline]] inline V power(V x, V a) {
    return powerOfTwo(x, powerLogarithm(x, a));
}

/// exp(-d) within 0.02 for d >= 0, exactly 0 from 8 on: (1 - d/8)^8. A weight needs no more, and this is four
/// products.
template <class T>
[[gnu::always_inline]] inline T nearExp(T d) {
    const T base = 1 - 0.125f * d;
    const T positive = base > 0 ? base : T{};
    const T square = positive * positive;
    const T fourth = square * square;
    return fourth * fourth;
}

}  // namespace vlx::simd
