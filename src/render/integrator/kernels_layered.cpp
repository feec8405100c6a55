#include "render/integrator/scatter_all.h"

namespace vlx::render {

template bool scatterAt<kLayeredTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kLayeredTextured>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
template bool scatterAt<kEveryFeature>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
template void scatterAll<kEveryFeature>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);

}  // namespace vlx::render
