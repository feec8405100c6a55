#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample tracePath<kReflectingTextured>(const PathContext&, const Ray&, const PathSampler&);
template PathSample tracePath<kLayered>(const PathContext&, const Ray&, const PathSampler&);

}  // namespace vlx::render
