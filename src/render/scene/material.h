#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/math/vec.h"
#include "render/scene/texture.h"

namespace vlx::render {

enum class AlphaMode : std::uint8_t { Opaque, Mask, Blend };

/// A glTF material: metallic-roughness with the extensions transmission, ior, specular, clearcoat,
/// emissive_strength, sheen, unlit, and volume's absorption. Textures multiply the factors, as the
/// specifications say.
struct Material {
    std::string name;

    Rgb baseColour{1, 1, 1};
    float opacity = 1;             ///< baseColorFactor's alpha
    TextureRef baseColourTexture;  ///< rgb: colour, a: opacity
    float metallic = 1;
    float roughness = 1;                  ///< perceptual; GGX alpha is its square
    TextureRef metallicRoughnessTexture;  ///< g: roughness, b: metallic
    Rgb emission{0, 0, 0};                ///< radiance: emissiveFactor x emissiveStrength
    TextureRef emissionTexture;
    bool retro = false;  ///< diffuse light as in Disney's model (bsdf_model.h)
    float normalScale = 1;
    TextureRef normalTexture;

    float transmission = 0;
    TextureRef transmissionTexture;  ///< r
    float ior = 1.5f;
    float specular = 1;
    TextureRef specularTexture;  ///< a
    Rgb specularColour{1, 1, 1};
    TextureRef specularColourTexture;
    float clearcoat = 0;
    TextureRef clearcoatTexture;  ///< r
    float clearcoatRoughness = 0;
    TextureRef clearcoatRoughnessTexture;  ///< g

    Rgb sheenColour{0, 0, 0};
    TextureRef sheenColourTexture;
    float sheenRoughness = 0;
    TextureRef sheenRoughnessTexture;  ///< a
    /// Absorption coefficient inside a transmissive solid, 1/m: light keeps exp(-absorption x distance).
    Rgb absorption{0, 0, 0};

    AlphaMode alphaMode = AlphaMode::Opaque;
    float alphaCutoff = 0.5f;
    bool doubleSided = false;

    /// KHR_materials_unlit: its colour, kept in `emission` (all else is black), is seen by the camera and in
    /// what is smooth, and lights nothing.
    bool unlit = false;

    std::vector<int> furtherUvSets;  ///< the numbers of those that its textures use, besides 0

    int albedoTable = 0;  ///< index into the scene's tables
    /// Index into the scene's glass tables, -1 when not rough transmissive.
    int glassTable = -1;

    /// Whether anything is to be looked up at a point; set by completeScene.
    bool textured = false;

    bool emissive() const { return !isBlack(emission); }
    bool shines() const { return emissive() && !unlit; }  ///< on others, too
    bool absorbs() const { return transmissive() && !isBlack(absorption); }
    bool transmissive() const { return transmission > 0 && metallic < 1; }
    /// Seen from behind: double-sided, or a boundary of a solid that light crosses.
    bool visibleFromBehind() const { return doubleSided || transmissive(); }
};

}  // namespace vlx::render
