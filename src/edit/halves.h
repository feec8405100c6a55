#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "variolux/base/progress.h"
#include "variolux/dump/format.h"

/// The pictures that other denoisers start from: of all samples of a dump, and of two halves of them.
namespace vlx {

struct HalvesReport {
    std::vector<std::string> files;   ///< written
    std::int64_t droppedSamples = 0;  ///< with radiance that is not finite, left out
    std::int64_t emptyPixels = 0;     ///< without samples: 0 everywhere
    std::int64_t missingInHalves =
        0;  ///< pixels of a half without samples of it: they have those of the other
};

/// Writes PREFIX_color.pfm, and PREFIX_albedo.pfm and PREFIX_normal.pfm where the dump has those features:
/// each pixel's mean of its samples. PREFIX_even_color.pfm, PREFIX_odd_color.pfm and so on are of its samples
/// of even and of odd number, in the order of the file from 0; of a dump of two replicates and more, of its
/// even and odd replicates (sample.replicate). A denoiser's images of the halves can be judged by what the
/// other half shows.
///
/// PFM: 32-bit floats R, G, B, little endian, rows from the bottom up; the size is that of the data window.
/// Values that are not finite count as 0 in features. Works by bands of rows. Nothing is left under the final
/// names unless all are whole. Throws Error as DumpReader, and when a file cannot be written.
HalvesReport writeHalves(const std::string& dump, const std::string& prefix, const Progress& progress = {});

/// Writes a dump of the samples of even, 0, or odd number, 1, of each pixel, those that the pictures of a
/// half are the mean of, for denoisers that read dumps. Replicates are numbered anew, 0 for 0 and 1, 1 for 2
/// and 3. Windows, channels and attributes stay; variolux:samples and variolux:renderSeconds become their
/// share. `inputs` is for the header's kInputsAttribute. Returns the number of samples. Works by bands of
/// rows. Throws Error as DumpReader and DumpWriter, and where there are no such samples.
std::uint64_t writeHalfDump(const std::string& dump, const std::string& output, int parity,
                            DumpCompression compression = DumpCompression::Rle,
                            const std::string& inputs = {}, const Progress& progress = {});

}  // namespace vlx
