#include "geostat/kernels.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"
#include "geostat/structure_kernel.h"

namespace vlx::kernels {

using Eigen::Index;

/// Arguments of the loops over places.
struct ModelColumns::Columns {
    const ModelColumns::Structure* structures;
    std::size_t count;
    const double* places;
    Index leading, axes;
    const double* points;  // axis-major, `pointsLeading` an axis; the last `commonAxes` of all are the same
    Index pointsLeading, pointCount, commonAxes;
    const double* weights;  // of the points; null: 1
    Index first, last;
    bool semivariance;
    double* out;
};

namespace {

constexpr Index kWidth = 4;  // columns of a matrix at a time

/// a[i, j + c] -= sum over k of left[i, k] * right[k, c], c < w <= kWidth, for two vectors of rows i, so that
/// eight sums stay in registers. `...Step`: from k to k + 1, `across`: from c to c + 1.
template <class V, class T>
[[gnu::always_inline]] inline void subtractProducts(T* a, Index leading, Index w, const T* left,
                                                    Index leftStep, const T* right, Index rightStep,
                                                    Index across, Index count) {
    constexpr Index lanes = kLanes<V>;
    T* column[kWidth];
    const T* of[kWidth];
    for (Index c = 0; c < kWidth; ++c) {  // missing columns repeat the first one
        column[c] = a + (c < w ? c : 0) * leading;
        of[c] = right + (c < w ? c : 0) * across;
    }
    V s00 = load<V>(column[0]), s01 = load<V>(column[0] + lanes);
    V s10 = load<V>(column[1]), s11 = load<V>(column[1] + lanes);
    V s20 = load<V>(column[2]), s21 = load<V>(column[2] + lanes);
    V s30 = load<V>(column[3]), s31 = load<V>(column[3] + lanes);
    for (Index k = 0; k < count; ++k) {
        const V l0 = load<V>(left + k * leftStep), l1 = load<V>(left + lanes + k * leftStep);
        const T r0 = of[0][k * rightStep], r1 = of[1][k * rightStep];
        const T r2 = of[2][k * rightStep], r3 = of[3][k * rightStep];
        s00 -= l0 * r0;
        s01 -= l1 * r0;
        s10 -= l0 * r1;
        s11 -= l1 * r1;
        s20 -= l0 * r2;
        s21 -= l1 * r2;
        s30 -= l0 * r3;
        s31 -= l1 * r3;
    }
    store(column[0], s00);
    store(column[0] + lanes, s01);
    if (w > 1) store(column[1], s10), store(column[1] + lanes, s11);
    if (w > 2) store(column[2], s20), store(column[2] + lanes, s21);
    if (w > 3) store(column[3], s30), store(column[3] + lanes, s31);
}

/// Left-looking by blocks of four columns.
template <class T, int bytes>
[[gnu::always_inline]] inline T choleskyBody(T* a, Index n, Index rows, Index leading) {
    using V = typename Vectors<T, bytes>::Type;
    constexpr Index lanes = kLanes<V>;
    T lowest = n > 0 ? a[0] : T(1);
    for (Index j = 0; j < n; j += kWidth) {
        const Index w = std::min(kWidth, n - j);
        T* column = a + j * leading;
        // Sums over the columns already factorised.
        for (Index i = j / (2 * lanes) * (2 * lanes); i < rows; i += 2 * lanes)
            subtractProducts<V>(column + i, leading, w, a + i, leading, a + j, leading, 1, j);
        // The diagonal block by hand.
        T block[kWidth][kWidth], inverse[kWidth];
        for (Index c = 0; c < w; ++c)
            for (Index b = 0; b <= c; ++b) {
                T s = a[j + c + (j + b) * leading];
                for (Index k = 0; k < b; ++k) s -= block[c][k] * block[b][k];
                if (b < c) {
                    block[c][b] = s * inverse[b];
                } else {
                    lowest = std::min(lowest, s);
                    if (!(s > 0)) return s;
                    block[c][c] = std::sqrt(s);
                    inverse[c] = T(1) / block[c][c];
                }
            }
        // The rows below it.
        for (Index i = j / lanes * lanes; i < rows; i += lanes) {
            V x[kWidth];
            for (Index c = 0; c < w; ++c) {
                V s = load<V>(column + c * leading + i);
                for (Index b = 0; b < c; ++b) s -= x[b] * block[c][b];
                x[c] = s * inverse[c];
                store(column + c * leading + i, x[c]);
            }
        }
        for (Index c = 0; c < w; ++c)
            for (Index b = 0; b <= c; ++b) a[j + c + (j + b) * leading] = block[c][b];
    }
    return lowest;
}

/// Rows of x, one vector of them: the block of w columns from j, when all before (behind) it is taken off.
template <class V>
[[gnu::always_inline]] inline void solveBlock(const double* l, Index leading, Index j, Index w, bool upper,
                                              double* x, Index step) {
    V solved[kWidth];
    for (Index at = 0; at < w; ++at) {
        const Index c = upper ? w - 1 - at : at;
        V s = load<V>(x + c * step);
        for (Index before = 0; before < at; ++before) {
            const Index b = upper ? w - 1 - before : before;
            s -= solved[b] * (upper ? l[j + b + (j + c) * leading] : l[j + c + (j + b) * leading]);
        }
        solved[c] = s * (1 / l[j + c + (j + c) * leading]);
        store(x + c * step, solved[c]);
    }
}

template <int bytes>
[[gnu::always_inline]] inline void triangularBody(const double* l, Index n, Index leading, bool upper,
                                                  double* x, Index m, Index step) {
    using V = typename Vectors<double, bytes>::Type;
    constexpr Index lanes = kLanes<V>;
    const Index blocks = (n + kWidth - 1) / kWidth;
    for (Index block = 0; block < blocks; ++block) {
        const Index j = (upper ? blocks - 1 - block : block) * kWidth, w = std::min(kWidth, n - j);
        const Index next = j + w;
        for (Index i = 0; i < m; i += 2 * lanes) {
            double* at = x + i + j * step;
            if (upper)
                subtractProducts<V>(at, step, w, x + i + next * step, step, l + next + j * leading, 1,
                                    leading, n - next);
            else
                subtractProducts<V>(at, step, w, x + i, step, l + j, leading, 1, j);
            solveBlock<V>(l, leading, j, w, upper, at, step);
            solveBlock<V>(l, leading, j, w, upper, at + lanes, step);
        }
    }
}

constexpr Index kChunk = 128;  // values at a time

/// out += factor * value of a stable structure at squared distances. The elementary functions one after the
/// other over all of them: their chains of dependent operations then overlap.
template <class V>
[[gnu::always_inline]] inline void addStable(const ModelColumns::Structure& s, double factor,
                                             const double* squared, Index n, bool semivariance, double* out) {
    alignas(64) double x[kChunk];
    const double half = s.halfShape;
    if (half == 1) {  // Gaussian: no power to take
        for (Index i = 0; i < n; i += kLanes<V>) store(x + i, load<V>(squared + i) * s.inverseSquaredRange);
    } else {
        for (Index i = 0; i < n; i += kLanes<V>)
            store(x + i, powerLogarithm(load<V>(squared + i) * s.inverseSquaredRange, spread<V>(half)));
        for (Index i = 0; i < n; i += kLanes<V>)
            store(x + i, powerOfTwo(load<V>(squared + i) * s.inverseSquaredRange, load<V>(x + i)));
    }
    for (Index i = 0; i < n; i += kLanes<V>) {
        const V value = load<V>(x + i);
        store(out + i, load<V>(out + i) + factor * (semivariance ? decayComplement(value) : decay(value)));
    }
}

/// sum += squared differences from a point along axes [first, last).
template <class V>
[[gnu::always_inline]] inline V addSquares(const ModelColumns::Columns& c, Index i, Index point, Index first,
                                           Index last, V sum) {
    for (Index axis = first; axis < last; ++axis) {
        const V d = load<V>(c.places + axis * c.leading + i) - c.points[axis * c.pointsLeading + point];
        sum += d * d;
    }
    return sum;
}

template <int bytes>
[[gnu::always_inline]] inline void columnsBody(const ModelColumns::Columns& c) {
    using V = typename Vectors<double, bytes>::Type;
    alignas(64) double common[kChunk], squared[kChunk];
    const Index own = c.axes - c.commonAxes;
    for (Index begin = c.first / kLanes<V> * kLanes<V>; begin < c.last; begin += kChunk) {
        const Index n = std::min(kChunk, c.last - begin);
        double* out = c.out + begin;
        for (Index i = 0; i < n; i += kLanes<V>) {
            store(common + i, addSquares<V>(c, begin + i, 0, own, c.axes, V{}));
            store(out + i, V{});
        }
        for (Index point = 0; point < c.pointCount; ++point) {
            for (Index i = 0; i < n; i += kLanes<V>)
                store(squared + i, addSquares<V>(c, begin + i, point, 0, own, load<V>(common + i)));
            for (std::size_t k = 0; k < c.count; ++k) {
                const ModelColumns::Structure& s = c.structures[k];
                const double factor = c.weights ? c.weights[point] * s.sill : s.sill;
                if (s.type == StructureType::Stable) {
                    addStable<V>(s, factor, squared, n, c.semivariance, out);
                    continue;
                }
                for (Index i = 0; i < n; i += kLanes<V>) {
                    const V u2 = load<V>(squared + i) * s.inverseSquaredRange;
                    store(out + i,
                          load<V>(out + i) + factor * structureValue<V>(s.type, u2, spread<V>(s.halfShape),
                                                                        s.halfShape, c.semivariance));
                }
            }
        }
    }
}

// One instance for each instruction set.
[[gnu::target("avx512f,avx512dq,avx512vl")]] double choleskyAvx512(double* a, Index n, Index rows,
                                                                   Index leading) {
    return choleskyBody<double, 64>(a, n, rows, leading);
}
[[gnu::target("avx2")]] double choleskyAvx2(double* a, Index n, Index rows, Index leading) {
    return choleskyBody<double, 32>(a, n, rows, leading);
}
double choleskyBase(double* a, Index n, Index rows, Index leading) {
    return choleskyBody<double, 16>(a, n, rows, leading);
}
[[gnu::target("avx512f,avx512dq,avx512vl")]] float choleskyAvx512(float* a, Index n, Index rows,
                                                                  Index leading) {
    return choleskyBody<float, 64>(a, n, rows, leading);
}
[[gnu::target("avx2")]] float choleskyAvx2(float* a, Index n, Index rows, Index leading) {
    return choleskyBody<float, 32>(a, n, rows, leading);
}
float choleskyBase(float* a, Index n, Index rows, Index leading) {
    return choleskyBody<float, 16>(a, n, rows, leading);
}
[[gnu::target("avx512f,avx512dq,avx512vl")]] void triangularAvx512(const double* l, Index n, Index leading,
                                                                   bool upper, double* x, Index m,
                                                                   Index step) {
    triangularBody<64>(l, n, leading, upper, x, m, step);
}
[[gnu::target("avx2")]] void triangularAvx2(const double* l, Index n, Index leading, bool upper, double* x,
                                            Index m, Index step) {
    triangularBody<32>(l, n, leading, upper, x, m, step);
}
void triangularBase(const double* l, Index n, Index leading, bool upper, double* x, Index m, Index step) {
    triangularBody<16>(l, n, leading, upper, x, m, step);
}
[[gnu::target("avx512f,avx512dq,avx512vl")]] void columnsAvx512(const ModelColumns::Columns& c) {
    columnsBody<64>(c);
}
[[gnu::target("avx2")]] void columnsAvx2(const ModelColumns::Columns& c) { columnsBody<32>(c); }
void columnsBase(const ModelColumns::Columns& c) { columnsBody<16>(c); }

}  // namespace

InstructionSet instructionSet() {
    static const InstructionSet best = [] {
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512vl"))
            return InstructionSet::Avx512;
        return __builtin_cpu_supports("avx2") ? InstructionSet::Avx2 : InstructionSet::Base;
    }();
    return best;
}

Index leadingDimension(Index rows) {
    const Index rounded = (rows + 31) / 32 * 32;
    return rounded % 64 == 0 ? rounded + 32 : rounded;
}

double cholesky(double* a, Index n, Index rows, Index leading, InstructionSet set) {
    if (set == InstructionSet::Avx512) return choleskyAvx512(a, n, rows, leading);
    if (set == InstructionSet::Avx2) return choleskyAvx2(a, n, rows, leading);
    return choleskyBase(a, n, rows, leading);
}

float cholesky(float* a, Index n, Index rows, Index leading, InstructionSet set) {
    if (set == InstructionSet::Avx512) return choleskyAvx512(a, n, rows, leading);
    if (set == InstructionSet::Avx2) return choleskyAvx2(a, n, rows, leading);
    return choleskyBase(a, n, rows, leading);
}

void solveTriangle(const double* l, Index n, Index leading, bool upper, double* x, Index m, Index step,
                   InstructionSet set) {
    if (set == InstructionSet::Avx512) return triangularAvx512(l, n, leading, upper, x, m, step);
    if (set == InstructionSet::Avx2) return triangularAvx2(l, n, leading, upper, x, m, step);
    triangularBase(l, n, leading, upper, x, m, step);
}

ModelColumns::ModelColumns(const VariogramModel& model) : model_(model) {
    vectorised_ = true;
    for (const VariogramStructure& s : model.structures) {
        if (s.sill == 0) continue;
        const bool stable = s.type == StructureType::Stable;
        structures_.push_back({s.type, s.sill, 1 / (s.range * s.range), stable ? s.shape / 2 : s.shape});
        if (!(s.range > 1e-100 && s.range < 1e100)) vectorised_ = false;
        if (s.type == StructureType::Matern) {
            closedSemivariance_ = false;
            if (s.shape != 0.5 && s.shape != 1.5 && s.shape != 2.5) vectorised_ = false;
        }
    }
}

void ModelColumns::semivariances(const double* places, Index leading, Index axes, const double* point,
                                 Index first, Index last, double* out) const {
    evaluate({nullptr, 0, places, leading, axes, point, 1, 1, 0, nullptr, first, last, true, out});
}

void ModelColumns::covariances(const double* places, Index leading, Index axes, const double* point,
                               Index first, Index last, double* out) const {
    evaluate({nullptr, 0, places, leading, axes, point, 1, 1, 0, nullptr, first, last, false, out});
}

void ModelColumns::ofBlock(const double* places, Index leading, const Eigen::MatrixXd& points,
                           const double* weights, Index last, bool semivariance, double* out) const {
    Index common = 0;
    while (common < points.cols() &&
           (points.col(points.cols() - 1 - common).array() == points(0, points.cols() - 1 - common)).all())
        ++common;
    evaluate({nullptr, 0, places, leading, points.cols(), points.data(), points.rows(), points.rows(), common,
              weights, 0, last, semivariance, out});
}

void ModelColumns::evaluate(Columns c) const {
    if (vectorised_ && (closedSemivariance_ || !c.semivariance)) {
        c.structures = structures_.data();
        c.count = structures_.size();
        const InstructionSet set = instructionSet();
        if (set == InstructionSet::Avx512) return columnsAvx512(c);
        if (set == InstructionSet::Avx2) return columnsAvx2(c);
        return columnsBase(c);
    }
    for (Index i = c.first; i < c.last; ++i) {
        c.out[i] = 0;
        for (Index point = 0; point < c.pointCount; ++point) {
            double squared = 0;
            for (Index axis = 0; axis < c.axes; ++axis) {
                const double d = c.places[axis * c.leading + i] - c.points[axis * c.pointsLeading + point];
                squared += d * d;
            }
            const double h = std::sqrt(squared);
            c.out[i] += (c.weights ? c.weights[point] : 1) *
                        (c.semivariance ? vlx::semivariance(model_, h) : vlx::covariance(model_, h));
        }
    }
}

}  // namespace vlx::kernels
