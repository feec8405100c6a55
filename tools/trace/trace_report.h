#pragma once

#include <string>

#include "trace/trace_options.h"

/// What vlx-trace prints.
namespace vlx::render {

/// A line on standard error, about the scene.
void note(const TraceOptions& o, const std::string& text);

// Each returns an ExitCode.
int printCameras(const TraceOptions& o, const Scene& loaded);
int printPlan(const TraceOptions& o, const Scene& loaded, const Plan& plan, const IntegratorChoice& choice);
/// That the work was finished before.
int printSkipped(const TraceOptions& o);

/// Says so when most of what the camera would see first are the backs of surfaces that have one side, which
/// are not seen: the usual reason why a file shows holes or nothing.
void warnOfBacks(const TraceOptions& o, const Scene& loaded, const Accelerator& accelerator);

/// Warns when the picture is far brighter or darker than screens show.
void warnOfBrightness(const TraceOptions& o, const Scene& loaded, const RenderReport& report);

void summarize(const TraceOptions& o, const Scene& loaded, const RenderReport& report);

}  // namespace vlx::render
