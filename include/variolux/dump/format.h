#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "variolux/base/window.h"

namespace vlx {

/// Version written into variolux:version. Readers accept any; a change of meaning raises it.
inline constexpr int kDumpVersion = 1;

/// How a channel is stored. In memory every channel is float: HALF widens exactly, UINT is exact to 2^24.
enum class ChannelType { Half, Float, Uint };

struct DumpChannel {
    std::string name;
    ChannelType type = ChannelType::Float;
};

/// The lossless compressions that OpenEXR allows in deep files.
enum class DumpCompression { None, Rle, Zips };

/// What a dump's header says: everything but the samples. The format is specified in the README.
struct DumpHeader {
    Window data;     ///< pixels held
    Window display;  ///< the whole picture; equal to data unless the dump is a crop
    std::vector<DumpChannel> channels;
    DumpCompression compression = DumpCompression::Zips;

    // variolux: attributes; absent ones keep these defaults.
    int version = kDumpVersion;
    std::string renderer;
    std::string scene;
    std::string pixelFilter;           ///< "box" when samples are spread evenly over their own pixel
    std::vector<std::string> effects;  ///< effects that were simulated; stored joined with ','
    std::optional<std::int64_t> seed;
    std::optional<double> samples;                    ///< samples a pixel asked for (mean, when adaptive)
    std::optional<double> renderSeconds;              ///< wall time of tracing
    std::optional<std::vector<float>> worldToCamera;  ///< 16 values, row vectors (OpenEXR convention)
    std::optional<std::vector<float>> worldToNDC;     ///< likewise
    int splatReplicates = 0;       ///< replicates of the part `splats` (splats.h); 0: there is no such part
    bool replicatesShare = false;  ///< samples of a replicate in a pixel have some light in common: splats
    std::map<std::string, std::string> extra;  ///< other text attributes, kept from and to the file
};

/// The channels of DESIGN's dump table that Variolux gives meaning to, in its order:
/// R G B A Z sample.x sample.y albedo.R albedo.G albedo.B N.X N.Y N.Z sample.replicate, with their stored
/// types.
const std::vector<DumpChannel>& standardChannels();

/// Known error variances of a sample's R, G, B, where a dump has them: of samples that are themselves means
/// of many. Negative: not known. The variance of the mean of a pixel's n samples is their sum divided by n^2.
inline constexpr std::string_view kVarianceChannels[] = {"variance.R", "variance.G", "variance.B"};

/// The number of a replicate that a value of channel sample.replicate stands for: a whole number below 2^32.
/// Nothing for any other value; readers refuse files that have one.
std::optional<std::uint32_t> replicateNumber(float value);

/// Lets `header` say what the dump is made of (kInputsAttribute of base/image_io.h): nothing when empty.
void setInputs(DumpHeader& header, const std::string& inputs);

/// Position of a channel in `header`, or -1.
int findChannel(const DumpHeader& header, std::string_view name);

}  // namespace vlx
