#include "geostat/batch_kernel.h"

#include <algorithm>

#include "geostat/structure_kernel.h"
#include "geostat/vector_math.h"

namespace vlx::kernels {
namespace {

using Eigen::Index;

constexpr Index kBlock = 4;

/// Covariance of the structures at a squared distance.
template <class V>
[[gnu::always_inline]] inline V structures(const Batch& b, V squared) {
    V sum{};
    for (std::size_t s = 0; s < b.types.size(); ++s) {
        const std::size_t at = s * static_cast<std::size_t>(kLanes<V>);
        const V value = structureValue<V>(b.types[s], squared * load<V>(b.inverseSquaredRange.data() + at),
                                          load<V>(b.halfShape.data() + at), b.fixedShape[s], false);
        sum += load<V>(b.sill.data() + at) * value;
    }
    return sum;
}

template <class V>
[[gnu::always_inline]] inline V squaredDistance(const double* a, const double* b, Index axes) {
    V sum{};
    for (Index k = 0; k < axes; ++k) {
        const V d = load<V>(a + k * kLanes<V>) - load<V>(b + k * kLanes<V>);
        sum += d * d;
    }
    return sum;
}

/// Fills the lower half and the targets' rows; a lane's `lowest` becomes -1 where the general solver is
/// needed.
template <class V>
[[gnu::always_inline]] inline void fill(Batch& b) {
    constexpr Index w = kLanes<V>;
    V lowest{};
    V sill{};
    for (std::size_t s = 0; s < b.types.size(); ++s)
        sill += load<V>(b.sill.data() + static_cast<Index>(s) * w);
    for (Index i = 0; i < b.n; ++i) {
        const double* place = b.places.data() + i * b.axes * w;
        const V active = load<V>(b.active.data() + i * w);
        for (Index j = 0; j < i; ++j) {
            const V squared = squaredDistance<V>(place, b.places.data() + j * b.axes * w, b.axes);
            lowest = squared > 0.0 ? lowest : spread<V>(-1.0);
            store(b.row(i) + j * w, active * structures(b, squared));
        }
        store(b.row(i) + i * w, active * (sill + load<V>(b.diagonal.data() + i * w)) + (1.0 - active));
    }
    for (Index t = 0; t < b.targets; ++t)
        for (Index i = 0; i < b.n; ++i) {
            const V squared = squaredDistance<V>(b.points.data() + t * b.axes * w,
                                                 b.places.data() + i * b.axes * w, b.axes);
            const V special = load<V>(b.special.data() + i * w);
            lowest = squared > 0.0 ? lowest : (special > 0.0 ? spread<V>(-1.0) : lowest);
            store(b.row(b.targetRow() + t) + i * w,
                  load<V>(b.active.data() + i * w) * structures(b, squared));
        }
    store(b.lowest.data(), lowest);
}

/// Cholesky by blocks of four rows and columns, all rows below the matrix carried along as right-hand sides.
template <class V>
[[gnu::always_inline]] inline void factorise(Batch& b) {
    constexpr Index w = kLanes<V>;
    const Index rows = b.n + (b.drift + b.columns + b.targets + kBlock - 1) / kBlock * kBlock;
    V inverse[kBlock];
    V lowest = spread<V>(2.0);
    for (Index j = 0; j < b.n; j += kBlock)
        for (Index i = j; i < rows; i += kBlock) {
            // Sums over the columns already done; two rows at a time keep them in registers.
            for (Index r = 0; r < kBlock; r += 2) {
                double* r0 = b.row(i + r);
                double* r1 = b.row(i + r + 1);
                const double* c0 = b.row(j);
                const double* c1 = b.row(j + 1);
                const double* c2 = b.row(j + 2);
                const double* c3 = b.row(j + 3);
                V s00 = load<V>(r0 + j * w), s01 = load<V>(r0 + (j + 1) * w);
                V s02 = load<V>(r0 + (j + 2) * w), s03 = load<V>(r0 + (j + 3) * w);
                V s10 = load<V>(r1 + j * w), s11 = load<V>(r1 + (j + 1) * w);
                V s12 = load<V>(r1 + (j + 2) * w), s13 = load<V>(r1 + (j + 3) * w);
                for (Index k = 0; k < j * w; k += w) {
                    const V x0 = load<V>(r0 + k), x1 = load<V>(r1 + k);
                    const V y0 = load<V>(c0 + k), y1 = load<V>(c1 + k);
                    s00 -= x0 * y0;
                    s10 -= x1 * y0;
                    s01 -= x0 * y1;
                    s11 -= x1 * y1;
                    const V y2 = load<V>(c2 + k), y3 = load<V>(c3 + k);
                    s02 -= x0 * y2;
                    s12 -= x1 * y2;
                    s03 -= x0 * y3;
                    s13 -= x1 * y3;
                }
                store(r0 + j * w, s00);
                store(r0 + (j + 1) * w, s01);
                store(r0 + (j + 2) * w, s02);
                store(r0 + (j + 3) * w, s03);
                store(r1 + j * w, s10);
                store(r1 + (j + 1) * w, s11);
                store(r1 + (j + 2) * w, s12);
                store(r1 + (j + 3) * w, s13);
            }
            for (Index r = 0; r < kBlock; ++r) {
                double* x = b.row(i + r);
                const Index last = i == j ? r + 1 : kBlock;
                for (Index c = 0; c < last; ++c) {
                    const double* l = b.row(j + c);
                    V s = load<V>(x + (j + c) * w);
                    for (Index k = 0; k < c; ++k) s -= load<V>(x + (j + k) * w) * load<V>(l + (j + k) * w);
                    if (i == j && c == r) {
                        const V active = load<V>(b.active.data() + (j + c) * w);
                        V variance = load<V>(b.diagonal.data() + (j + c) * w);
                        for (std::size_t k = 0; k < b.types.size(); ++k)
                            variance += load<V>(b.sill.data() + static_cast<Index>(k) * w);
                        lowest = active > 0.0 ? minimum(lowest, s / variance) : lowest;
                        // A lane that breaks down goes on with a harmless number; `lowest` tells.
                        s = squareRoot(s > 0.0 ? s : spread<V>(1.0));
                        inverse[c] = 1.0 / s;
                        store(x + (j + c) * w, s);
                    } else {
                        store(x + (j + c) * w, s * inverse[c]);
                    }
                }
            }
        }
    const V before = load<V>(b.lowest.data());
    store(b.lowest.data(), before < 0.0 ? before : lowest);
}

template <class V>
[[gnu::always_inline]] inline V dot(const double* a, const double* b, Index n) {
    V sum{};
    for (Index k = 0; k < n * kLanes<V>; k += kLanes<V>) sum += load<V>(a + k) * load<V>(b + k);
    return sum;
}

/// Orthonormal drift by modified Gram-Schmidt, applied to the targets' drift along the way:
///     L^-1 F = Q R,   t = R^-T f0 - Q'k,   estimate = k'y + t'(Q'y),   variance = C00 - k'k + t't
/// with k = L^-1 c0 and y = L^-1 z.
template <class V>
[[gnu::always_inline]] inline void predict(Batch& b) {
    constexpr Index w = kLanes<V>;
    V dependence = spread<V>(1.0);
    V sill{};
    for (std::size_t s = 0; s < b.types.size(); ++s)
        sill += load<V>(b.sill.data() + static_cast<Index>(s) * w);
    for (Index c = 0; c < b.columns; ++c) {
        const double* y = b.row(b.valueRow() + c);
        store(b.squares.data() + c * w, dot<V>(y, y, b.n));
    }
    for (Index t = 0; t < b.targets; ++t) {
        const double* k = b.row(b.targetRow() + t);
        for (Index c = 0; c < b.columns; ++c)
            store(b.estimate.data() + (t * b.columns + c) * w, dot<V>(k, b.row(b.valueRow() + c), b.n));
        store(b.variance.data() + t * w, sill - dot<V>(k, k, b.n));
    }
    for (Index a = 0; a < b.drift; ++a) {
        double* q = b.row(b.driftRow() + a);
        const V before = dot<V>(q, q, b.n);
        // Against the columns before, twice: the second time removes what rounding left of the first.
        for (int pass = 0; pass < 2; ++pass)
            for (Index e = 0; e < a; ++e) {
                const double* other = b.row(b.driftRow() + e);
                const V r = dot<V>(q, other, b.n);
                for (Index i = 0; i < b.n * w; i += w) store(q + i, load<V>(q + i) - r * load<V>(other + i));
                for (Index t = 0; t < b.targets; ++t) {
                    double* f = b.f0.data() + t * b.drift * w;
                    store(f + a * w, load<V>(f + a * w) - r * load<V>(f + e * w));
                }
            }
        const V after = dot<V>(q, q, b.n);
        dependence = minimum(dependence, after > 0.0 ? after / before : V{});
        const V inverse = 1.0 / squareRoot(after > 0.0 ? after : spread<V>(1.0));
        for (Index i = 0; i < b.n * w; i += w) store(q + i, load<V>(q + i) * inverse);
        for (Index t = 0; t < b.targets; ++t) {
            double* f = b.f0.data() + (t * b.drift + a) * w;
            const V scaled = load<V>(f) * inverse;
            store(f, scaled);
            const V gain = scaled - dot<V>(q, b.row(b.targetRow() + t), b.n);
            store(b.variance.data() + t * w, load<V>(b.variance.data() + t * w) + gain * gain);
            for (Index c = 0; c < b.columns; ++c) {
                double* estimate = b.estimate.data() + (t * b.columns + c) * w;
                store(estimate, load<V>(estimate) + gain * dot<V>(q, b.row(b.valueRow() + c), b.n));
            }
        }
    }
    store(b.dependence.data(), squareRoot(dependence));
}

template <int bytes>
[[gnu::always_inline]] inline void solveBody(Batch& b) {
    using V = typename Vectors<double, bytes>::Type;
    fill<V>(b);
    factorise<V>(b);
    predict<V>(b);
}

[[gnu::target("avx512f,avx512dq,avx512vl")]] void solveAvx512(Batch& b) { solveBody<64>(b); }
[[gnu::target("avx2")]] void solveAvx2(Batch& b) { solveBody<32>(b); }
void solveBase(Batch& b) { solveBody<16>(b); }

}  // namespace

void Batch::resize() {
    const auto size = [&](Index entries) { return static_cast<std::size_t>(entries * lanes); };
    const auto s = static_cast<Index>(types.size());
    for (auto* v : {&sill, &inverseSquaredRange, &halfShape}) v->assign(size(s), 1);
    fixedShape.assign(types.size(), 0);
    places.assign(size(n * axes), 0);
    for (auto* v : {&active, &diagonal, &special}) v->assign(size(n), 0);
    points.assign(size(targets * axes), 0);
    f0.assign(size(targets * drift), 0);
    const Index rows = n + (drift + columns + targets + kBlock - 1) / kBlock * kBlock;
    matrix.assign(size(rows * n), 0);
    estimate.assign(size(targets * columns), 0);
    variance.assign(size(targets), 0);
    squares.assign(size(columns), 0);
    for (auto* v : {&lowest, &dependence}) v->assign(size(1), 0);
}

Index batchLanes(InstructionSet set) {
    return set == InstructionSet::Avx512 ? 8 : set == InstructionSet::Avx2 ? 4 : 2;
}

void solveBatch(Batch& batch) {
    if (batch.lanes == 8) return solveAvx512(batch);
    if (batch.lanes == 4) return solveAvx2(batch);
    return solveBase(batch);
}

}  // namespace vlx::kernels
