#pragma once

#include <string>
#include <vector>

#include "exr/flat_images.h"

/// What headers of images tell of their rendering.
namespace vlx {

/// Samples a pixel that each image is the mean of: Blender's `cycles.LAYER.samples`, or `samplesPerPixel`
/// (pbrt). 0: its header does not say. `layer` is cyclesLayer(), or empty.
std::vector<double> samplesOfImages(const FlatImages& images, const std::string& layer);

/// The renderer of the first image: `Software`, or what else only one renderer writes. Empty: not known.
std::string rendererOf(const FlatImages& images, const std::string& layer);

}  // namespace vlx
