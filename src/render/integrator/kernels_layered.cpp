#include "render/integrator/path_kernel.h"

namespace vlx::render {

template bool scatterAt<kLayeredTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template bool scatterAt<kEveryFeature>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);

}  // namespace vlx::render
