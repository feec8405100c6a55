#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample PathTracer::traceWith<kLayeredTextured>(Ray, const PathSampler&) const;
template PathSample PathTracer::traceWith<kEveryFeature>(Ray, const PathSampler&) const;

}  // namespace vlx::render
