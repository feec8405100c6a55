#pragma once

#include <string>

#include "render/gltf/gltf_file.h"

namespace vlx::render {

/// The number of the variant (KHR_materials_variants) with this name or, where none has it, this number.
/// Throws Error, which lists those there are, when there is no such one.
int variantNamed(const GltfFile& file, const std::string& wanted);

/// The material of a primitive in a variant (-1: in none, the default); -1: the specification's own.
int materialIn(const tinygltf::Primitive& primitive, int variant);

}  // namespace vlx::render
