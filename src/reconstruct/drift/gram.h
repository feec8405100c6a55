#pragma once

/// The loops over the data of a neighbourhood: all of SIMD that kriging needs. Sums run in eight lanes in a
/// fixed order, so that every instruction set gives the same bits. Lists of data are as long as whole
/// vectors: what stands there beyond the data weighs nothing.
namespace vlx {

inline constexpr int kBlockRows = 4;  ///< numbers of rows of a Gram matrix are multiples of it

/// Eight pixels in a row, some of which are data.
struct DataRun {
    int at;         ///< the first pixel, in a plane
    int first;      ///< number of the first datum among all
    unsigned mask;  ///< bit i: pixel at + i is a datum
};

/// A square of pixels around one, in rows of whole vectors.
struct Surroundings {
    int reach;
    int stride() const { return (2 * reach + 1 + 7) / 8 * 8; }
    int size() const { return (2 * reach + 1) * stride(); }
    /// Index of the pixel (dx, dy) away.
    int at(int dx, int dy) const { return (dy + reach) * stride() + dx + reach; }
};

/// Those of the surroundings of pixel `centre`, in a plane of rows `side` long, that are at least `least`
/// alike are data: their runs, and what they are alike and their places (x, y over reach) as lists, each with
/// room for a vector more. Counts of both.
struct DataCounts {
    int runs, data;
};
DataCounts selectData(const Surroundings& around, const float* alike, float least, int centre, int side,
                      DataRun* runs, float* list, float* x, float* y);

/// list[k] = plane[where datum k lies] - about. Room for a vector more in the list; planes may be read one
/// vector past their end.
void gather(const float* plane, const DataRun* runs, int count, float about, float* list);

/// plane[where datum k lies] += list[k]
void scatter(const float* list, const DataRun* runs, int count, float* plane);

/// gram[b * rows + a] = sum_i w_i x_a x_b for b <= a. `rows` a multiple of kBlockRows, each `stride` long; n
/// a multiple of 8 (the rest zero).
void weightedGram(const float* x, const float* w, int rows, int stride, int n, float* weighted, double* gram);

/// Sums of w x, w x^2 over n values, a multiple of 8 (the rest zero).
void weightedSums(const float* x, const float* w, int n, double* sums);

/// The largest (x - mean)^2 of n values, a multiple of 8, that have a weight.
float farthest(const float* x, const float* w, int n, float mean);

/// How many of n values, a multiple of 8, that have a weight have (x - mean)^2 > square.
int countBeyond(const float* x, const float* w, int n, float mean, float square);

/// products[i] = x_i y_i
void multiply(const float* x, const float* y, int n, float* products);

/// What data weigh: as they are alike, times the samples that they have for one of the centre's, from `least`
/// to `most`; a pixel without samples is no datum. `alike` becomes that weight for all pixels, `weights` for
/// data, 0 for others.
struct DataWeights {
    double total;  ///< sum of weights
    double noise;  ///< sum of weights times error variances, of data with as many samples as the centre
    bool gaps;     ///< pixels without samples are among them
};
DataWeights weighData(const float* counts, const float* errors, float own, float least, float most, int n,
                      float* alike, float* weights);

/// weights[i] *= scale (1 - edge x_i^2)^2 (1 - edge y_i^2)^2
void taper(const float* x, const float* y, float edge, float scale, int n, float* weights);

/// sums[c * n + i] += scales[c] errors[i], c < 3.
void addErrors(const float* errors, const float* scales, int n, float* sums);

/// Those rows of functions that an estimate has coefficients for.
struct DriftFunctions {
    const float* rows;  ///< each `stride` long
    int stride, count;
    const int* numbers;  ///< of rows
    const float* coefficients;
};

/// What the estimates e_i = offset + sum_j b_j x_j,i of pixels add to sums about references r: w (e - r), and
/// w ((e - r)^2 + errors).
void predictChannel(const DriftFunctions& of, float offset, const float* references, const float* weights,
                    const float* errors, int n, float* sums, float* squares);

}  // namespace vlx
