#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "variolux/base/channel_type.h"
#include "variolux/base/window.h"

namespace vlx {

/// Version written into variolux:version. Readers accept any; a change of meaning raises it.
inline constexpr int kDumpVersion = 1;

struct DumpChannel {
    std::string name;
    ChannelType type = ChannelType::Float;
};

/// What a dump's header says: everything but the samples. FORMAT.md beside it specifies the format.
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
    std::optional<double> samples;  ///< samples a pixel asked for (mean, when adaptive)
    double averaged = 1;            ///< each sample is itself the mean of that many samples of the renderer
    std::optional<double> renderSeconds;              ///< wall time of tracing
    std::optional<std::vector<float>> worldToCamera;  ///< 16 values, row vectors (OpenEXR convention)
    std::optional<std::vector<float>> worldToNDC;     ///< likewise
    int splatReplicates = 0;         ///< replicates of the part `splats` (splats.h); 0: there is no such part
    bool replicatesShare = false;    ///< samples of a replicate in a pixel have some light in common: splats
    bool independentHalves = false;  ///< a pixel's samples of even and of odd number are independent
    std::map<std::string, std::string> extra;  ///< other text attributes, kept from and to the file
};

/// The channels of FORMAT.md that Variolux gives meaning to, in its order:
/// R G B A Z sample.x sample.y albedo.R albedo.G albedo.B N.X N.Y N.Z sample.replicate, with their stored
/// types.
const std::vector<DumpChannel>& standardChannels();

/// Known error variances of a sample's R, G, B, where a dump has them: of samples that are themselves means
/// of many. Negative: not known. The variance of the mean of a pixel's n samples is their sum divided by n^2.
inline constexpr std::string_view kVarianceChannels[] = {"variance.R", "variance.G", "variance.B"};

/// How far from a sample's position, in raster pixels, what its camera ray meets first was in the frame
/// before and will be in the next. Not finite: not known.
inline constexpr std::string_view kMotionChannels[] = {"motion.x", "motion.y", "motionNext.x",
                                                       "motionNext.y"};

/// The number of a replicate that a value of channel sample.replicate stands for: a whole number below 2^32.
/// Nothing for any other value; readers refuse files that have one.
std::optional<std::uint32_t> replicateNumber(float value);

/// Lets `header` say what the dump is made of (kInputsAttribute of base/fingerprint.h): nothing when empty.
void setInputs(DumpHeader& header, const std::string& inputs);

/// Channels that `name` stands for among `names`: the channel of this name, or the layerTriple()
/// (base/channel_names.h) of this name. Empty when there are none.
std::vector<std::string> radianceChannels(const std::vector<std::string>& names, const std::string& name);

/// Something a dump lacks, and what that costs the reconstruction.
struct MissingPart {
    std::string what;  ///< for example "sample positions (sample.x, sample.y)"
    std::string cost;  ///< one sentence for a person
};

/// Channels and attributes that a dump with this header lacks, in the order of their use.
std::vector<MissingPart> missingChannels(const DumpHeader& header);

/// Position of a channel in `header`, or -1.
int findChannel(const DumpHeader& header, std::string_view name);

}  // namespace vlx
