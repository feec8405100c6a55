#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/gltf/gltf_dialect.h"
#include "render/gltf/gltf_file.h"
#include "render/light/light.h"
#include "render/math/transform.h"

namespace vlx::render {

/// The numbers of KHR_lights_punctual, which programs write in their own ways:
/// - one made for this tracer is radiometric, unless the scene's extras have `light_units` "photometric"; its
///   spots fade as the extension recommends;
/// - Blender's exporter writes watts (over 4 pi for points and spots), times 683 lm/W or not, by a mode that
///   it does not write. Blender holds watts in 32 bits, and the file has 64: the numbers show whether 683 is
///   in them. Emission is never multiplied by it. Its spots fade as Cycles has them: by the smooth step of
///   the cosine over the outer (1 - cos outer) x blend, blend = 1 - inner / outer, up to Blender 3.6 times
///   the cosine;
/// - all others are photometric, as the extension says.
class LightReader {
  public:
    /// `units`: what to take the intensities for; photometric ones are divided by 683 lm/W. Throws Error when
    /// the scene's `light_units` is no such name.
    LightReader(const GltfFile& file, const tinygltf::Scene* scene, LightUnits units);

    /// The light `index` of the file at a node, `what` naming the node in messages. Nothing, with a warning,
    /// when it has no power. Throws Error when there is no such light, or it is broken.
    std::optional<Light> read(int index, const tinygltf::Node& node, const Transform& toWorld,
                              const std::string& what, std::vector<std::string>& warnings) const;

    LightUnits units() const {
        return lumensPerWatt_ == 1 ? LightUnits::Radiometric : LightUnits::Photometric;
    }
    /// Which units are assumed and why, for the user; empty when it is certain.
    const std::string& told() const { return told_; }

  private:
    void setCone(Light& light, const tinygltf::SpotLight& spot) const;
    void judge(const tinygltf::Scene* scene);
    void judgeBlender();

    const GltfFile& file_;
    Dialect dialect_;
    double lumensPerWatt_ = 1;
    std::string told_;
};

}  // namespace vlx::render
