#pragma once

#include "trace/trace_options.h"

namespace vlx::render {

/// Camera and picture, by the scene's cameras alone: what is wrong with them is told before the scene is
/// read. Without a camera that can be used nothing is chosen: reading the scene says why.
void chooseView(TraceOptions& o, const Scene& known);

/// The picture of the dump that is added to, where the command line names none.
void takeSizeOf(TraceOptions& o, const EarlierDump& earlier);

}  // namespace vlx::render
