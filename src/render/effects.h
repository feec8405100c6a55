#pragma once

#include <string>
#include <vector>

#include "scene.h"

namespace vlx::render {

/// Names of the effects that a picture of `scene` by `camera` simulates, for the dump's header: of diffuse,
/// glossy, mirror, transmission, rough_transmission, clearcoat, textures, normal_maps, alpha,
/// emissive_meshes, punctual_lights, sphere_lights, environment, depth_of_field, indirect.
std::vector<std::string> sceneEffects(const Scene& scene, const Camera& camera, int maxBounces);

}  // namespace vlx::render
