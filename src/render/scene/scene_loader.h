#pragma once

#include <optional>
#include <string>

#include "render/scene/scene.h"

namespace vlx::render {

/// Light from far away, where the scene file's own is not wanted or missing. At most one of the two.
struct EnvironmentOptions {
    std::optional<Rgb> constant;  ///< radiance
    std::string image;            ///< latitude-longitude image of any format OpenImageIO reads
};

/// What of a file is shown, and how it is meant.
struct SceneChoices {
    LightUnits lightUnits = LightUnits::Auto;
    std::string variant = {};  ///< name or number of a variant of materials; empty: the default
};

/// Reads a glTF 2.0 scene (.gltf or .glb). Units become radiometric: intensities of punctual lights W/sr or
/// W/m2, by what the file means (gltf_light.h) or `choices` says; emissiveFactor x emissiveStrength is
/// radiance.
///
/// Extensions: KHR_lights_punctual, KHR_texture_transform, KHR_mesh_quantization, KHR_draco_mesh_compression,
/// KHR_materials_ emissive_strength, ior, specular, transmission, clearcoat (without its own normal map),
/// sheen, volume (its absorption), unlit, variants; EXT_mesh_gpu_instancing, EXT_meshopt_compression,
/// EXT_texture_webp. Extras: cameras' `lens_radius`, `focus_distance` and `active`, punctual lights'
/// `radius`, the scene's `env_constant` and `light_units`. Animations of nodes, skins and morph targets are
/// followed while the shutter is open; lights stay where they are in its middle; points and lines are left
/// out: said in the report's warnings.
///
/// Throws Error, naming the file and what in it is wrong: not glTF; required extensions not in the list;
/// values of wrong types, references to what is not there (gltf_check.h); buffers missing or too short;
/// indices and joints out of range; vertices that are not finite; data that Draco or meshopt cannot decode; a
/// variant that is not there; textures without an image that can be read; no scene; nothing that gives
/// light. A scene need not have a camera: camera_placement.h makes one.
Scene loadScene(const std::string& path, const EnvironmentOptions& environment = {},
                const Shutter& shutter = {}, const SceneChoices& choices = {});

/// The cameras of a scene alone, as loadScene numbers them, whatever else it lacks or holds: no more of the
/// file is read than they need, buffers where animations move them.
Scene loadCameras(const std::string& path, const Shutter& shutter = {});

/// Derives what follows from a scene's geometry, materials and lights, which must be set: bounds, glass
/// tables, mesh lights of emissive shapes, the environment's light. loadScene ends with it.
void completeScene(Scene& scene);

/// Reads a latitude-longitude image. Throws Error when it cannot be read or is not finite and >= 0.
Environment loadEnvironment(const std::string& path);

}  // namespace vlx::render
