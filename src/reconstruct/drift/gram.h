#pragma once

/// The loops over the data of a neighbourhood: all of SIMD that kriging needs. Sums run in eight lanes in a
/// fixed order, so that every instruction set gives the same bits.
namespace vlx {

inline constexpr int kBlockRows = 4;  ///< numbers of rows of a Gram matrix are multiples of it

/// gram[a * rows + b] = sum_i w_i x_a x_b for b <= a. `rows` a multiple of kBlockRows, each `stride` long; n
/// a multiple of 8 (the rest zero).
void weightedGram(const float* x, const float* w, int rows, int stride, int n, float* weighted, double* gram);

/// Sums of w x, w x^2 over n values, a multiple of 8 (the rest zero).
void weightedSums(const float* x, const float* w, int n, double* sums);

/// The largest (x - mean)^2 of n values, a multiple of 8, that have a weight.
float farthest(const float* x, const float* w, int n, float mean);

/// estimates[i] = offset + sum_j coefficient_j x_j,i
void predictRow(const float* x, const float* coefficients, int functions, int stride, int n, float offset,
                float* estimates);

/// sums[i] += weights[i] values[i].
void addProducts(const float* weights, const float* values, int n, float* sums);

/// What an estimate e of a pixel adds to sums about a reference r: sums[i] = w (e - r), squares[i] = w (e -
/// r)^2.
void addEstimates(const float* estimates, const float* references, const float* weights, int n, float* sums,
                  float* squares);

}  // namespace vlx
