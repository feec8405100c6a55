#pragma once

#include "variolux/reconstruct/reconstruct.h"

/// The methods behind the door, which has checked their options (outline()): each gives its rows to the sink
/// as reconstruct() says.
namespace vlx {

inline constexpr const char* kStddevChannels[] = {"stddev.R", "stddev.G", "stddev.B"};

/// Throws Error when one of these pixels (x, y), to be inspected, is not in the window.
void requireInside(const std::vector<std::pair<int, int>>& pixels, const Window& window,
                   const std::string& path);

/// What rowsOf(sink) gives to its sink, held whole. Throws Error when there is not the memory.
Reconstruction wholeOf(const SampleSource& source, const Image& outline,
                       const std::function<ReconstructionReport(const RowSink&)>& rowsOf);

Image driftOutline(const SampleSource& source, const Drift& method);

ReconstructionReport reconstructDrift(const SampleSource& source, const Drift& method, const RowSink& sink,
                                      const Progress& progress);
ReconstructionReport reconstructPaper(const SampleSource& source, const Paper& method, const RowSink& sink,
                                      const Progress& progress);
ReconstructionReport reconstructMean(const SampleSource& source, const Mean& method, const RowSink& sink,
                                     const Progress& progress);

}  // namespace vlx
