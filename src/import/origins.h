#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exr/flat_images.h"
#include "import/moments.h"

namespace vlx {

/// Where a channel of the dump comes from.
struct Origin {
    std::size_t image = 0;
    std::string channel;
};

/// Dump channel -> where from.
using Origins = std::map<std::string, Origin>;

using Three = std::array<std::string, 3>;

/// Other images of one thing each, after the images proper.
class Companions {
  public:
    explicit Companions(const CompanionImages& with);

    /// Adds their paths to those of the images proper.
    void appendTo(std::vector<std::string>& images);

    /// Number of the image that holds `what` (variance, albedo, N, Z), if any.
    std::optional<std::size_t> image(const std::string& what) const;

    /// Enters their channels: named by colour or direction, else the first three, else the only one.
    void enterInto(Origins& origins, const FlatImages& images) const;

  private:
    std::vector<std::pair<std::string, std::string>> paths_;
    std::size_t first_ = 0;
};

/// Tells the report what came from where, and what of the first image was left out. The first `own` images
/// have equal channels and are named by channel alone.
void describe(const FlatImages& images, const Origins& origins, std::size_t own, ImportReport& report);

/// Throws Error when nothing was found to take as `channel`.
void require(const FlatImages& images, const Origins& origins, const std::string& channel,
             const std::string& advice);

std::array<FlatChannel, 3> takeThree(FlatImages& images, const Origins& origins, const Three& channels);

}  // namespace vlx
