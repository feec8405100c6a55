#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample PathTracer::traceWith<kMatte>(Ray, const PathSampler&) const;
template PathSample PathTracer::traceWith<kMatteTextured>(Ray, const PathSampler&) const;
template PathSample PathTracer::traceWith<kReflecting>(Ray, const PathSampler&) const;

}  // namespace vlx::render
