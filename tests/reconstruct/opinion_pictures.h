#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "variolux/dump/sample_buffer.h"
#include "variolux/reconstruct/reconstruct.h"

/// A picture of known truth, its samples, and what another denoiser could have made of them.
namespace vlx {

inline const Window kPicture{-3, 5, 96, 80};
inline constexpr double kSampleNoise = 0.4;  // of a sample, relative

inline double truthAt(int x, int y) {
    const double shade = 1 + 0.4 * std::sin(0.15 * x) * std::cos(0.1 * y);
    return shade * ((x / 12 + y / 12) % 2 ? 0.3 : 1);
}

/// `count(x, y)` samples a pixel.
inline SampleBuffer samplesOf(const std::function<int(int, int)>& count, unsigned seed = 11,
                              const Window& picture = kPicture) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(1, kSampleNoise);
    DumpHeader header;
    header.data = header.display = picture;
    header.channels = {{"R"}, {"G"}, {"B"}};
    SampleBand band{picture.x, picture.y, picture.width, picture.height, {0}, {"R", "G", "B"}, {}};
    band.values.resize(3);
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x) {
            for (int i = 0; i < count(x, y); ++i)
                for (auto& values : band.values)
                    values.push_back(static_cast<float>(truthAt(x, y) * normal(random)));
            band.offsets.push_back(band.values[0].size());
        }
    return {header, std::move(band)};
}

/// The truth with noise of the seed; `of` makes a wrong image of it.
inline Image opinionOf(unsigned seed, const std::function<double(int, int)>& of = truthAt,
                       double noise = 0.03, const Window& picture = kPicture) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, noise);
    Image image(picture, {"R", "G", "B"});
    for (int y = 0; y < picture.height; ++y)
        for (int x = 0; x < picture.width; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(of(x, y) + normal(random));
    return image;
}

inline Drift withOpinion(const std::function<double(int, int)>& of, bool halves) {
    SecondOpinion opinion{opinionOf(1, of), {}};
    if (halves) opinion.halves = {opinionOf(2, of), opinionOf(3, of)};
    return {.secondOpinion = std::make_shared<SecondOpinion>(std::move(opinion))};
}

inline int eightSamples(int, int) { return 8; }

}  // namespace vlx
