#include "render/integrator/scatter_all.h"

namespace vlx::render {

template bool scatterAt<kMatte>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kMatte>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
template bool scatterAt<kMatteTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kMatteTextured>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
template bool scatterAt<kReflecting>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kReflecting>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);

}  // namespace vlx::render
