#include "render/integrator/path_kernel.h"

namespace vlx::render {

template bool scatterAt<kReflectingTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template bool scatterAt<kLayered>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);

}  // namespace vlx::render
