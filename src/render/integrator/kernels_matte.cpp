#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample tracePath<kMatte>(const PathContext&, const Ray&, const PathSampler&);
template PathSample tracePath<kMatteTextured>(const PathContext&, const Ray&, const PathSampler&);
template PathSample tracePath<kReflecting>(const PathContext&, const Ray&, const PathSampler&);

}  // namespace vlx::render
