#include "reconstruct/drift/gram.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/simd.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::EightIntegers;
using simd::load;
using simd::store;
using Four = simd::Vectors<double, 32>::Type;

/// For each mask of eight, where its lanes come from when they move together to the left, and back.
struct LaneOrders {
    alignas(32) std::array<std::array<int, 8>, 256> left{}, right{}, lanes{};
    constexpr LaneOrders() {
        for (std::size_t mask = 0; mask < 256; ++mask) {
            std::size_t next = 0;
            for (std::size_t i = 0; i < 8; ++i) {
                if ((mask >> i & 1) == 0) continue;
                left[mask][next] = static_cast<int>(i);
                right[mask][i] = static_cast<int>(next++);
                lanes[mask][i] = -1;
            }
        }
    }
};
constexpr LaneOrders kOrders;

[[gnu::always_inline]] inline EightIntegers order(const std::array<int, 8>& of) {
    return load<EightIntegers>(of.data());
}

/// Bit i: lane i is not 0.
[[gnu::always_inline]] inline unsigned maskOf(EightIntegers truth) {
    const EightIntegers bits = truth & EightIntegers{1, 2, 4, 8, 16, 32, 64, 128};
    const EightIntegers two = bits + __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
    return static_cast<unsigned>((two[0] + two[1]) + (two[2] + two[3]));
}

/// s0 + s4, s1 + s5, s2 + s6, s3 + s7
[[gnu::always_inline]] inline Four halved(Eight s) {
    return __builtin_convertvector(__builtin_shufflevector(s, s, 0, 1, 2, 3), Four) +
           __builtin_convertvector(__builtin_shufflevector(s, s, 4, 5, 6, 7), Four);
}

[[gnu::always_inline]] inline double sumOf(Eight s) {
    const Four h = halved(s);
    return (h[0] + h[1]) + (h[2] + h[3]);
}

/// sumOf() each of four.
[[gnu::always_inline]] inline Four sumsOf(Eight a, Eight b, Eight c, Eight d) {
    const Four p = halved(a), q = halved(b), r = halved(c), s = halved(d);
    const Four two = __builtin_shufflevector(p, q, 0, 4, 2, 6) + __builtin_shufflevector(p, q, 1, 5, 3, 7);
    const Four other = __builtin_shufflevector(r, s, 0, 4, 2, 6) + __builtin_shufflevector(r, s, 1, 5, 3, 7);
    return __builtin_shufflevector(two, other, 0, 1, 4, 5) + __builtin_shufflevector(two, other, 2, 3, 6, 7);
}

constexpr int kBlockColumns = 2;

}  // namespace

VLX_WIDE DataCounts selectData(const Surroundings& around, const float* alike, float least, int centre,
                               int side, DataRun* runs, float* list, float* x, float* y) {
    DataCounts found{0, 0};
    const float perReach = 1.f / static_cast<float>(around.reach);
    const Eight lanes = __builtin_convertvector(simd::kEightLanes, Eight);
    for (int dy = -around.reach; dy <= around.reach; ++dy)
        for (int dx = -around.reach; dx <= around.reach; dx += 8) {
            const Eight value = load<Eight>(alike + around.at(dx, dy));
            const unsigned mask = maskOf(value >= least);
            if (mask == 0) continue;
            const EightIntegers from = order(kOrders.left[mask]);
            store(list + found.data, simd::permute(value, from));
            store(x + found.data, simd::permute((lanes + static_cast<float>(dx)) * perReach, from));
            store(y + found.data, Eight{} + static_cast<float>(dy) * perReach);
            runs[found.runs++] = {centre + dy * side + dx, found.data, mask};
            found.data += std::popcount(mask);
        }
    return found;
}

VLX_WIDE void gather(const float* plane, const DataRun* runs, int count, float about, float* list) {
    for (int r = 0; r < count; ++r)
        store(list + runs[r].first,
              simd::permute(load<Eight>(plane + runs[r].at), order(kOrders.left[runs[r].mask])) - about);
}

VLX_WIDE void scatter(const float* list, const DataRun* runs, int count, float* plane) {
    for (int r = 0; r < count; ++r) {
        const Eight values =
            simd::permute(load<Eight>(list + runs[r].first), order(kOrders.right[runs[r].mask]));
        float* const to = plane + runs[r].at;
        const Eight sum = load<Eight>(to);
        store(to, order(kOrders.lanes[runs[r].mask]) != 0 ? sum + values : sum);
    }
}

VLX_WIDE void weightedGram(const float* x, const float* w, int rows, int stride, int n, float* weighted,
                           double* gram) {
    for (int a = 0; a < rows; ++a)
        for (int i = 0; i < n; i += 8)
            store(weighted + a * stride + i, load<Eight>(x + a * stride + i) * load<Eight>(w + i));
    for (int a = 0; a < rows; a += kBlockRows)
        for (int b = 0; b < a + kBlockRows; b += kBlockColumns) {
            const float* const left = weighted + a * stride;
            const float* const right = x + b * stride;
            Eight sum[kBlockColumns][kBlockRows] = {};
            for (int i = 0; i < n; i += 8) {
                const Eight one = load<Eight>(right + i), two = load<Eight>(right + stride + i);
                for (int r = 0; r < kBlockRows; ++r) {
                    const Eight v = load<Eight>(left + r * stride + i);
                    sum[0][r] += v * one;
                    sum[1][r] += v * two;
                }
            }
            for (int c = 0; c < kBlockColumns; ++c)
                store(gram + (b + c) * rows + a, sumsOf(sum[c][0], sum[c][1], sum[c][2], sum[c][3]));
        }
}

VLX_WIDE void weightedSums(const float* x, const float* w, int n, double* sums) {
    Eight first = {}, second = {};
    for (int i = 0; i < n; i += 8) {
        const Eight value = load<Eight>(x + i), product = value * load<Eight>(w + i);
        first += product;
        second += product * value;
    }
    sums[0] = sumOf(first);
    sums[1] = sumOf(second);
}

VLX_WIDE float farthest(const float* x, const float* w, int n, float mean) {
    Eight most = {};
    for (int i = 0; i < n; i += 8) {
        const Eight d = load<Eight>(x + i) - mean;
        most = simd::maximum(load<Eight>(w + i) > 0 ? d * d : Eight{}, most);
    }
    float largest = 0;
    for (int k = 0; k < 8; ++k) largest = std::max(largest, most[k]);
    return largest;
}

VLX_WIDE int countBeyond(const float* x, const float* w, int n, float mean, float square) {
    EightIntegers count = {};
    for (int i = 0; i < n; i += 8) {
        const Eight d = load<Eight>(x + i) - mean;
        count -= (load<Eight>(w + i) > 0) & (d * d > square);
    }
    int sum = 0;
    for (int k = 0; k < 8; ++k) sum += count[k];
    return sum;
}

VLX_WIDE void multiply(const float* x, const float* y, int n, float* products) {
    for (int i = 0; i < n; i += 8) store(products + i, load<Eight>(x + i) * load<Eight>(y + i));
}

VLX_WIDE DataWeights weighData(const float* counts, const float* errors, float own, float least, float most,
                               int n, float* alike, float* weights) {
    Eight total = {}, noise = {};
    EightIntegers without = {};
    for (int i = 0; i < n; i += 8) {
        const Eight count = load<Eight>(counts + i),
                    ratio = simd::minimum(simd::maximum(count / own, least + Eight{}), most + Eight{});
        const Eight weight = load<Eight>(alike + i) * ratio;
        const Eight ofDatum = count > 0 ? weight : Eight{};
        store(alike + i, weight);
        store(weights + i, ofDatum);
        total += ofDatum;
        noise += ofDatum * ratio * load<Eight>(errors + i);
        without |= ofDatum != weight;
    }
    return {sumOf(total), sumOf(noise), maskOf(without) != 0};
}

VLX_WIDE void taper(const float* x, const float* y, float edge, float scale, int n, float* weights) {
    for (int i = 0; i < n; i += 8) {
        const Eight u = load<Eight>(x + i), v = load<Eight>(y + i);
        const Eight across = 1 - edge * u * u, along = 1 - edge * v * v;
        store(weights + i, load<Eight>(weights + i) * scale * (across * across) * (along * along));
    }
}

VLX_WIDE void addErrors(const float* errors, const float* scales, int n, float* sums) {
    for (int c = 0; c < 3; ++c)
        for (int i = 0; i < n; i += 8) {
            float* const sum = sums + c * n + i;
            store(sum, load<Eight>(sum) + scales[c] * load<Eight>(errors + i));
        }
}

VLX_WIDE void predictChannel(const DriftFunctions& of, float offset, const float* references,
                             const float* weights, const float* errors, int n, float* sums, float* squares) {
    for (int i = 0; i < n; i += 8) {
        Eight estimate = Eight{} + offset;
        for (int j = 0; j < of.count; ++j)
            estimate += of.coefficients[j] * load<Eight>(of.rows + of.numbers[j] * of.stride + i);
        const Eight d = estimate - load<Eight>(references + i), weight = load<Eight>(weights + i);
        store(sums + i, weight * d);
        store(squares + i, weight * d * d + weight * load<Eight>(errors + i));
    }
}

}  // namespace vlx
