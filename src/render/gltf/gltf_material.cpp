#include "render/gltf/gltf_material.h"

#include <algorithm>

#include "render/gltf/gltf_extensions.h"

namespace vlx::render {
namespace {

constexpr double kMostIor = 1000;

float unit(double v) { return static_cast<float>(std::clamp(std::isnan(v) ? 0.0 : v, 0.0, 1.0)); }

/// Three numbers in [0, 1].
Rgb unitColour(const std::vector<double>& v) {
    return v.size() < 3 ? Rgb(1) : Rgb{unit(v[0]), unit(v[1]), unit(v[2])};
}

/// Three numbers >= 0.
Rgb colour(const std::vector<double>& v, const Rgb& fallback) {
    if (v.size() < 3) return fallback;
    const auto at = [&](std::size_t i) {
        return static_cast<float>(std::isfinite(v[i]) ? std::clamp(v[i], 0.0, 1e30) : 0.0);
    };
    return {at(0), at(1), at(2)};
}

std::vector<double> numbers(const tinygltf::Value& object, const std::string& key) {
    std::vector<double> out;
    if (!object.Has(key) || !object.Get(key).IsArray()) return out;
    const tinygltf::Value& array = object.Get(key);
    for (std::size_t i = 0; i < array.ArrayLen(); ++i) {
        const tinygltf::Value& v = array.Get(static_cast<int>(i));
        out.push_back(v.IsNumber() ? v.GetNumberAsDouble() : 0);
    }
    return out;
}

/// KHR_materials_volume: light keeps attenuationColor after attenuationDistance. A thickness of 0 says that
/// the surface bounds no volume; where none is given, rays know it.
Rgb absorption(const tinygltf::Value& volume) {
    const double distance = number(volume, "attenuationDistance", 0);
    if (!(distance > 0) || !std::isfinite(distance) || number(volume, "thicknessFactor", 1) == 0) return {};
    const Rgb kept = colour(numbers(volume, "attenuationColor"), {1, 1, 1});
    const auto coefficient = [&](float c) {
        const double least = -std::log(std::clamp(static_cast<double>(c), 1e-9, 1.0)) / distance;
        return static_cast<float>(std::min(least, 1e9));
    };
    return {coefficient(kept.x), coefficient(kept.y), coefficient(kept.z)};
}

/// The number of a set of coordinates; no file has as many as the greatest.
int setIn(const tinygltf::Value& object, int fallback) {
    return static_cast<int>(std::min(number(object, "texCoord", fallback), 1e9));
}

Wrap wrapOf(int mode) {
    if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::Clamp;
    if (mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT) return Wrap::Mirror;
    return Wrap::Repeat;
}

/// KHR_texture_transform: first scale, then rotation (counter-clockwise seen in the image), then offset.
void applyTransform(TextureRef& ref, const tinygltf::Value& transform) {
    const std::vector<double> offset = numbers(transform, "offset"), scale = numbers(transform, "scale");
    const double angle = number(transform, "rotation", 0);
    const double sx = scale.size() == 2 ? scale[0] : 1, sy = scale.size() == 2 ? scale[1] : 1;
    const double c = std::cos(angle), s = std::sin(angle);
    ref.transformed = true;
    ref.rowU = {static_cast<float>(c * sx), static_cast<float>(s * sy)};
    ref.rowV = {static_cast<float>(-s * sx), static_cast<float>(c * sy)};
    if (offset.size() == 2) ref.offset = {static_cast<float>(offset[0]), static_cast<float>(offset[1])};
}

}  // namespace

/// The image and the sampler of a texture.
Texture MaterialReader::load(const tinygltf::Texture& source, int index, ColourSpace space,
                             const std::string& what, std::optional<float> glossiness) const {
    const auto& samplers = file_.model().samplers;
    int image = source.source;
    if (const tinygltf::Value* webp = extension(source.extensions, "EXT_texture_webp"))
        image = static_cast<int>(number(*webp, "source", image));
    if (image < 0) {
        std::string only;
        for (const auto& [name, value] : source.extensions)
            if (!isSupported(name)) only += ", only one of " + name + remedyFor(name);
        file_.fail(what + " uses texture " + std::to_string(index) + ", which has no source" + only);
    }
    Texture loaded = file_.image(image, space, glossiness);
    if (source.sampler >= 0 && static_cast<std::size_t>(source.sampler) < samplers.size()) {
        const tinygltf::Sampler& sampler = samplers[static_cast<std::size_t>(source.sampler)];
        loaded.wrapU = wrapOf(sampler.wrapS);
        loaded.wrapV = wrapOf(sampler.wrapT);
        loaded.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    return loaded;
}

TextureRef MaterialReader::texture(int index, int uvSet, const tinygltf::ExtensionMap& extensions,
                                   ColourSpace space, const std::string& what) {
    if (index < 0) return {};
    const tinygltf::Model& model = file_.model();
    if (static_cast<std::size_t>(index) >= model.textures.size())
        file_.fail(what + " refers to texture " + std::to_string(index) + ", the file has " +
                   std::to_string(model.textures.size()));
    TextureRef ref;
    if (const tinygltf::Value* transform = extension(extensions, "KHR_texture_transform")) {
        applyTransform(ref, *transform);
        uvSet = setIn(*transform, uvSet);
    }
    ref.uvSlot = slotOf(uvSet);
    const auto key = std::pair(index, space);
    const auto known = loaded_.find(key);
    if (known != loaded_.end()) {
        ref.texture = known->second;
        return ref;
    }
    Texture loaded = load(model.textures[static_cast<std::size_t>(index)], index, space, what);
    ref.texture = static_cast<int>(textures_.size());
    textures_.push_back(std::move(loaded));
    loaded_[key] = ref.texture;
    return ref;
}

int MaterialReader::slotOf(int uvSet) {
    if (uvSet <= 0) return 0;
    auto& sets = furtherUvSets_;
    const auto found = std::ranges::find(sets, uvSet);
    const auto slot = static_cast<int>(found - sets.begin()) + 1;
    if (found == sets.end()) sets.push_back(uvSet);
    return slot;
}

/// Of all a material says only the base colour matters.
void MaterialReader::readUnlit(Material& m) const {
    m.unlit = true;
    m.emission = m.baseColour;
    m.emissionTexture = m.baseColourTexture;
    m.baseColour = {};
    if (m.alphaMode == AlphaMode::Opaque) m.baseColourTexture = {};
    m.metallic = m.specular = 0;
    m.roughness = 1;
}

/// KHR_materials_pbrSpecularGlossiness: a dielectric whose reflection is of a colour, by way of
/// KHR_materials_specular. What a texture of that colour takes off the diffuse part is left out.
void MaterialReader::readGlossiness(Material& m, const tinygltf::Value& source, const std::string& what) {
    constexpr float kReflected = 0.04f;  // at index 1.5
    const std::vector<double> diffuse = numbers(source, "diffuseFactor");
    const Rgb reflected = unitColour(numbers(source, "specularFactor"));
    const float glossiness = unit(number(source, "glossinessFactor", 1));
    m.baseColour = unitColour(diffuse);
    m.opacity = diffuse.size() == 4 ? unit(diffuse[3]) : 1;
    m.baseColourTexture = texture(source, "diffuseTexture", ColourSpace::Srgb, what);
    m.metallic = 0;
    m.specularColour = reflected / kReflected;
    m.specularColourTexture = texture(source, "specularGlossinessTexture", ColourSpace::Srgb, what);
    if (TextureRef& ref = m.metallicRoughnessTexture = m.specularColourTexture; ref) {
        const auto index = static_cast<int>(number(source.Get("specularGlossinessTexture"), "index", -1));
        ref.texture = static_cast<int>(textures_.size());
        textures_.push_back(load(file_.model().textures[static_cast<std::size_t>(index)], index,
                                 ColourSpace::Linear, what, glossiness));
        m.roughness = 1;
    } else {
        m.roughness = 1 - glossiness;
        m.baseColour *= 1 - std::min(1.f, maxComponent(reflected));
    }
}

/// A textureInfo inside an extension.
TextureRef MaterialReader::texture(const tinygltf::Value& object, const std::string& key, ColourSpace space,
                                   const std::string& what) {
    if (!object.Has(key) || !object.Get(key).IsObject()) return {};
    const tinygltf::Value& info = object.Get(key);
    tinygltf::ExtensionMap extensions;
    if (info.Has("extensions") && info.Get("extensions").IsObject())
        extensions = info.Get("extensions").Get<tinygltf::Value::Object>();
    return texture(static_cast<int>(number(info, "index", -1)), setIn(info, 0), extensions, space,
                   what + " " + key);
}

Material MaterialReader::read(const tinygltf::Material& source, std::size_t index) {
    using enum ColourSpace;
    const std::string what = described("material", index, source.name);
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    const auto plain = [&](const auto& info, ColourSpace space, const char* name) {
        return texture(info.index, info.texCoord, info.extensions, space, what + " " + name);
    };
    furtherUvSets_.clear();
    Material m;
    m.name = source.name;
    m.baseColour = unitColour(pbr.baseColorFactor);
    if (pbr.baseColorFactor.size() == 4) m.opacity = unit(pbr.baseColorFactor[3]);
    m.baseColourTexture = plain(pbr.baseColorTexture, Srgb, "baseColorTexture");
    m.doubleSided = source.doubleSided;
    m.alphaMode = source.alphaMode == "MASK"    ? AlphaMode::Mask
                  : source.alphaMode == "BLEND" ? AlphaMode::Blend
                                                : AlphaMode::Opaque;
    m.alphaCutoff = static_cast<float>(source.alphaCutoff);
    if (source.extensions.contains("KHR_materials_unlit")) {
        readUnlit(m);
        m.furtherUvSets = furtherUvSets_;
        return m;
    }
    m.metallic = unit(pbr.metallicFactor);
    m.roughness = unit(pbr.roughnessFactor);
    m.metallicRoughnessTexture = plain(pbr.metallicRoughnessTexture, Linear, "metallicRoughnessTexture");
    m.emission = colour(source.emissiveFactor, {0, 0, 0});
    m.emissionTexture = plain(source.emissiveTexture, Srgb, "emissiveTexture");
    m.normalTexture = plain(source.normalTexture, Linear, "normalTexture");
    m.normalScale = static_cast<float>(source.normalTexture.scale);
    m.retro = retro_;

    if (const auto* e = extension(source.extensions, "KHR_materials_pbrSpecularGlossiness"))
        readGlossiness(m, *e, what);
    if (const auto* e = extension(source.extensions, "KHR_materials_emissive_strength"))
        m.emission *= static_cast<float>(std::clamp(number(*e, "emissiveStrength", 1), 0.0, 1e30));
    if (const auto* e = extension(source.extensions, "KHR_materials_ior")) {
        double ior = number(*e, "ior", 1.5);
        if (ior == 0) ior = kMostIor;  // the specification's "reflects everything"
        if (!(ior >= 1 && ior <= kMostIor))
            file_.fail(what + " has ior " + std::to_string(ior) + ", expected 1 to 1000 (or 0)");
        m.ior = static_cast<float>(ior);
    }
    if (const auto* e = extension(source.extensions, "KHR_materials_specular")) {
        m.specular = unit(number(*e, "specularFactor", 1));
        m.specularTexture = texture(*e, "specularTexture", Linear, what);
        m.specularColour = colour(numbers(*e, "specularColorFactor"), {1, 1, 1});
        m.specularColourTexture = texture(*e, "specularColorTexture", Srgb, what);
        // A Specular of 0 reflects nothing in that Blender, at grazing angles neither.
        if (retro_ && isBlack(m.specularColour)) m.specular = 0;
    }
    if (const auto* e = extension(source.extensions, "KHR_materials_transmission")) {
        m.transmission = unit(number(*e, "transmissionFactor", 0));
        m.transmissionTexture = texture(*e, "transmissionTexture", Linear, what);
    }
    if (const auto* e = extension(source.extensions, "KHR_materials_clearcoat")) {
        m.clearcoat = unit(number(*e, "clearcoatFactor", 0));
        m.clearcoatTexture = texture(*e, "clearcoatTexture", Linear, what);
        m.clearcoatRoughness = unit(number(*e, "clearcoatRoughnessFactor", 0));
        m.clearcoatRoughnessTexture = texture(*e, "clearcoatRoughnessTexture", Linear, what);
    }
    if (const auto* e = extension(source.extensions, "KHR_materials_sheen")) {
        m.sheenColour = colour(numbers(*e, "sheenColorFactor"), {0, 0, 0});
        m.sheenColour = {unit(m.sheenColour.x), unit(m.sheenColour.y), unit(m.sheenColour.z)};
        m.sheenColourTexture = texture(*e, "sheenColorTexture", Srgb, what);
        m.sheenRoughness = unit(number(*e, "sheenRoughnessFactor", 0));
        m.sheenRoughnessTexture = texture(*e, "sheenRoughnessTexture", Linear, what);
    }
    if (const auto* e = extension(source.extensions, "KHR_materials_volume")) m.absorption = absorption(*e);
    m.furtherUvSets = furtherUvSets_;
    return m;
}

}  // namespace vlx::render
