#pragma once

#include <functional>
#include <variant>

#include "variolux/base/progress.h"
#include "variolux/dump/sample_source.h"
#include "variolux/reconstruct/drift.h"
#include "variolux/reconstruct/gaussian.h"
#include "variolux/reconstruct/mean.h"
#include "variolux/reconstruct/paper.h"
#include "variolux/reconstruct/reconstruction.h"

/// The door: samples in, an image with its error out.
namespace vlx {

/// A method with its options; each header says what it computes.
using Method = std::variant<Drift, Paper, Mean, Gaussian>;

/// Takes the next `count` finished rows of an image, from the top: interleaved channels, as Image::pixels has
/// them.
using RowSink = std::function<void(const float* rows, int count)>;

/// The image that reconstruct() makes, without its pixels: windows and channels. Those are R, G, B, A when
/// the dump has it, further radiance (Drift), and stddev.R, .G, .B; of Gaussian R, G, B only.
/// Throws Error when options are invalid, by themselves or for this source's windows and positions.
Image outline(const SampleSource& source, const Method& method);

/// Reads `source` once, in bands of rows, and gives the rows of the image to `sink` as they are finished; the
/// image is never held whole but by Gaussian. Bit-identical for any number of threads. Throws as outline()
/// and SampleSource::read; Error when options name channels that the source lacks, and when there is not the
/// memory. What `sink` or `progress` throws ends the work and comes out.
ReconstructionReport reconstruct(const SampleSource& source, const Method& method, const RowSink& sink,
                                 const Progress& progress = {});

/// The same image, held whole.
Reconstruction reconstruct(const SampleSource& source, const Method& method, const Progress& progress = {});

}  // namespace vlx
