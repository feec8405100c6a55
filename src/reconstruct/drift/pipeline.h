#pragma once

#include "reconstruct/data/frame.h"
#include "reconstruct/sequence/merge.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {

/// What neighbouring frames add to a frame, at both resolutions; null: nothing.
struct FrameMerge {
    Merge *fine = nullptr, *coarse = nullptr;
};

/// Kriges a frame of `dump` as far as it is not filled, and gives the rows of the picture to `sink`. The
/// clock is that of the frame, and adds to the DriftReport of `report`.
void krigeFrame(const SampleSource& dump, const Drift& options, Frame& frame, const FrameMerge& merge,
                ReconstructionReport& report, StageClock& clock, const RowSink& sink,
                const Progress& progress);

}  // namespace vlx
