#include "render/integrator/path_kernel.h"

namespace vlx::render {

template bool scatterAt<kMatte>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template bool scatterAt<kMatteTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template bool scatterAt<kReflecting>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);

}  // namespace vlx::render
