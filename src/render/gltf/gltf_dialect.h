#pragma once

#include <tiny_gltf.h>

namespace vlx::render {

/// Whose ways a file follows where glTF leaves room, or programs take it.
struct Dialect {
    /// Made for this tracer: it has extras that nothing else reads, cameras' `lens_radius`, `focus_distance`
    /// or `active`, a scene's `env_constant` or `light_units`. Not lights' `radius`: Blender's may have it as
    /// a custom property.
    bool own = false;
    /// Of the Blender whose exporter wrote it, by its generator; 0: another program's, or an own one.
    int blender = 0;

    /// What Blender 4 did away with: spots that fade by the cosine too, diffuse light that is
    /// retro-reflected.
    bool oldBlender() const { return blender > 0 && blender < 4; }
};

Dialect dialectOf(const tinygltf::Model& model);

}  // namespace vlx::render
