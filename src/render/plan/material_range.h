#pragma once

#include "render/scene/scene.h"

namespace vlx::render {

/// Which lobes a material can have anywhere on a surface, its textures taken at their least and greatest.
struct MaterialRange {
    bool diffuse = false;
    bool glossy = false;  ///< rough reflection, of the base, the coat or glass
    bool mirror = false;
    bool transmission = false;
    bool roughTransmission = false;
    bool absorption = false;
    bool clearcoat = false;
    bool sheen = false;
    bool seeThrough = false;  ///< opacity below 1 somewhere
    bool normalMapped = false;

    /// Light that falls on it goes on.
    bool scatters() const { return spreads() || mirror || transmission; }
    /// Nothing but the diffuse lobe, which reflects alike in all directions.
    bool onlyDiffuse() const {
        return diffuse && !(glossy || mirror || transmission || roughTransmission || clearcoat || sheen);
    }
    /// Lights can be sampled there: a lobe that is not a delta function.
    bool spreads() const { return diffuse || glossy || roughTransmission || sheen; }
};

/// Textures are gone through once: a cache for all materials of a scene.
class MaterialRanges {
  public:
    explicit MaterialRanges(const Scene& scene);
    const MaterialRange& of(std::size_t material) const { return ranges_[material]; }

  private:
    std::vector<MaterialRange> ranges_;
};

}  // namespace vlx::render
