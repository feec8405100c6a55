#include "render/gltf/gltf_extensions.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace vlx::render {
namespace {

constexpr std::array kSupported = std::to_array<std::string_view>(
    {"KHR_lights_punctual", "KHR_texture_transform", "KHR_mesh_quantization", "KHR_materials_ior",
     "KHR_materials_specular", "KHR_materials_emissive_strength", "KHR_materials_clearcoat",
     "KHR_materials_transmission", "KHR_materials_sheen", "KHR_materials_volume", "KHR_materials_unlit",
     "KHR_materials_pbrSpecularGlossiness", "KHR_materials_variants", "EXT_mesh_gpu_instancing",
     "EXT_texture_webp", "KHR_draco_mesh_compression", "EXT_meshopt_compression"});

constexpr std::string_view kToPng =
    "turn its textures into PNG, for example with `gltf-transform png IN OUT`";
struct Remedy {
    std::string_view extension;
    std::string_view text;
};
constexpr std::array kRemedies = std::to_array<Remedy>(
    {{"KHR_meshopt_compression", "decompress it, for example with `gltf-transform copy IN OUT`"},
     {"KHR_texture_basisu",
      "turn its textures into PNG, for example with `gltf-transform ktxdecompress IN OUT`"},
     {"EXT_texture_avif", kToPng},
     {"MSFT_texture_dds", kToPng}});

/// What is not simulated of extensions that are known.
constexpr std::array kMissing =
    std::to_array<Remedy>({{"KHR_materials_iridescence", "thin films do not shimmer"},
                           {"KHR_materials_anisotropy", "brushed reflections are round"},
                           {"KHR_materials_dispersion", "glass bends all colours alike"},
                           {"KHR_materials_diffuse_transmission", "no light shines through thin sheets"},
                           {"KHR_materials_volume_scatter", "light is not scattered inside"},
                           {"KHR_animation_pointer", "only nodes and morph targets are animated"},
                           {"KHR_node_visibility", "hidden nodes are shown"},
                           {"KHR_gaussian_splatting", "splats are left out"},
                           {"EXT_lights_image_based", "its light is missing; give an environment with --env"},
                           {"EXT_texture_avif", "textures have the image that they name beside it"},
                           {"KHR_texture_basisu", "textures have the image that they name beside it"},
                           {"MSFT_texture_dds", "textures have the image that they name beside it"},
                           {"MSFT_lod", "the finest level is shown"},
                           {"KHR_xmp", "nothing of the picture is missing"},
                           {"KHR_xmp_json_ld", "nothing of the picture is missing"}});

}  // namespace

std::string remedyFor(const std::string& extension) {
    const auto found = std::ranges::find(kRemedies, extension, &Remedy::extension);
    return found == kRemedies.end() ? "" : "; " + std::string(found->text);
}

std::string missingWithout(const std::string& extension) {
    const auto found = std::ranges::find(kMissing, extension, &Remedy::extension);
    return found == kMissing.end() ? "" : ": " + std::string(found->text);
}

bool isSupported(const std::string& extension) {
    return std::ranges::find(kSupported, extension) != kSupported.end();
}

}  // namespace vlx::render
