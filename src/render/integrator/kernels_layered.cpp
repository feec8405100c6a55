#include "render/integrator/path_kernel.h"

namespace vlx::render {

template PathSample tracePath<kLayeredTextured>(const PathContext&, const Ray&, const PathSampler&);
template PathSample tracePath<kEveryFeature>(const PathContext&, const Ray&, const PathSampler&);

}  // namespace vlx::render
