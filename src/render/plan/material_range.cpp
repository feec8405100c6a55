#include "render/plan/material_range.h"

#include <map>

namespace vlx::render {
namespace {

struct Interval {
    float least = 0;
    float most = 0;
    Interval operator*(float s) const { return {least * s, most * s}; }
};

bool smooth(float roughness) { return square(roughness) < kSmoothAlpha; }

class RangeReader {
  public:
    explicit RangeReader(const Scene& scene) : scene_(scene) {}

    MaterialRange read(const Material& m) {
        MaterialRange r;
        const Interval roughness = green(m.metallicRoughnessTexture) * m.roughness;
        const Interval metallic = blue(m.metallicRoughnessTexture) * m.metallic;
        const Interval transmission = red(m.transmissionTexture) * m.transmission;
        const float specular = alpha(m.specularTexture).most * m.specular;
        const float coat = red(m.clearcoatTexture).most * m.clearcoat;
        const Interval coatRoughness = green(m.clearcoatRoughnessTexture) * m.clearcoatRoughness;
        const bool dielectric = metallic.least < 1;
        const bool glass = transmission.most > 0 && dielectric;

        r.diffuse =
            dielectric && transmission.least < 1 && !isBlack(m.baseColour * brightest(m.baseColourTexture));
        const bool reflects = metallic.most > 0 || (dielectric && specular > 0);
        r.glossy = (reflects && !smooth(roughness.most)) || (coat > 0 && !smooth(coatRoughness.most));
        r.mirror = (reflects && smooth(roughness.least)) || (coat > 0 && smooth(coatRoughness.least));
        const bool bends = std::abs(m.ior - 1) >= 1e-3f;
        r.transmission = glass && (smooth(roughness.least) || !bends);
        r.roughTransmission = glass && !smooth(roughness.most) && bends;
        r.absorption = glass && !isBlack(m.absorption);
        r.clearcoat = coat > 0;
        r.sheen = !isBlack(m.sheenColour * brightest(m.sheenColourTexture));
        r.normalMapped = m.normalTexture && m.normalScale != 0;
        const float opacity = alpha(m.baseColourTexture).least * m.opacity;
        r.seeThrough = (m.alphaMode == AlphaMode::Blend && opacity < 1) ||
                       (m.alphaMode == AlphaMode::Mask && opacity < m.alphaCutoff);
        return r;
    }

  private:
    struct Texels {
        Rgba least, most;
    };
    const Texels& of(const TextureRef& ref) {
        const auto found = texels_.find(ref.texture);
        if (found != texels_.end()) return found->second;
        const auto [least, most] = scene_.textures[static_cast<std::size_t>(ref.texture)].range();
        return texels_[ref.texture] = {least, most};
    }
    template <class Get>
    Interval interval(const TextureRef& ref, Get get) {
        if (!ref) return {1, 1};
        const Texels& t = of(ref);
        return {get(t.least), get(t.most)};
    }
    Interval red(const TextureRef& r) {
        return interval(r, [](const Rgba& c) { return c.rgb.x; });
    }
    Interval green(const TextureRef& r) {
        return interval(r, [](const Rgba& c) { return c.rgb.y; });
    }
    Interval blue(const TextureRef& r) {
        return interval(r, [](const Rgba& c) { return c.rgb.z; });
    }
    Interval alpha(const TextureRef& r) {
        return interval(r, [](const Rgba& c) { return c.a; });
    }
    Rgb brightest(const TextureRef& r) { return r ? of(r).most.rgb : Rgb{1, 1, 1}; }

    const Scene& scene_;
    std::map<int, Texels> texels_;
};

}  // namespace

MaterialRanges::MaterialRanges(const Scene& scene) {
    RangeReader reader(scene);
    for (const Material& material : scene.materials) ranges_.push_back(reader.read(material));
    // Vertex colours make surfaces see-through too.
    for (const Shape& shape : scene.shapes) {
        if (shape.firstColour < 0 || scene.materials[shape.material].alphaMode == AlphaMode::Opaque) continue;
        for (std::uint32_t i = 0; i < shape.vertices; ++i)
            if (scene.colours[static_cast<std::size_t>(shape.firstColour) + i].a < 1)
                ranges_[shape.material].seeThrough = true;
    }
}

}  // namespace vlx::render
