#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace vlx::render {

/// What a value must be. Of Unit to Quaternion another type is an error, a value out of range a
/// warning: readers take the nearest that is in it.
enum class RuleKind {
    Index,       ///< of an element of an array
    Count,       ///< a whole number >= 0
    Number,      ///< any
    Numbers,     ///< an array of `size` of them
    Unit,        ///< a number in [0, 1]
    Units,       ///< an array of `size` of them
    Positive,    ///< a number >= 0
    Positives,   ///< an array of `size` of them
    Quaternion,  ///< four numbers, of length 1
    String,
    Word,  ///< one of a few
    Bool,
    Object
};

/// What a place in a glTF file must be, if it is there. Places are paths: [] stands for every element of an
/// array, {} for every member of an object.
struct GltfRule {
    std::string_view place;
    RuleKind kind;
    std::string_view of = {};  ///< Index: the array that it refers to; Word: those that may be
    std::size_t size = 0;      ///< of an array; Count: it must be less, unless this is 0
};

/// Of the whole file.
std::span<const GltfRule> gltfRules();

/// Of every textureInfo of a material: members whose names end in "Texture".
std::span<const GltfRule> gltfTextureRules();

}  // namespace vlx::render
