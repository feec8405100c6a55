#include "reconstruct/data/pixel_data.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr int kFireflyReach = 2;  // pixels of the dump: the neighbourhood of a firefly is 5 x 5 pixels
// Samples in it, itself among them, for a sample to be a firefly: those of a picture's corner, 3 x 3 pixels.
constexpr float kFewestCompared = 9;
constexpr std::pair<int, int> kNeighbours[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

}  // namespace

int PixelData::reach(int scale) { return std::max(kHoleReach, (kFireflyReach + 1) * scale - 1); }

void PixelData::prepare(int first, int until) {
    if (far_) return;
    std::vector<char> far(static_cast<std::size_t>(until - first));
    parallelFor(first, until, [&](std::int64_t line) {
        const int y = static_cast<int>(line);
        for (int x = 0; x < width_ && !far[static_cast<std::size_t>(y - first)]; ++x)
            if (gathered_.row(planes_.count(), y)[x] == 0 && nearest(planes_.count(), x, y).x < 0)
                far[static_cast<std::size_t>(y - first)] = 1;
    });
    if (std::find(far.begin(), far.end(), 1) != far.end())
        far_ = std::make_unique<GapField>(dump_, layout_, planes_);
}

LimitedRow PixelData::fillRow(int y) {
    LimitedRow row;
    for (int x = 0; x < width_; ++x) {
        const bool hole = gathered_.row(planes_.count(), y)[x] == 0;
        out_.data.row(dataPlanes_.gap(), y)[x] = hole ? fillHole(x, y, row) : 0;
        limitPixel(x, y, row);
    }
    for (int k = 0; k < FeaturePlanes{layout_.features}.rawChannels(); ++k)
        std::copy_n(gathered_.row(planes_.feature() + k, y), width_, out_.raw.row(k, y));
    for (int x = 0; x < width_; ++x)
        if (gathered_.row(planes_.count(), y)[x] == 1 && gathered_.row(planes_.stated(), y)[x] == 0)
            borrowFeatureErrors(x, y);
    return row;
}

/// The nearest pixel within kHoleReach that has some of what plane `count` counts.
PixelData::Place PixelData::nearest(int count, int x, int y) const {
    Place place{-1, -1, 0};
    int least = kHoleReach * kHoleReach + 1;
    for (int row = std::max(0, y - kHoleReach); row <= std::min(height_ - 1, y + kHoleReach); ++row)
        for (int col = std::max(0, x - kHoleReach); col <= std::min(width_ - 1, x + kHoleReach); ++col) {
            const int distance = (col - x) * (col - x) + (row - y) * (row - y);
            if (distance >= least || gathered_.row(count, row)[col] == 0) continue;
            least = distance;
            place = {col, row, std::sqrt(static_cast<float>(distance))};
        }
    return place;
}

/// A pixel without samples gets the means and features of the nearest one that has some, so that it is alike
/// to what is around it. Its counts stay 0: it is predicted, but is no datum. How far away that was.
float PixelData::fillHole(int x, int y, LimitedRow& row) {
    const Place from = nearest(planes_.count(), x, y);
    if (from.x >= 0) {
        const float n = gathered_.row(planes_.count(), from.y)[from.x];
        const float nA = gathered_.row(planes_.halfCount(0), from.y)[from.x];
        for (int c = 0; c < radiance_; ++c) {
            const float a = gathered_.row(planes_.mean(0) + c, from.y)[from.x];
            const float b = gathered_.row(planes_.mean(1) + c, from.y)[from.x];
            const float mean = (nA * a + (n - nA) * b) / n;
            gathered_.row(planes_.mean(0) + c, y)[x] = nA > 0 ? a : mean;
            gathered_.row(planes_.mean(1) + c, y)[x] = n > nA ? b : mean;
        }
        for (int k = planes_.feature(); k < planes_.brightest(); ++k)
            gathered_.row(k, y)[x] = gathered_.row(k, from.y)[from.x];
        return from.distance;
    }
    ++row.farPixels;
    std::vector<float> values;
    const double distance = far_->at((x + 0.5) / scale_, (y + 0.5) / scale_, values) * scale_;
    for (int c = 0; c < radiance_; ++c)
        for (const int mean : {planes_.mean(0), planes_.mean(1)})
            gathered_.row(mean + c, y)[x] = values[static_cast<std::size_t>(c)];
    for (int f = 0; f < layout_.features; ++f)
        gathered_.row(planes_.feature() + f, y)[x] = values[static_cast<std::size_t>(radiance_ + f)];
    return static_cast<float>(std::max<double>(distance, kHoleReach + 1));
}

void PixelData::limitPixel(int x, int y, LimitedRow& row) {
    const auto raw = [&](int plane) { return gathered_.row(plane, y)[x]; };
    const float nA = raw(planes_.halfCount(0)), nB = raw(planes_.halfCount(1));
    const float n = raw(planes_.count());
    out_.data.row(dataPlanes_.count(), y)[x] = n;
    out_.data.row(dataPlanes_.halfCount(0), y)[x] = nA;
    out_.data.row(dataPlanes_.halfCount(1), y)[x] = nB;
    out_.data.row(dataPlanes_.stated(), y)[x] = raw(planes_.stated());
    for (int half = 0; half < 2; ++half)
        for (int c = 0; c < radiance_; ++c)
            out_.data.row(dataPlanes_.mean(half) + c, y)[x] = halfMean(half, c, x, y);
    float squares[3];
    for (int c = 0; c < 3; ++c) squares[c] = raw(planes_.squares() + c);

    for (int c = 0; c < 3; ++c) out_.data.row(dataPlanes_.removed() + c, y)[x] = 0;
    const float brightest = raw(planes_.brightestLuminance());
    const bool exact = raw(planes_.stated()) > 0 && squares[0] + squares[1] + squares[2] == 0;
    if (robust_ && brightest > 0 && !exact) {
        const float most = secondBrightest(x, y);
        if (brightest > most) {
            const float change = most / brightest - 1;  // of every radiance channel of that sample
            const int half = raw(planes_.brightestHalf()) > 0 ? 1 : 0;
            const float halfCount = half == 0 ? nA : nB;
            for (int c = 0; c < radiance_; ++c) {
                if (c == layout_.alpha) continue;
                const float old = raw(planes_.brightest() + c), step = change * old;
                float* const mean = out_.data.row(dataPlanes_.mean(half) + c, y) + x;
                if (c < 3) {
                    const float other = out_.data.row(dataPlanes_.mean(1 - half) + c, y)[x];
                    const float both = (*mean * halfCount + other * (n - halfCount)) / n;
                    squares[c] =
                        std::max(0.f, squares[c] + step * (2 * old + step - 2 * both) - step * step / n);
                    out_.data.row(dataPlanes_.removed() + c, y)[x] = -step / n;
                }
                *mean += step / halfCount;
            }
            ++row.samples;
            row.luminance += static_cast<double>(brightest - most);
        }
    }
    float freedom = raw(planes_.freedom());
    if (n == 1 && freedom == 0) borrowSquares(x, y, squares, freedom);
    for (int c = 0; c < 3; ++c) out_.squares.row(SquaresPlanes::colour(c), y)[x] = squares[c];
    out_.squares.row(SquaresPlanes::kFreedom, y)[x] = freedom;
    out_.squares.row(SquaresPlanes::kSamples, y)[x] = n;
    const double all = unit_ * (static_cast<double>(squares[0]) + squares[1] + squares[2]);
    out_.squares.row(SquaresPlanes::kAllSquared, y)[x] = static_cast<float>(all * all);
}

/// Mean of a half. Where a pixel has samples, but none of it, what its neighbours have on average stands in,
/// else the nearest, else the other half; with count 0: no datum, but something for patches to be alike to.
float PixelData::halfMean(int half, int c, int x, int y) const {
    const int count = planes_.halfCount(half);
    const int mean = planes_.mean(half) + c;
    const float own = gathered_.row(mean, y)[x];
    if (gathered_.row(count, y)[x] > 0 || gathered_.row(planes_.count(), y)[x] == 0) return own;
    float sum = 0;
    int found = 0;
    for (const auto& [dx, dy] : kNeighbours) {
        if (x + dx < 0 || x + dx >= width_ || y + dy < 0 || y + dy >= height_) continue;
        if (gathered_.row(count, y + dy)[x + dx] == 0) continue;
        sum += gathered_.row(mean, y + dy)[x + dx];
        ++found;
    }
    if (found > 0) return sum / static_cast<float>(found);
    if (const Place from = nearest(count, x, y); from.x >= 0) return gathered_.row(mean, from.y)[from.x];
    return gathered_.row(planes_.mean(1 - half) + c, y)[x];
}

/// The second largest luminance of a sample within kFireflyReach pixels of the dump; as large as can be where
/// too few samples are there to compare with.
float PixelData::secondBrightest(int x, int y) const {
    const auto begin = [&](int at) { return std::max(0, (at / scale_ - kFireflyReach) * scale_); };
    const auto end = [&](int at, int size) {
        return std::min(size, (at / scale_ + kFireflyReach + 1) * scale_);
    };
    float most = 0, second = 0, samples = 0;
    for (int row = begin(y); row < end(y, height_); ++row)
        for (int col = begin(x); col < end(x, width_); ++col) {
            samples += gathered_.row(planes_.count(), row)[col];
            for (const int plane : {planes_.brightestLuminance(), planes_.secondLuminance()}) {
                const float l = gathered_.row(plane, row)[col];
                if (l > most) {
                    second = most;
                    most = l;
                } else {
                    second = std::max(second, l);
                }
            }
        }
    return samples < kFewestCompared ? std::numeric_limits<float>::max() : second;
}

/// A pixel of one sample has no variance of its own: half the mean squared difference from its four
/// neighbours stands in, with so little weight that it counts only where no pixel around has better.
void PixelData::borrowSquares(int x, int y, float* squares, float& freedom) const {
    float sum[3] = {};
    int pairs = 0;
    const auto mean = [&](int c, int col, int row) {
        const int half = gathered_.row(planes_.halfCount(0), row)[col] > 0 ? 0 : 1;
        return gathered_.row(planes_.mean(half) + c, row)[col];
    };
    for (const auto& [dx, dy] : kNeighbours) {
        if (x + dx < 0 || x + dx >= width_ || y + dy < 0 || y + dy >= height_) continue;
        if (gathered_.row(planes_.count(), y + dy)[x + dx] == 0) continue;
        ++pairs;
        for (int c = 0; c < 3; ++c) {
            const float d = mean(c, x, y) - mean(c, x + dx, y + dy);
            sum[c] += 0.5f * d * d;
        }
    }
    if (pairs == 0) return;
    for (int c = 0; c < 3; ++c) squares[c] = kBorrowedFreedom * sum[c] / static_cast<float>(pairs);
    freedom = kBorrowedFreedom;
}

/// Nor do features of one sample tell their error: half the squared difference from the second nearest in
/// value of the four neighbours stands in. Beside an edge, also at its corners, two neighbours are alike; in
/// noise they are not.
void PixelData::borrowFeatureErrors(int x, int y) const {
    for (int f = 0; f < layout_.features; ++f) {
        constexpr float kNone = std::numeric_limits<float>::infinity();
        float least = kNone, second = kNone;
        for (const auto& [dx, dy] : kNeighbours) {
            if (x + dx < 0 || x + dx >= width_ || y + dy < 0 || y + dy >= height_) continue;
            if (gathered_.row(planes_.count(), y + dy)[x + dx] == 0) continue;
            const float d = gathered_.row(planes_.feature() + f, y)[x] -
                            gathered_.row(planes_.feature() + f, y + dy)[x + dx];
            second = std::min(second, std::max(least, d * d / 2));
            least = std::min(least, d * d / 2);
        }
        const float error = std::isfinite(second) ? second : least;
        if (std::isfinite(error)) out_.raw.row(FeaturePlanes{layout_.features}.error(f), y)[x] = error;
    }
}

void halveRow(const PixelRows& fine, int width, int height, int radiance, int features, int y,
              PixelRows& coarse) {
    const DataPlanes planes{radiance};
    const RowRing& data = fine.data;
    for (int x = 0; 2 * x < width; ++x) {
        const auto put = [&](RowRing& ring, int plane, double value) {
            ring.row(plane, y)[x] = static_cast<float>(value);
        };
        double parts = 0, stated = 1, count = 0, gap = std::numeric_limits<double>::infinity();
        forParts(width, height, x, y, [&](int col, int row) {
            ++parts;
            stated = std::min(stated, static_cast<double>(data.row(planes.stated(), row)[col]));
            gap = std::min(gap, static_cast<double>(data.row(planes.gap(), row)[col]));
        });
        for (int half = 0; half < 2; ++half) {
            double known = 0, inverse = 0;
            forParts(width, height, x, y, [&](int col, int row) {
                const float n = data.row(planes.halfCount(half), row)[col];
                if (n <= 0) return;
                ++known;
                inverse += 1 / static_cast<double>(n);
            });
            const double samples = known > 0 ? known * known / inverse : 0;
            put(coarse.data, planes.halfCount(half), samples);
            count += samples;
            for (int c = 0; c < planes.radiance; ++c) {
                double sum = 0;
                forParts(width, height, x, y, [&](int col, int row) {
                    if (known > 0 && data.row(planes.halfCount(half), row)[col] <= 0) return;
                    sum += static_cast<double>(data.row(planes.mean(half) + c, row)[col]);
                });
                put(coarse.data, planes.mean(half) + c, sum / (known > 0 ? known : parts));
            }
        }
        put(coarse.data, planes.count(), count);
        put(coarse.data, planes.stated(), stated);
        put(coarse.data, planes.gap(), gap / 2);
        for (int k = 0; k < SquaresPlanes::kChannels; ++k) {
            double sum = 0;
            forParts(width, height, x, y,
                     [&](int col, int row) { sum += static_cast<double>(fine.squares.row(k, row)[col]); });
            put(coarse.squares, k, sum);
        }
        const FeaturePlanes raw{features};
        for (int f = 0; f < features; ++f) {
            double value = 0, error = 0, ofHalf[2] = {}, known[2] = {};
            forParts(width, height, x, y, [&](int col, int row) {
                const double mean = fine.raw.row(raw.value(f), row)[col];
                const double difference = fine.raw.row(raw.difference(f), row)[col];
                value += mean;
                error += static_cast<double>(fine.raw.row(raw.error(f), row)[col]);
                for (int half = 0; half < 2; ++half) {
                    if (data.row(planes.halfCount(half), row)[col] <= 0) continue;
                    ofHalf[half] += half == 0 ? mean + difference : mean - difference;
                    ++known[half];
                }
            });
            put(coarse.raw, raw.value(f), value / parts);
            put(coarse.raw, raw.error(f), error / (parts * parts));
            const bool both = known[0] > 0 && known[1] > 0;
            put(coarse.raw, raw.difference(f), both ? (ofHalf[0] / known[0] - ofHalf[1] / known[1]) / 2 : 0);
        }
    }
}

}  // namespace vlx
