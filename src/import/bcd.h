#pragma once

#include <cstdint>
#include <string>

#include "import/import.h"

namespace vlx {

struct BcdOptions {
    double samples = 0;      ///< of statistics without histogram: samples a pixel
    bool halves = true;      ///< of statistics: as MomentOptions::halves
    std::uint64_t seed = 0;  ///< likewise
    std::string renderer;
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// Whether the file starts as an OpenEXR file does (statistics) rather than as BCD's raw samples. Throws
/// Error when it cannot be read.
bool isOpenExr(const std::string& path);

/// Reads the raw samples of BCD (Boughida and Boubekeur, "Bayesian Collaborative Denoising for Monte Carlo
/// Rendering", 2017): little-endian int32 version, width, height, samples, channels (3 or 4: R G B, then one
/// that BCD does not read), then FLOAT by row, column, sample and channel. Works by bands of rows. Throws
/// Error when the header is not such a file's or its size is not what the header says.
ImportReport importBcdRaw(const std::string& raw, const std::string& dump, const BcdOptions& options,
                          const Progress& progress = {});

/// Reads what BCD's raw2bcd and renderers write for it: an image of means; the covariances of single samples
/// (Bin_0000 to Bin_0002: variances of R, G, B; then YZ, XZ, XY); the histogram, whose last channel Bin_nnnn
/// is the number of samples (may be empty when `samples` says it). As importMoments.
ImportReport importBcdStatistics(const std::string& image, const std::string& covariance,
                                 const std::string& histogram, const std::string& dump,
                                 const BcdOptions& options, const Progress& progress = {});

}  // namespace vlx
