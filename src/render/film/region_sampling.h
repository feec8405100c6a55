#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "render/math/vec.h"
#include "render/scene/camera.h"
#include "variolux/base/window.h"

namespace vlx::render {

/// Takes a sample and returns its radiance.
using Shade = std::function<Rgb(const CameraSample&)>;

/// Sample `index` of a pixel's randomisation, `seed`: somewhere in the pixel.
CameraSample sampleInPixel(int column, int row, std::uint64_t seed, std::uint32_t index);

/// Side of a region in pixels.
inline constexpr int kRegionSize = 4;

/// `spp` samples in each pixel of `window` (at most a region's), in `replicates` independent randomisations
/// of spp / replicates each: Owen-scrambled Sobol points over the pixel. One replicate is two such
/// randomisations, samples of even and of odd number: independent halves (DumpHeader::independentHalves) are
/// worth more to the reconstruction, whose error they tell, than points that are spread evenly together.
void sampleUniformly(const Window& window, int spp, int replicates, std::uint64_t seed, const Shade& shade);

/// As many samples in each pixel as `countAt(column, row)` says, of one randomisation, `replicate`, or of two
/// by turns.
void sampleCounts(const Window& window, const std::function<int(int, int)>& countAt,
                  std::optional<std::uint32_t> replicate, std::uint64_t seed, const Shade& shade);

struct HierarchicalOptions {
    /// Refinement of a cell stops when its residual variance s^2 says that samples at this density give
    /// pixels a relative squared error of at most tolerance^2: mean over R, G, B of s^2 / (samples a pixel) /
    /// (mean^2 + 0.01) <= tolerance^2. 0: never stops before the last level. Stopping by what the samples
    /// themselves say darkens the image a little: cells that have missed rare bright paths stop early (the
    /// demo room: 1.5 % at 0.1, 6 % at 0.5).
    double tolerance = 0.05;
    int levels = 5;  ///< 1, 4, 16, 64, 256 samples a pixel at most
};

/// Number of samples that one cell of hierarchical sampling holds once refined: 4n with n = 4.
inline constexpr int kCellSamples = 16;

/// Hierarchical sampling of one region of 4x4 pixels (METHOD.md, section 3; n = 4): cells of 4, 2, 1, 1/2,
/// 1/4 pixels, each refined to 16 points of the region's one Owen-scrambled Sobol sequence. A cell's points
/// that lie outside `window` (a region at the image's border) are left out. `regionX`, `regionY`: the
/// region's number; its pixels are [4 regionX, 4 regionX + 4) x [4 regionY, ...). Returns how many cells were
/// refined at each level.
std::vector<int> sampleHierarchically(const Window& window, int regionX, int regionY,
                                      const HierarchicalOptions& options, std::uint64_t seed,
                                      const Shade& shade);

}  // namespace vlx::render
