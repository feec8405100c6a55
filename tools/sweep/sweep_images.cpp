#include "sweep/sweep_images.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "variolux/base/error.h"
#include "variolux/compare/metrics.h"
#include "variolux/reconstruct/gaussian.h"

namespace vlx {

double bestSigma(const Image& average, const Image& reference, const std::string& path) {
    double best = 0, least = std::numeric_limits<double>::infinity();
    constexpr int kSteps = 24;
    for (int i = 0; i <= kSteps; ++i) {
        const double sigma = std::round(200 * std::pow(20.0, static_cast<double>(i) / kSteps)) / 1000;
        const double error =
            compareColour(reference, gaussianFilter(average, sigma).image, path)[Metric::RelMse];
        if (error < least) {
            least = error;
            best = sigma;
        }
    }
    if (best == 0) throw Error(path, "expected an average that can be compared with the reference");
    return best;
}

std::vector<std::pair<int, int>> inspectedPixels(const Image& error, int count) {
    const Window& window = error.data;
    std::vector<std::pair<int, int>> places;
    const double area = static_cast<double>(window.pixels()) / std::max(count, 1);
    const int columns = std::max(1, static_cast<int>(std::lround(window.width / std::sqrt(area))));
    const int rows = std::max(1, count / columns);
    for (int row = 0; row < rows; ++row)
        for (int col = 0; col < columns; ++col)
            places.emplace_back(window.x + (2 * col + 1) * window.width / (2 * columns),
                                window.y + (2 * row + 1) * window.height / (2 * rows));

    struct Square {
        float error = -1;
        int x = 0, y = 0;
    };
    constexpr int kSide = 8;
    const int across = (window.width + kSide - 1) / kSide;
    std::vector<Square> squares(static_cast<std::size_t>(across) *
                                static_cast<std::size_t>((window.height + kSide - 1) / kSide));
    for (int row = 0; row < window.height; ++row)
        for (int col = 0; col < window.width; ++col) {
            const float* e = error.at(col, row);
            const float sum = e[0] + e[1] + e[2];
            Square& square = squares[static_cast<std::size_t>(row / kSide * across + col / kSide)];
            if (sum > square.error) square = {sum, window.x + col, window.y + row};
        }
    std::stable_sort(squares.begin(), squares.end(),
                     [](const Square& a, const Square& b) { return a.error > b.error; });
    for (std::size_t i = 0; i < squares.size() && i < static_cast<std::size_t>(count) / 4; ++i)
        if (squares[i].error >= 0) places.emplace_back(squares[i].x, squares[i].y);
    return places;
}

double exactPixels(const Image& colour, const Image& stddev, const ReferenceImage& reference) {
    int exact = 0;
    for (std::size_t i = 0; i < colour.pixels.size(); i += 3) {
        bool all = true;
        for (std::size_t c = i; c < i + 3; ++c)
            all = all && colour.pixels[c] == reference.colour.pixels[c] && stddev.pixels[c] == 0 &&
                  (!reference.stddev || reference.stddev->pixels[c] == 0);
        exact += all;
    }
    return exact;
}

Image errorImage(const Image& colour, const std::optional<Image>& stddev, const ReferenceImage* reference) {
    if (!reference) return stddev ? *stddev : Image(colour.data, colour.channels);
    Image error = colour;
    for (std::size_t i = 0; i < error.pixels.size(); ++i)
        error.pixels[i] = std::abs(colour.pixels[i] - reference->colour.pixels[i]);
    return error;
}

}  // namespace vlx
