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

    void bind(CLI::App& app);
    bool any() const { return !denoised.empty() || !denoiser.empty(); }
    /// The files named, without layers: `denoised`, then the halves.
    std::vector<std::string> files() const;
    /// Of one frame.
    OpinionOptions ofFrame(int frame) const;

    /// Reads the images, or has `denoiser` make them of the dump `input`, into a temporary folder. Throws
    /// Error as readImage(), checkedOpinion() and denoise(); CLI::ValidationError when options do not fit.
    std::shared_ptr<const SecondOpinion> read(const std::string& input, bool flat,
                                              const Window& window) const;
};

}  // namespace vlx
