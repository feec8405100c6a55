#pragma once

#include <array>
#include <optional>
#include <string>

#include "variolux/base/image.h"
#include "variolux/base/window.h"

/// Another denoiser's image as secondary variable. It knows what pictures look like; the samples know what
/// this picture is.
namespace vlx {

/// Images over the data window of the samples, with channels R, G, B; all values finite.
struct SecondOpinion {
    Image image;  ///< what another denoiser made of all samples
    /// What it made of the samples of even and of odd number alone, in the order of the file from 0; of two
    /// replicates and more of the even and the odd ones. Each can be judged by the samples that it has not
    /// seen.
    std::optional<std::array<Image, 2>> halves = std::nullopt;
};

/// Checks an image of this name, of another denoiser, against the window that it should have: throws Error
/// on another size or place (a format without windows has its corner at 0), on channels other than R, G, B,
/// and on values that are not finite. Returns it with that window.
Image checkedOpinion(Image image, const std::string& name, const Window& window);

/// What became of it.
struct SecondOpinionReport {
    bool validated = false;  ///< the weight was found on samples that neither image had seen
    double weight = 0;       ///< of the kriging, where nothing speaks against the other image
    double yielded = 0;      ///< share of pixels where something does: the kriging weighs more
    double limited = 0;      ///< share of pixels kept within kOpinionDeviations of the kriging
    std::string refused;     ///< why images of halves that were there were not used; else empty
};

/// An estimate is moved by at most as many of its standard deviations.
inline constexpr double kOpinionDeviations = 2;

}  // namespace vlx
