#include "pixel_data.h"

#include <algorithm>
#include <utility>

namespace vlx {

namespace {

constexpr int kFireflyReach = 2;  // pixels: the neighbourhood of a firefly is 5 x 5 pixels
constexpr std::pair<int, int> kNeighbours[] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

}  // namespace

LimitedRow PixelData::fillRow(int y) {
    LimitedRow limited;
    for (int x = 0; x < width_; ++x) {
        if (gathered_.row(planes_.count, y)[x] == 0) fillHole(x, y);
        limitPixel(x, y, limited);
    }
    return limited;
}

/// A pixel without samples gets the means and features of the nearest one that has some, so that it is
/// alike to what is around it. Its counts stay 0: it is predicted, but is no datum.
void PixelData::fillHole(int x, int y) {
    int nearest = kHoleReach * kHoleReach + 1, fromX = -1, fromY = -1;
    for (int row = std::max(0, y - kHoleReach); row <= std::min(height_ - 1, y + kHoleReach); ++row)
        for (int col = std::max(0, x - kHoleReach); col <= std::min(width_ - 1, x + kHoleReach); ++col) {
            const int distance = (col - x) * (col - x) + (row - y) * (row - y);
            if (distance >= nearest || gathered_.row(planes_.count, row)[col] == 0) continue;
            nearest = distance;
            fromX = col;
            fromY = row;
        }
    if (fromX < 0) return;
    for (const auto& [first, planes] :
         {std::pair{planes_.meanA, 2 * radiance_}, {planes_.feature, 2 * layout_.features}})
        for (int k = first; k < first + planes; ++k) gathered_.row(k, y)[x] = gathered_.row(k, fromY)[fromX];
}

void PixelData::limitPixel(int x, int y, LimitedRow& limited) {
    const auto raw = [&](int plane) { return gathered_.row(plane, y)[x]; };
    const float nA = raw(planes_.countA), nB = raw(planes_.countB);
    const float n = raw(planes_.count);
    data_.row(2 * radiance_ + 2, y)[x] = n;
    data_.row(2 * radiance_, y)[x] = nA;
    data_.row(2 * radiance_ + 1, y)[x] = nB;
    for (int c = 0; c < radiance_; ++c) {
        data_.row(c, y)[x] = halfMean(planes_.countA, planes_.meanA + c, x, y);
        data_.row(radiance_ + c, y)[x] = halfMean(planes_.countB, planes_.meanB + c, x, y);
    }
    float squares[3];
    for (int c = 0; c < 3; ++c) squares[c] = raw(planes_.squares + c);

    const float brightest = raw(planes_.brightestLuminance);
    if (robust_ && brightest > 0) {
        const float most = secondBrightest(x, y);
        if (brightest > most) {
            const float change = most / brightest - 1;  // of every radiance channel of that sample
            const int half = raw(planes_.brightestHalf) > 0 ? 1 : 0;
            const float halfCount = half == 0 ? nA : nB;
            for (int c = 0; c < radiance_; ++c) {
                if (c == layout_.alpha) continue;
                const float old = raw(planes_.brightest + c), step = change * old;
                if (c < 3) {
                    const float mean =
                        (data_.row(c, y)[x] * nA + data_.row(radiance_ + c, y)[x] * nB) / (nA + nB);
                    squares[c] =
                        std::max(0.f, squares[c] + step * (2 * old + step - 2 * mean) - step * step / n);
                }
                data_.row(half * radiance_ + c, y)[x] += step / halfCount;
            }
            ++limited.samples;
            limited.luminance += static_cast<double>(brightest - most);
        }
    }
    float freedom = raw(planes_.freedom);
    if (n == 1 && freedom == 0) borrowSquares(x, y, squares, freedom);
    for (int c = 0; c < 3; ++c) squares_.row(c, y)[x] = squares[c];
    squares_.row(3, y)[x] = freedom;
    data_.row(2 * radiance_ + 3, y)[x] = isExact(x, y) ? 1 : 0;
}

bool PixelData::isExact(int x, int y) const {
    if (layout_.features == 0 || squares_.row(3, y)[x] < 1) return false;
    for (int c = 0; c < 3; ++c)
        if (squares_.row(c, y)[x] > 0) return false;
    for (int f = 0; f < layout_.features; ++f)
        if (gathered_.row(planes_.featureError + f, y)[x] > 0) return false;
    return true;
}

/// Mean of a half. Where a pixel has no sample of it, what its neighbours have on average stands in, with
/// count 0: no datum, but something for patches to be alike to.
float PixelData::halfMean(int count, int mean, int x, int y) const {
    const float own = gathered_.row(mean, y)[x];
    if (gathered_.row(count, y)[x] > 0 || gathered_.row(planes_.count, y)[x] == 0) return own;
    float sum = 0;
    int found = 0;
    for (const auto& [dx, dy] : kNeighbours) {
        if (x + dx < 0 || x + dx >= width_ || y + dy < 0 || y + dy >= height_) continue;
        if (gathered_.row(count, y + dy)[x + dx] == 0) continue;
        sum += gathered_.row(mean, y + dy)[x + dx];
        ++found;
    }
    return found > 0 ? sum / static_cast<float>(found) : own;
}

/// The second largest luminance of a sample within kFireflyReach.
float PixelData::secondBrightest(int x, int y) const {
    float most = 0, second = 0;
    for (int row = std::max(0, y - kFireflyReach); row <= std::min(height_ - 1, y + kFireflyReach); ++row)
        for (int col = std::max(0, x - kFireflyReach); col <= std::min(width_ - 1, x + kFireflyReach); ++col)
            for (const int plane : {planes_.brightestLuminance, planes_.secondLuminance}) {
                const float l = gathered_.row(plane, row)[col];
                if (l > most) {
                    second = most;
                    most = l;
                } else {
                    second = std::max(second, l);
                }
            }
    return second;
}

/// A pixel of one sample has no variance of its own: half the mean squared difference from its four
/// neighbours stands in, with so little weight that it counts only where no pixel around has better.
void PixelData::borrowSquares(int x, int y, float* squares, float& freedom) const {
    constexpr float kFreedom = 1e-3f;
    float sum[3] = {};
    int pairs = 0;
    const auto mean = [&](int c, int col, int row) {
        const bool inA = gathered_.row(planes_.countA, row)[col] > 0;
        return gathered_.row((inA ? planes_.meanA : planes_.meanB) + c, row)[col];
    };
    for (const auto& [dx, dy] : kNeighbours) {
        if (x + dx < 0 || x + dx >= width_ || y + dy < 0 || y + dy >= height_) continue;
        if (gathered_.row(planes_.count, y + dy)[x + dx] == 0) continue;
        ++pairs;
        for (int c = 0; c < 3; ++c) {
            const float d = mean(c, x, y) - mean(c, x + dx, y + dy);
            sum[c] += 0.5f * d * d;
        }
    }
    if (pairs == 0) return;
    for (int c = 0; c < 3; ++c) squares[c] = kFreedom * sum[c] / static_cast<float>(pairs);
    freedom = kFreedom;
}

}  // namespace vlx
