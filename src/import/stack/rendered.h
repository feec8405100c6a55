#pragma once

#include <optional>
#include <string>
#include <vector>

#include "import/stack/plan.h"
#include "variolux/dump/band.h"

namespace vlx {

/// Which pixels of Blender's images were rendered: outside a render border, and in tiles that were not
/// reached, all passes but two are 0, the alpha too, as they are where a transparent film shows nothing.
///
/// The pass Depth tells them apart: Blender fills it with 1e11, Cycles writes 1e10 for a miss (3.4, looked
/// at). Without it the pixels that are 0 in colour, alpha and all features of all images were not rendered if
/// the others fill a rectangle whose sides are no edges: those of a transparent film do not.
class RenderedPixels {
  public:
    /// Takes the depth from the images, or looks through them once more where their corners are 0.
    RenderedPixels(FlatImages& images, const StackPlan& plan, bool keepEmpty);

    /// Pixel by pixel of the rows read last, `band` having a sample of each image in each.
    std::vector<char> of(const FlatImages& images, const SampleBand& band);

    /// What became of pixels of zeros, if there are any.
    std::vector<std::string> notes() const;

  private:
    std::vector<FlatChannel> depth_;
    std::optional<Window> border_;
    bool unclear_ = false;  // zeros that may be a transparent film's
    std::int64_t left_ = 0;
};

}  // namespace vlx
