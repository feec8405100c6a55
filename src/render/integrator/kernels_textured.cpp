#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample PathTracer::traceWith<kReflectingTextured>(Ray, const PathSampler&) const;
template PathSample PathTracer::traceWith<kLayered>(Ray, const PathSampler&) const;

}  // namespace vlx::render
