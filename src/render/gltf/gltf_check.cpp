#include "render/gltf/gltf_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "render/gltf/gltf_extensions.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx::render {
namespace {

using namespace nlohmann::literals;
using Json = nlohmann::json;

enum class Kind { Index, Count, Number, Numbers, String, Bool, Object };

/// What a place in the file must be, if it is there. Places are paths: [] stands for every element of an
/// array, {} for every member of an object.
struct Rule {
    std::string_view place;
    Kind kind;
    std::string_view of = {};  ///< Index: the array that it refers to
    std::size_t size = 0;      ///< Numbers
};

using enum Kind;
constexpr std::array kRules = std::to_array<Rule>({
    {"asset", Object},
    {"extensionsUsed[]", String},
    // The arrays that others refer to: references to what is no array would be called out of range.
    {"scenes[]", Object},
    {"nodes[]", Object},
    {"meshes[]", Object},
    {"materials[]", Object},
    {"textures[]", Object},
    {"images[]", Object},
    {"samplers[]", Object},
    {"cameras[]", Object},
    {"skins[]", Object},
    {"accessors[]", Object},
    {"bufferViews[]", Object},
    {"buffers[]", Object},
    {"animations[]", Object},
    {"extensions.KHR_lights_punctual.lights[]", Object},
    {"scene", Index, "scenes"},
    {"scenes[].nodes[]", Index, "nodes"},
    {"nodes[].name", String},
    {"nodes[].children[]", Index, "nodes"},
    {"nodes[].mesh", Index, "meshes"},
    {"nodes[].camera", Index, "cameras"},
    {"nodes[].skin", Index, "skins"},
    {"nodes[].matrix", Numbers, {}, 16},
    {"nodes[].translation", Numbers, {}, 3},
    {"nodes[].rotation", Numbers, {}, 4},
    {"nodes[].scale", Numbers, {}, 3},
    {"nodes[].weights[]", Number},
    {"nodes[].extensions.KHR_lights_punctual.light", Index, "extensions.KHR_lights_punctual.lights"},
    {"nodes[].extensions.EXT_mesh_gpu_instancing.attributes.{}", Index, "accessors"},
    {"extensions.KHR_materials_variants.variants[]", Object},
    {"extensions.KHR_materials_variants.variants[].name", String},
    {"extensions.KHR_lights_punctual.lights[].type", String},
    {"extensions.KHR_lights_punctual.lights[].intensity", Number},
    {"extensions.KHR_lights_punctual.lights[].range", Number},
    {"extensions.KHR_lights_punctual.lights[].color", Numbers, {}, 3},
    {"extensions.KHR_lights_punctual.lights[].spot.innerConeAngle", Number},
    {"extensions.KHR_lights_punctual.lights[].spot.outerConeAngle", Number},
    {"meshes[].name", String},
    {"meshes[].weights[]", Number},
    {"meshes[].primitives[].attributes.{}", Index, "accessors"},
    {"meshes[].primitives[].targets[].{}", Index, "accessors"},
    {"meshes[].primitives[].indices", Index, "accessors"},
    {"meshes[].primitives[].material", Index, "materials"},
    {"meshes[].primitives[].mode", Count},
    {"meshes[].primitives[].extensions.KHR_draco_mesh_compression.bufferView", Index, "bufferViews"},
    {"meshes[].primitives[].extensions.KHR_draco_mesh_compression.attributes.{}", Count},
    {"meshes[].primitives[].extensions.KHR_materials_variants.mappings[].material", Index, "materials"},
    {"meshes[].primitives[].extensions.KHR_materials_variants.mappings[].variants[]", Index,
     "extensions.KHR_materials_variants.variants"},
    {"accessors[].bufferView", Index, "bufferViews"},
    {"accessors[].byteOffset", Count},
    {"accessors[].count", Count},
    {"accessors[].componentType", Count},
    {"accessors[].type", String},
    {"accessors[].normalized", Bool},
    {"accessors[].sparse.count", Count},
    {"accessors[].sparse.indices.bufferView", Index, "bufferViews"},
    {"accessors[].sparse.indices.byteOffset", Count},
    {"accessors[].sparse.indices.componentType", Count},
    {"accessors[].sparse.values.bufferView", Index, "bufferViews"},
    {"accessors[].sparse.values.byteOffset", Count},
    {"bufferViews[].buffer", Index, "buffers"},
    {"bufferViews[].byteOffset", Count},
    {"bufferViews[].byteLength", Count},
    {"bufferViews[].byteStride", Count},
    {"bufferViews[].extensions.EXT_meshopt_compression.buffer", Index, "buffers"},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteOffset", Count},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteLength", Count},
    {"bufferViews[].extensions.EXT_meshopt_compression.byteStride", Count},
    {"bufferViews[].extensions.EXT_meshopt_compression.count", Count},
    {"bufferViews[].extensions.EXT_meshopt_compression.mode", String},
    {"bufferViews[].extensions.EXT_meshopt_compression.filter", String},
    {"buffers[].extensions.EXT_meshopt_compression.fallback", Bool},
    {"buffers[].byteLength", Count},
    {"buffers[].uri", String},
    {"images[].uri", String},
    {"images[].mimeType", String},
    {"images[].bufferView", Index, "bufferViews"},
    {"samplers[].magFilter", Count},
    {"samplers[].minFilter", Count},
    {"samplers[].wrapS", Count},
    {"samplers[].wrapT", Count},
    {"textures[].source", Index, "images"},
    {"textures[].sampler", Index, "samplers"},
    {"textures[].extensions.{}.source", Index, "images"},
    {"materials[].name", String},
    {"materials[].alphaMode", String},
    {"materials[].alphaCutoff", Number},
    {"materials[].doubleSided", Bool},
    {"materials[].emissiveFactor", Numbers, {}, 3},
    {"materials[].pbrMetallicRoughness.baseColorFactor", Numbers, {}, 4},
    {"materials[].pbrMetallicRoughness.metallicFactor", Number},
    {"materials[].pbrMetallicRoughness.roughnessFactor", Number},
    {"materials[].extensions.KHR_materials_emissive_strength.emissiveStrength", Number},
    {"materials[].extensions.KHR_materials_ior.ior", Number},
    {"materials[].extensions.KHR_materials_specular.specularFactor", Number},
    {"materials[].extensions.KHR_materials_specular.specularColorFactor", Numbers, {}, 3},
    {"materials[].extensions.KHR_materials_transmission.transmissionFactor", Number},
    {"materials[].extensions.KHR_materials_clearcoat.clearcoatFactor", Number},
    {"materials[].extensions.KHR_materials_clearcoat.clearcoatRoughnessFactor", Number},
    {"materials[].extensions.KHR_materials_sheen.sheenColorFactor", Numbers, {}, 3},
    {"materials[].extensions.KHR_materials_sheen.sheenRoughnessFactor", Number},
    {"materials[].extensions.KHR_materials_volume.thicknessFactor", Number},
    {"materials[].extensions.KHR_materials_volume.attenuationDistance", Number},
    {"materials[].extensions.KHR_materials_volume.attenuationColor", Numbers, {}, 3},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.diffuseFactor", Numbers, {}, 4},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.specularFactor", Numbers, {}, 3},
    {"materials[].extensions.KHR_materials_pbrSpecularGlossiness.glossinessFactor", Number},
    {"cameras[].name", String},
    {"cameras[].type", String},
    {"cameras[].perspective.yfov", Number},
    {"cameras[].perspective.aspectRatio", Number},
    {"cameras[].perspective.znear", Number},
    {"cameras[].perspective.zfar", Number},
    {"cameras[].orthographic.xmag", Number},
    {"cameras[].orthographic.ymag", Number},
    {"skins[].joints[]", Index, "nodes"},
    {"skins[].skeleton", Index, "nodes"},
    {"skins[].inverseBindMatrices", Index, "accessors"},
    {"animations[].channels[].sampler", Count},
    {"animations[].channels[].target.node", Index, "nodes"},
    {"animations[].channels[].target.path", String},
    {"animations[].samplers[].input", Index, "accessors"},
    {"animations[].samplers[].output", Index, "accessors"},
    {"animations[].samplers[].interpolation", String},
});

/// Of every textureInfo of a material: members whose names end in "Texture".
constexpr std::array kTextureRules = std::to_array<Rule>({
    {"index", Index, "textures"},
    {"texCoord", Count},
    {"scale", Number},
    {"strength", Number},
    {"extensions.KHR_texture_transform.offset", Numbers, {}, 2},
    {"extensions.KHR_texture_transform.scale", Numbers, {}, 2},
    {"extensions.KHR_texture_transform.rotation", Number},
    {"extensions.KHR_texture_transform.texCoord", Count},
});

/// "mesh" of "meshes", "light" of "extensions.KHR_lights_punctual.lights".
std::string singular(std::string_view array) {
    std::string name(array.substr(array.rfind('.') + 1));
    name.resize(name.size() - (name == "meshes" ? 2 : 1));
    return name;
}

/// A value as it is in the file, cut where it is long.
std::string shown(const Json& value) {
    if (value.is_object()) return "an object";
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > 40) text = text.substr(0, 37) + "...";
    return text;
}

class Checker {
  public:
    Checker(const std::string& file, const Json& root) : file_(file), root_(root) {}

    void check() const {
        if (!root_.is_object()) throw Error(file_, "expected a JSON object, found " + shown(root_));
        checkRequired();
        for (const Rule& rule : kRules) check(root_, rule, rule.place, "");
        checkTextures();
        checkCompressed();
    }

  private:
    [[noreturn]] void fail(const std::string& where, const std::string& expected, const Json& found) const {
        throw Error(file_, where + ": expected " + expected + ", found " + shown(found));
    }

    void checkRequired() const {
        const auto required = root_.find("extensionsRequired");
        if (required == root_.end()) return;
        if (!required->is_array()) fail("extensionsRequired", "an array", *required);
        std::vector<std::string> missing;
        for (const Json& name : *required) {
            if (!name.is_string()) fail("extensionsRequired", "names", name);
            if (!isSupported(name.get<std::string>())) missing.push_back(name.get<std::string>());
        }
        if (missing.empty()) return;
        std::string remedies;
        for (const std::string& name : missing) {
            const std::string remedy = remedyFor(name);
            if (remedies.find(remedy) == std::string::npos) remedies += remedy;
        }
        throw Error(file_,
                    std::string("requires the extension") + (missing.size() > 1 ? "s " : " ") +
                        listed(missing) +
                        (missing.size() > 1 ? ", which are not supported" : ", which is not supported") +
                        (remedies.empty() ? "; export it without" : remedies));
    }

    /// `rest` of a rule's place, from `value` on, which is at `where`.
    void check(const Json& value, const Rule& rule, std::string_view rest, const std::string& where) const {
        if (rest.empty()) return checkValue(value, rule, where);
        if (rest.starts_with("[]")) {
            if (!value.is_array()) fail(where, "an array", value);
            rest.remove_prefix(rest.starts_with("[].") ? 3 : 2);
            for (std::size_t i = 0; i < value.size(); ++i)
                check(value[i], rule, rest, where + "[" + std::to_string(i) + "]");
            return;
        }
        if (!value.is_object()) fail(where, "an object", value);
        const std::size_t end = std::min(rest.find('.'), rest.find('['));
        const std::string name(rest.substr(0, end));
        rest.remove_prefix(std::min(rest.size(), name.size()));
        if (rest.starts_with('.')) rest.remove_prefix(1);
        const std::string prefix = where.empty() ? "" : where + ".";
        if (name == "{}") {
            for (const auto& [member, inner] : value.items()) check(inner, rule, rest, prefix + member);
            return;
        }
        const auto member = value.find(name);
        if (member != value.end()) check(*member, rule, rest, prefix + name);
    }

    void checkValue(const Json& value, const Rule& rule, const std::string& where) const {
        switch (rule.kind) {
            case Index:
                return checkIndex(value, rule.of, where);
            case Count:
                if (!value.is_number_unsigned()) fail(where, "a whole number of 0 or more", value);
                return;
            case Number:
                if (!value.is_number()) fail(where, "a number", value);
                return;
            case Numbers:
                if (!value.is_array() || value.size() != rule.size ||
                    !std::ranges::all_of(value, [](const Json& v) { return v.is_number(); }))
                    fail(where, std::to_string(rule.size) + " numbers", value);
                return;
            case String:
                if (!value.is_string()) fail(where, "a string", value);
                return;
            case Bool:
                if (!value.is_boolean()) fail(where, "true or false", value);
                return;
            case Object:
                if (!value.is_object()) fail(where, "an object", value);
        }
    }

    void checkIndex(const Json& value, std::string_view array, const std::string& where) const {
        const std::string noun = singular(array);
        const bool vowel = noun[0] == 'a' || noun[0] == 'i';
        if (!value.is_number_unsigned())
            fail(where, (vowel ? "the number of an " : "the number of a ") + noun + ", 0 or more", value);
        std::string pointer = "/" + std::string(array);
        std::ranges::replace(pointer, '.', '/');
        const Json::json_pointer place(pointer);
        const std::size_t there =
            root_.contains(place) && root_.at(place).is_array() ? root_.at(place).size() : 0;
        if (value.get<std::uint64_t>() >= there)
            throw Error(file_, where + " refers to " + noun + " " +
                                   std::to_string(value.get<std::uint64_t>()) + ", the file has " +
                                   std::to_string(there));
    }

    void checkTextures() const {
        const auto materials = root_.find("materials");
        if (materials == root_.end()) return;
        for (std::size_t i = 0; i < materials->size(); ++i)
            checkTexturesIn((*materials)[i], "materials[" + std::to_string(i) + "]");
    }

    void checkTexturesIn(const Json& object, const std::string& where) const {
        if (!object.is_object()) fail(where, "an object", object);
        for (const auto& [name, member] : object.items()) {
            const std::string place = where + "." + name;
            if (name.ends_with("Texture")) {
                if (!member.is_object()) fail(place, "an object", member);
                if (!member.contains("index")) fail(place, "the index of a texture", member);
                for (const Rule& rule : kTextureRules) check(member, rule, rule.place, place);
            } else if (name == "pbrMetallicRoughness") {
                checkTexturesIn(member, place);
            } else if (name == "extensions") {
                if (!member.is_object()) fail(place, "an object", member);
                for (const auto& [extension, inner] : member.items())
                    if (isSupported(extension)) checkTexturesIn(inner, place + "." + extension);
            }
        }
    }

    /// Compressed data whose plain form is left out, though nothing requires the extension.
    void checkCompressed() const {
        const auto each = [&](const char* array, const auto& visit) {
            if (const auto found = root_.find(array); found != root_.end())
                for (std::size_t i = 0; i < found->size(); ++i)
                    visit((*found)[i], std::string(array) + "[" + std::to_string(i) + "]");
        };
        each("buffers", [&](const Json& buffer, const std::string& where) {
            const std::string extension = "KHR_meshopt_compression";
            if (buffer.contains("extensions") && buffer["extensions"].contains(extension) &&
                !buffer.contains("uri"))
                throw Error(file_, where + " has data only in the extension " + extension +
                                       ", which is not supported" + remedyFor(extension));
        });
    }

    const std::string& file_;
    const Json& root_;
};

}  // namespace

std::vector<bool> checkGltf(const std::string& file, const std::string& text) {
    try {
        const Json root = Json::parse(text);
        Checker(file, root).check();
        std::vector<bool> zeroAspects;
        for (const Json& camera : root.value("cameras", Json::array()))
            zeroAspects.push_back(camera.value("/perspective/aspectRatio"_json_pointer, 1.0) == 0);
        return zeroAspects;
    } catch (const Json::parse_error& e) {
        throw Error(file, "expected a glTF file, found no JSON at byte " + std::to_string(e.byte));
    } catch (const Json::out_of_range& e) {
        throw Error(file, std::string("expected numbers that fit into 64 bits: ") + e.what());
    }
}

}  // namespace vlx::render
