#pragma once

#include <string>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// By what a source looks like a deep image for compositing, whose pixels hold layers, from front to back,
/// each with its coverage, instead of samples of the camera to be averaged; empty when it does not.
///
/// Samples that have positions, replicates or variances are the camera's. Of others a channel ZBack says that
/// they are layers, as does Z that grows within nearly every pixel, of rows spread over the image, where some
/// A is neither 0 nor 1: the camera's samples come in any order. Throws as SampleSource::read.
std::string layersFoundBy(const SampleSource& source);

}  // namespace vlx
