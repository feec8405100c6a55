#pragma once

#include <optional>
#include <string>
#include <vector>

#include "exr/flat_images.h"
#include "import/stack/cycles_passes.h"

namespace vlx {

/// A channel of the dump. Nothing in the sum: not of the images (replicates; motion that is not known).
struct StackChannel {
    DumpChannel channel;
    Recipe recipe;
};

/// What a stack's dump holds, and what that is of the images.
struct StackPlan {
    StackPreset preset = StackPreset::Plain;
    std::string layer;  ///< of Cycles: "L.", that of --layer or the first one
    ChannelMap mapped;  ///< for the report
    std::vector<StackChannel> channels;
    Names groups;                             ///< light groups that are kept as radiance
    std::vector<Contribution> contributions;  ///< likewise
    bool noisyImage = false;                  ///< taken in place of a denoised Combined
    Names radiance;                           ///< all further radiance: layers or channels
};

/// Of images with these channels; `path` is the first one's. Throws Error as chooseStackMap(), and where
/// light groups or contributions are asked of images that are not Blender's.
StackPlan planStack(const std::string& path, const Names& names, const StackOptions& options);

/// A recipe's channels as an image has them.
struct Mixture {
    std::vector<FlatChannel> sum;
    std::optional<FlatChannel> times;

    float value(const FlatImages& images, std::size_t pixel) const {
        float value = images.value(sum.front(), pixel);
        for (std::size_t i = 1; i < sum.size(); ++i) value += images.value(sum[i], pixel);
        return times ? value * images.value(*times, pixel) : value;
    }
};
/// Of each image; from now on these channels are read.
std::vector<Mixture> takeFromAll(FlatImages& images, const Recipe& recipe);

}  // namespace vlx
