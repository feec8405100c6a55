#pragma once

#include "reconstruct/common/methods.h"

namespace vlx {

/// Kriging with options.secondOpinion: METHOD.md, 7.11. `options` were checked.
ReconstructionReport reconstructWithOpinion(const SampleSource& source, const Drift& options,
                                            const RowSink& sink, const Progress& progress);

}  // namespace vlx
