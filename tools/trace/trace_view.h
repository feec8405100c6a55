#pragma once

#include "trace/trace_options.h"

namespace vlx::render {

/// Camera and picture, by the scene's cameras alone: what is wrong with them is told before the scene is
/// read. Without a camera that can be used, and none asked for, the one after the last is chosen.
void chooseView(TraceOptions& o, Scene known);

/// Puts the chosen camera where the command line wants it; makes it where there is none. A camera that is to
/// stand still is placed by what the scene holds while it is exposed, or in a sequence from the exposure
/// `first`, frame 0's, to the last key of its animations: it is in all frames the same.
void placeCamera(const TraceOptions& o, Scene& loaded, const Shutter& first);

/// The picture of the dump that is added to, where the command line names none.
void takeSizeOf(TraceOptions& o, const EarlierDump& earlier);

}  // namespace vlx::render
