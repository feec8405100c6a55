#pragma once

#include <set>
#include <string>

#include "variolux/base/fingerprint.h"
#include "variolux/base/image_io.h"

/// Names of the attributes of a dump's headers; what they hold is in FORMAT.md.
namespace vlx {

inline constexpr char kVersion[] = "variolux:version";
inline constexpr char kRenderer[] = "variolux:renderer";
inline constexpr char kScene[] = "variolux:scene";
inline constexpr char kSeed[] = "variolux:seed";
inline constexpr char kSamples[] = "variolux:samples";
inline constexpr char kAveraged[] = "variolux:averaged";
inline constexpr char kPixelFilter[] = "variolux:pixelFilter";
inline constexpr char kEffects[] = "variolux:effects";
inline constexpr char kSplatReplicates[] = "variolux:splatReplicates";
inline constexpr char kReplicatesShare[] = "variolux:replicatesShare";
inline constexpr char kIndependentHalves[] = "variolux:independentHalves";
inline constexpr char kRenderSeconds[] = "variolux:renderSeconds";
inline constexpr char kMaxSamples[] = "maxSamplesPerPixel";
inline constexpr char kWorldToCamera[] = "worldToCamera";
inline constexpr char kWorldToNDC[] = "worldToNDC";

/// Attributes that a DumpHeader has members for, or that OpenEXR gives a meaning of its own.
inline bool isReserved(const std::string& name) {
    static const std::set<std::string> names = {"channels",
                                                "chunkCount",
                                                "compression",
                                                "dataWindow",
                                                "deepImageState",
                                                "displayWindow",
                                                "lineOrder",
                                                kMaxSamples,
                                                "name",
                                                "pixelAspectRatio",
                                                "screenWindowCenter",
                                                "screenWindowWidth",
                                                "tiles",
                                                "type",
                                                "version",
                                                "view",
                                                kWorldToCamera,
                                                kWorldToNDC};
    return (name.starts_with("variolux:") && name != kInputsAttribute) || names.contains(name);
}

}  // namespace vlx
