#include "reconstruct/common/relative_error.h"

#include <algorithm>

namespace vlx {

RelativeError::RelativeError(const Image& outline) {
    const char* const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; ++c) {
        value_[c] = outline.channel(names[c]);
        stddev_[c] = outline.channel(std::string("stddev.") + names[c]);
    }
}

bool RelativeError::known() const {
    return std::min({value_[0], value_[1], value_[2], stddev_[0], stddev_[1], stddev_[2]}) >= 0;
}

double RelativeError::of(const float* pixel) const {
    constexpr double kEpsilon = 0.01;  // of relMSE
    double squares = 0;
    for (int c = 0; c < 3; ++c) {
        const auto z = static_cast<double>(pixel[value_[c]]), s = static_cast<double>(pixel[stddev_[c]]);
        squares += s * s / (z * z + kEpsilon) / 3;
    }
    return squares;
}

MeasuredRows::MeasuredRows(const Image& outline, const RowSink& sink)
    : error_(outline), sink_(sink), width_(outline.data.width), channels_(outline.channelCount()) {}

RowSink MeasuredRows::sink() {
    if (!error_.known()) return sink_;
    return [this](const float* rows, int count) {
        const std::int64_t pixels = std::int64_t{count} * width_;
        for (std::int64_t i = 0; i < pixels; ++i) sum_ += error_.of(rows + i * channels_);
        pixels_ += pixels;
        sink_(rows, count);
    };
}

std::optional<double> MeasuredRows::relMse() const {
    if (pixels_ == 0) return std::nullopt;
    return sum_ / static_cast<double>(pixels_);
}

}  // namespace vlx
