#include "reconstruct/drift/common_error.h"

#include <algorithm>
#include <utility>

#include "reconstruct/common/planes.h"
#include "reconstruct/common/window_sum.h"
#include "reconstruct/drift/stacking.h"

namespace vlx {

namespace {

// Squared standard errors by which what is missing must exceed chance: near, where many windows are looked
// at, two (of 1, 2, 4 and 9 chosen by looking at five cases and the stress scenes).
constexpr double kSignificance[] = {4, 1};

}  // namespace

void CommonError::sumRow(int y, const std::vector<float>& products, const std::vector<float>& known) {
    std::vector<float> squares(products.size());
    for (std::size_t i = 0; i < products.size(); ++i) squares[i] = products[i] * products[i];
    for (const auto& [window, reach] : {std::pair{0, kNear}, {1, kWide}}) {
        sumAround(products, reach, false, sums_.row(CommonErrorPlanes::products(window), y));
        sumAround(squares, reach, true, sums_.row(CommonErrorPlanes::squares(window), y));
        sumAround(known, reach, false, sums_.row(CommonErrorPlanes::pixels(window), y));
    }
}

std::vector<double> CommonError::shares(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<double> result(w), products(w), squares(w), pixels(w);
    for (const int window : {1, 0}) {
        for (auto* sums : {&products, &squares, &pixels}) std::fill(sums->begin(), sums->end(), 0.0);
        for (int row = std::max(0, y - kNear); row <= std::min(height_ - 1, y + kNear); ++row) {
            const auto g = static_cast<double>(windowWeight(row - y, kNear));
            addScaled(sums_.row(CommonErrorPlanes::products(window), row), g, w, products.data());
            addScaled(sums_.row(CommonErrorPlanes::squares(window), row), g * g, w, squares.data());
            addScaled(sums_.row(CommonErrorPlanes::pixels(window), row), g, w, pixels.data());
        }
        for (std::size_t i = 0; i < w; ++i) {
            if (!(pixels[i] > 0)) continue;
            const double more = products[i] - result[i] * pixels[i];
            const double known = shrinkage(more * more, kSignificance[window] * squares[i]);
            result[i] = std::max(0.0, result[i] + known * more / pixels[i]);
        }
    }
    return result;
}

}  // namespace vlx
