#include "reconstruct/drift/gram.h"

#include <algorithm>
#include <cstring>

#include "base/simd.h"

namespace vlx {

namespace {

/// Eight floats: two registers with SSE, one with AVX; the same sums in both.
typedef float Lanes __attribute__((vector_size(32)));

/// sums[r * Columns + c] = sum_i a_r,i b_c,i, over n values, a multiple of 8.
template <int Rows, int Columns>
inline __attribute__((always_inline)) void dotBlock(const float* a, const float* b, int stride, int n,
                                                    double* sums) {
    Lanes sum[Rows][Columns] = {};
    for (int i = 0; i < n; i += 8) {
        Lanes x[Rows];
        for (int r = 0; r < Rows; ++r) std::memcpy(&x[r], a + r * stride + i, sizeof(Lanes));
        for (int c = 0; c < Columns; ++c) {
            Lanes y;
            std::memcpy(&y, b + c * stride + i, sizeof(Lanes));
            for (int r = 0; r < Rows; ++r) sum[r][c] += x[r] * y;
        }
    }
    for (int r = 0; r < Rows; ++r)
        for (int c = 0; c < Columns; ++c) {
            const Lanes& s = sum[r][c];
            sums[r * Columns + c] = (static_cast<double>(s[0]) + s[4]) + (static_cast<double>(s[1]) + s[5]) +
                                    ((static_cast<double>(s[2]) + s[6]) + (static_cast<double>(s[3]) + s[7]));
        }
}

constexpr int kBlockColumns = 2;

}  // namespace

VLX_WIDE void weightedGram(const float* x, const float* w, int rows, int stride, int n, float* weighted,
                           double* gram) {
    for (int a = 0; a < rows; ++a)
        for (int i = 0; i < n; ++i) weighted[a * stride + i] = x[a * stride + i] * w[i];
    for (int a = 0; a < rows; a += kBlockRows)
        for (int b = 0; b < a + kBlockRows; b += kBlockColumns) {
            double sums[kBlockRows * kBlockColumns];
            dotBlock<kBlockRows, kBlockColumns>(weighted + a * stride, x + b * stride, stride, n, sums);
            for (int r = 0; r < kBlockRows; ++r)
                for (int c = 0; c < kBlockColumns; ++c)
                    gram[(a + r) * rows + b + c] = sums[r * kBlockColumns + c];
        }
}

VLX_WIDE void weightedSums(const float* x, const float* w, int n, double* sums) {
    Lanes first = {}, second = {};
    for (int i = 0; i < n; i += 8) {
        Lanes value, weight;
        std::memcpy(&value, x + i, sizeof(Lanes));
        std::memcpy(&weight, w + i, sizeof(Lanes));
        first += weight * value;
        second += weight * value * value;
    }
    sums[0] = sums[1] = 0;
    for (int k = 0; k < 8; ++k) {
        sums[0] += static_cast<double>(first[k]);
        sums[1] += static_cast<double>(second[k]);
    }
}

VLX_WIDE float farthest(const float* x, const float* w, int n, float mean) {
    Lanes most = {};
    const Lanes none = {};
    for (int i = 0; i < n; i += 8) {
        Lanes value, weight;
        std::memcpy(&value, x + i, sizeof(Lanes));
        std::memcpy(&weight, w + i, sizeof(Lanes));
        const Lanes d = value - mean;
        const Lanes square = weight > none ? d * d : none;
        most = square > most ? square : most;
    }
    float largest = 0;
    for (int k = 0; k < 8; ++k) largest = std::max(largest, most[k]);
    return largest;
}

VLX_WIDE void predictRow(const float* x, const float* coefficients, int functions, int stride, int n,
                         float offset, float* __restrict estimates) {
    for (int i = 0; i < n; ++i) estimates[i] = offset;
    for (int j = 0; j < functions; ++j) {
        const float b = coefficients[j];
        if (b == 0) continue;
        const float* __restrict row = x + j * stride;
        for (int i = 0; i < n; ++i) estimates[i] += b * row[i];
    }
}

VLX_WIDE void addProducts(const float* __restrict weights, const float* __restrict values, int n,
                          float* __restrict sums) {
    for (int i = 0; i < n; ++i) sums[i] += weights[i] * values[i];
}

VLX_WIDE void addEstimates(const float* __restrict estimates, const float* __restrict references,
                           const float* __restrict weights, int n, float* __restrict sums,
                           float* __restrict squares) {
    for (int i = 0; i < n; ++i) {
        const float d = estimates[i] - references[i];
        sums[i] = weights[i] * d;
        squares[i] = weights[i] * d * d;
    }
}

}  // namespace vlx
