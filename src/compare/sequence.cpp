#include "variolux/compare/sequence.h"

#include <algorithm>
#include <cmath>

#include "compare/constants.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

std::vector<double> errorsOf(const Image& reference, const Image& image) {
    std::vector<double> errors(image.pixels.size());
    for (std::size_t i = 0; i < errors.size(); ++i)
        errors[i] = static_cast<double>(image.pixels[i]) - reference.pixels[i];
    return errors;
}

// Mean over the channels of (e - f)^2 / (r^2 + 0.01): not finite where any of them is not.
double relativeSquare(const double* e, const double* f, const float* r) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double truth = r[c], difference = e[c] - f[c];
        sum += difference * difference / (truth * truth + kRelativeFloor);
    }
    return sum / 3;
}

}  // namespace

// Adds value(col, row) of all pixels where it is finite to the tiles' sums. Returns their mean.
template <class Value>
double SequenceComparison::addTiles(Sum& total, const Value& value) const {
    const int columns = (window_.width + kSequenceTile - 1) / kSequenceTile;
    const int rows = (window_.height + kSequenceTile - 1) / kSequenceTile;
    Sum frame;
    const auto tiles = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    frame.sums.resize(tiles);
    frame.counts.resize(tiles);
    parallelFor(0, rows, [&](std::int64_t tileRow) {
        const int first = static_cast<int>(tileRow) * kSequenceTile;
        const int last = std::min(first + kSequenceTile, window_.height);
        for (int row = first; row < last; ++row)
            for (int col = 0; col < window_.width; ++col) {
                const double v = value(col, row);
                if (!std::isfinite(v)) continue;
                const auto tile = static_cast<std::size_t>(tileRow * columns + col / kSequenceTile);
                frame.sums[tile] += v;
                ++frame.counts[tile];
            }
    });
    total.sums.resize(tiles);
    total.counts.resize(tiles);
    for (std::size_t i = 0; i < tiles; ++i) {
        total.sums[i] += frame.sums[i];
        total.counts[i] += frame.counts[i];
    }
    return ratioInterval(frame.sums, frame.counts).value;
}

void SequenceComparison::add(int number, const Image& reference, const Image& image, const Image* motion,
                             const std::string& path) {
    SequenceFrame frame{number, compareColour(reference, image, path), kNan, kNan};
    if (errors_.frames.empty()) window_ = image.data;
    if (image.data != window_)
        throw Error(path, "expected the data window of the frame before, " + windowText(window_) +
                              ", found " + windowText(image.data));
    std::vector<double> errors = errorsOf(reference, image);
    const auto place = [&](int col, int row) {
        return 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(window_.width) +
                    static_cast<std::size_t>(col));
    };
    constexpr double kNone[3] = {};
    addTiles(relMse_, [&](int col, int row) {
        return relativeSquare(&errors[place(col, row)], kNone, reference.at(col, row));
    });
    if (!errors_.frames.empty() && number == errors_.frames.back().number + 1) {
        frame.flicker = addTiles(flicker_, [&](int col, int row) {
            return relativeSquare(&errors[place(col, row)], &before_[place(col, row)],
                                  referenceBefore_.at(col, row));
        });
        if (motion != nullptr)
            frame.flickerAlongMotion = addTiles(alongMotion_, [&](int col, int row) {
                const float* const way = motion->at(col, row);
                const double x = std::floor(col + 0.5 + way[0]), y = std::floor(row + 0.5 + way[1]);
                if (!(x >= 0 && x < window_.width && y >= 0 && y < window_.height)) return kNan;
                const auto fromCol = static_cast<int>(x), fromRow = static_cast<int>(y);
                return relativeSquare(&errors[place(col, row)], &before_[place(fromCol, fromRow)],
                                      referenceBefore_.at(fromCol, fromRow));
            });
    }
    before_ = std::move(errors);
    referenceBefore_ = reference;
    errors_.frames.push_back(std::move(frame));
}

SequenceErrors SequenceComparison::errors() const {
    SequenceErrors result = errors_;
    result.relMse = ratioInterval(relMse_.sums, relMse_.counts);
    result.flicker = ratioInterval(flicker_.sums, flicker_.counts);
    result.flickerAlongMotion = ratioInterval(alongMotion_.sums, alongMotion_.counts);
    return result;
}

}  // namespace vlx
