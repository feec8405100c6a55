#include "render/integrator/scatter_all.h"

namespace vlx::render {

template bool scatterAt<kReflectingTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kReflectingTextured>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
template bool scatterAt<kLayered>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kLayered>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);

}  // namespace vlx::render
