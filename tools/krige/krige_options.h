#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "import_options.h"
#include "opinion/opinion_options.h"
#include "variolux/dump/positions.h"
#include "variolux/reconstruct/pixel_filter.h"
#include "variolux/reconstruct/reconstruct.h"

/// What vlx-krige is asked for.
namespace vlx {

enum class KrigeMethod { Krige, Paper, Mean, Gaussian };

struct KrigeOptions {
    std::string input;
    MomentFlags moments;
    std::string layersOf;
    bool dropLayers = false;
    std::string image;
    KrigeMethod method = KrigeMethod::Krige;
    Drift krige;
    PixelFilter filter = PixelFilter::Box;
    std::string band;
    std::string samplingMap;
    OpinionOptions opinion;
    bool noFeatures = false;
    PositionConvention positions = PositionConvention::Raster;
    bool layersAreSamples = false;
    Gaussian gaussian;
    Paper paper;
    bool noColourDistance = false;
    bool wholeImage = false;
    bool diagnostics = false;
    std::vector<std::string> inspect;
    bool json = false;
    int threads = 0;
    std::string maxMemory;
    std::string frames;
    bool overwrite = false;
    const CLI::App* commandLine = nullptr;
};

void bindOptions(CLI::App& app, KrigeOptions& o);

/// The method asked for, with its options.
Method methodOf(const KrigeOptions& o);

/// Throws CLI::ValidationError when an option was given that the method, or its other options, do not read.
void checkMethodOptions(const KrigeOptions& o);

/// Throws CLI::ValidationError when options for another denoiser's image do not fit.
void checkOpinion(const KrigeOptions& o);

/// The same of options for dumps or for flat images, `atHand`.
void checkInputOptions(const KrigeOptions& o, const std::vector<std::string>& atHand);

/// --inspect. Throws CLI::ValidationError.
std::pair<int, int> parsePixel(const std::string& text);

/// --max-memory: "2G", "500M". Throws CLI::ValidationError.
std::uint64_t parseMemory(const std::string& text);

}  // namespace vlx
