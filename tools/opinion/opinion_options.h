#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/reconstruct/second_opinion.h"

/// Another denoiser's image, given or to be made.
namespace vlx {

struct OpinionOptions {
    std::string denoised;
    std::string halves;    ///< EVEN,ODD
    std::string denoiser;  ///< a command, or "oidn"
    std::string assessed;  ///< to be judged, not combined
    std::string assessedHalves;

    void bind(CLI::App& app);
    bool assesses() const { return !assessed.empty(); }
    bool any() const { return !denoised.empty() || !denoiser.empty() || assesses(); }
    /// Throws CLI::ValidationError when they do not fit together.
    void check() const;
    /// What the result depends on: images, the denoiser's program and files among its arguments.
    std::vector<std::string> files() const;
    /// Of one frame.
    OpinionOptions ofFrame(int frame) const;

    /// Reads the images, or has `denoiser` make them of the dump `input`, into a temporary folder. Throws
    /// Error as readImage(), checkedOpinion() and denoise(); CLI::ValidationError when options do not fit.
    std::shared_ptr<const SecondOpinion> read(const std::string& input, bool flat, const Window& window,
                                              int threads) const;
};

}  // namespace vlx
