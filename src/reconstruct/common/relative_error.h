#pragma once

#include <optional>

#include "variolux/reconstruct/reconstruct.h"

/// What an image says of its own error, by the measure of relMSE.
namespace vlx {

/// Of one pixel: the mean over R, G, B of stddev^2 / (value^2 + 0.01), the value in place of the truth.
class RelativeError {
  public:
    /// Finds the channels of R, G, B and their standard deviations.
    explicit RelativeError(const Image& outline);

    /// Whether the image has them.
    bool known() const;
    double of(const float* pixel) const;

  private:
    int value_[3], stddev_[3];
};

/// Passes rows of an image on, and takes the mean of their pixels' errors.
class MeasuredRows {
  public:
    /// Refers to `sink`.
    MeasuredRows(const Image& outline, const RowSink& sink);

    RowSink sink();
    /// Of the rows so far; nothing where the image has no error.
    std::optional<double> relMse() const;

  private:
    RelativeError error_;
    const RowSink& sink_;
    int width_, channels_;
    double sum_ = 0;
    std::int64_t pixels_ = 0;
};

}  // namespace vlx
