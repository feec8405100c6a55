#include "render/scene/scene.h"

#include <algorithm>

#include "render/plan/effect_counters.h"
#include "render/surface/surface.h"

namespace vlx::render {
namespace {

/// The three entries of an optional vertex array.
template <class T>
std::array<const T*, 3> corners(const std::vector<T>& array, std::int64_t first, const Shape& shape,
                                const std::array<std::uint32_t, 3>& corner) {
    const T* base = array.data() + first;
    return {base + (corner[0] - shape.firstVertex), base + (corner[1] - shape.firstVertex),
            base + (corner[2] - shape.firstVertex)};
}

}  // namespace

std::uint64_t Scene::triangleCount() const {
    std::uint64_t count = 0;
    for (std::uint32_t i = 0; i < worldShapes; ++i) count += shapes[i].triangles;
    for (const Instance& instance : instances) {
        const Group& group = groups[instance.group];
        for (std::uint32_t i = 0; i < group.shapes; ++i) count += shapes[group.firstShape + i].triangles;
    }
    return count;
}

std::span<const Vertex> verticesOf(const Scene& scene, const Shape& shape) {
    const std::uint32_t steps =
        shape.deformation < 0 ? 1 : scene.deformations[static_cast<std::size_t>(shape.deformation)].steps;
    return std::span(scene.vertices).subspan(shape.firstVertex, std::size_t{steps} * shape.vertices);
}

Between blocksAt(const Shape& shape, std::uint32_t first, std::uint32_t steps, float time) {
    const float position = std::clamp(time, 0.f, 1.f) * static_cast<float>(steps - 1);
    const std::uint32_t before = std::min(static_cast<std::uint32_t>(position), steps - 1);
    const std::uint32_t after = std::min(before + 1, steps - 1);
    return {(first + before) * shape.vertices, (first + after) * shape.vertices,
            position - static_cast<float>(before)};
}

Rgba vertexColourAt(const Scene& scene, const Shape& shape, const std::array<std::uint32_t, 3>& corner,
                    float u, float v) {
    const auto c = corners(scene.colours, shape.firstColour, shape, corner);
    return {interpolated(c[0]->rgb, c[1]->rgb, c[2]->rgb, u, v),
            interpolated(c[0]->a, c[1]->a, c[2]->a, u, v)};
}

TextureCoordinates textureCoordinates(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u,
                                      float v) {
    const auto& corner = scene.triangles[triangle];
    TextureCoordinates uv;
    uv.first = interpolated(scene.vertices[corner[0]].uv, scene.vertices[corner[1]].uv,
                            scene.vertices[corner[2]].uv, u, v);
    if (shape.firstFurtherUv >= 0) {
        uv.further = corners(scene.furtherUvs, shape.firstFurtherUv, shape, corner);
        uv.stride = shape.vertices;
        uv.u = u;
        uv.v = v;
    }
    return uv;
}

float opacityAt(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u, float v) {
    const Material& material = scene.materials[shape.material];
    if (material.alphaMode == AlphaMode::Opaque) return 1;
    countEffect(Effect::Alpha);
    float opacity = material.opacity;
    if (material.baseColourTexture) {
        const TextureCoordinates uv = textureCoordinates(scene, shape, triangle, u, v);
        opacity *= scene.textures[static_cast<std::size_t>(material.baseColourTexture.texture)]
                       .lookup(uv.of(material.baseColourTexture))
                       .a;
    }
    if (shape.firstColour >= 0) opacity *= vertexColourAt(scene, shape, scene.triangles[triangle], u, v).a;
    if (material.alphaMode == AlphaMode::Mask) return opacity >= material.alphaCutoff ? 1 : 0;
    return opacity;
}

Rgb emittedRadiance(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u, float v,
                    float cosTheta) {
    const Material& material = scene.materials[shape.material];
    if (!material.unlit) countEffect(Effect::EmissiveMeshes);
    Rgb emission = material.emission;
    if (material.emissionTexture) {
        countEffect(Effect::Textures);
        const TextureCoordinates uv = textureCoordinates(scene, shape, triangle, u, v);
        emission *= scene.textures[static_cast<std::size_t>(material.emissionTexture.texture)]
                        .lookup(uv.of(material.emissionTexture))
                        .rgb;
    }
    if (material.unlit) {
        countEffect(Effect::Unlit);
        if (shape.firstColour >= 0)
            emission *= vertexColourAt(scene, shape, scene.triangles[triangle], u, v).rgb;
    }
    if (material.clearcoat > 0) emission *= 1 - material.clearcoat * dielectricFresnel(cosTheta, 1.5f);
    return emission;
}

Vec3 mappedNormal(const Scene& scene, const Shape& shape, const Material& material,
                  const std::array<std::uint32_t, 3>& corner, float u, float v, const TextureCoordinates& uv,
                  const Vec3& normal, std::uint32_t block) {
    countEffect(Effect::NormalMaps);
    Vec3 tangent;
    float sign = 1;
    if (shape.firstTangent >= 0) {
        const auto t = corners(scene.tangents, shape.firstTangent + block, shape, corner);
        tangent = interpolated(t[0]->direction, t[1]->direction, t[2]->direction, u, v);
        sign = t[0]->sign;
    } else {
        const auto at = [&](std::size_t i) -> const Vertex& { return scene.vertices[corner[i] + block]; };
        std::array<Vec2, 3> st{at(0).uv, at(1).uv, at(2).uv};
        if (const int slot = material.normalTexture.uvSlot; slot > 0) {
            const auto s =
                corners(scene.furtherUvs, shape.firstFurtherUv + (slot - 1) * shape.vertices, shape, corner);
            st = {*s[0], *s[1], *s[2]};
        }
        const Vec2 d1 = st[1] - st[0], d2 = st[2] - st[0];
        const Vec3 e1 = at(1).position - at(0).position, e2 = at(2).position - at(0).position;
        const float det = d1.x * d2.y - d1.y * d2.x;
        tangent = (e1 * d2.y - e2 * d1.y) * (det < 0 ? -1.f : 1.f);
        sign = det < 0 ? 1.f : -1.f;  // v grows downwards in the image, the map's green upwards
    }
    tangent = tangent - normal * dot(normal, tangent);
    const float norm = length(tangent);
    if (!(norm > 1e-12f)) return normal;
    tangent = tangent / norm;
    const Rgb encoded = scene.textures[static_cast<std::size_t>(material.normalTexture.texture)]
                            .lookup(uv.of(material.normalTexture))
                            .rgb;
    const Vec3 local{(2 * encoded.x - 1) * material.normalScale, (2 * encoded.y - 1) * material.normalScale,
                     2 * encoded.z - 1};
    const Vec3 mapped = tangent * local.x + cross(normal, tangent) * (sign * local.y) + normal * local.z;
    const float mappedNorm = length(mapped);
    return mappedNorm > 1e-6f ? mapped / mappedNorm : normal;
}

SurfacePoint seenFrom(SurfacePoint point, const Vec3& toViewer) {
    const Vec3 front = point.fromBehind ? -point.geometricNormal : point.geometricNormal;
    point.fromBehind = dot(front, toViewer) < 0;
    point.geometricNormal = point.fromBehind ? -front : front;
    point.shadingNormal = facing(point.fromBehind ? -point.frontNormal : point.frontNormal, toViewer);
    return point;
}

SurfacePoint surfaceAt(const Scene& scene, const Hit& hit, const Vec3& rayDirection, float time) {
    return surfacePoint<kEveryFeature>(scene, hit, rayDirection, time);
}

SurfaceParameters plainParameters(const Scene& scene, const Material& m) {
    SurfaceParameters s;
    s.baseColour = m.baseColour;
    s.metallic = m.metallic;
    s.roughness = m.roughness;
    s.retro = m.retro;
    s.transmission = m.transmission;
    s.ior = m.ior;
    s.specular = m.specular;
    s.specularColour = m.specularColour;
    s.clearcoat = m.clearcoat;
    s.clearcoatRoughness = m.clearcoatRoughness;
    s.sheenColour = m.sheenColour;
    s.sheenRoughness = m.sheenRoughness;
    if (!isBlack(m.sheenColour)) s.sheenTable = {scene.sheenTables.data()};
    s.albedoTable = &scene.albedoTables[static_cast<std::size_t>(m.albedoTable)];
    if (m.glassTable >= 0) s.glassTable = {&scene.glassTables[static_cast<std::size_t>(m.glassTable)]};
    return s;
}

SurfaceParameters surfaceParameters(const Scene& scene, const SurfacePoint& point) {
    return parametersAt<kEveryFeature>(scene, point, plainParameters(scene, *point.material));
}

}  // namespace vlx::render
