#pragma once

#include "render/plan/effect_counters.h"
#include "render/plan/kernel_features.h"
#include "render/scene/accelerator.h"
#include "render/scene/scene.h"

/// What a path finds at a surface, compiled for what the scene calls for: scene.h has the same for any scene.
namespace vlx::render {

/// Linear interpolation over a triangle.
template <class T>
T interpolated(const T& a, const T& b, const T& c, float u, float v) {
    return a * (1 - u - v) + b * u + c * v;
}

/// The vertex colour at a point of a triangle of a shape that has them.
Rgba vertexColourAt(const Scene& scene, const Shape& shape, const std::array<std::uint32_t, 3>& corner,
                    float u, float v);

/// The normal of the material's normal map in the frame of `normal`. The tangent is the vertices' own or,
/// without one, the direction in which u grows over the triangle; `block`: of a deforming shape, as in
/// Between.
Vec3 mappedNormal(const Scene& scene, const Shape& shape, const Material& material,
                  const std::array<std::uint32_t, 3>& corner, float u, float v, const TextureCoordinates& uv,
                  const Vec3& normal, std::uint32_t block);

/// A corner of a shape that deforms at a moment.
inline Vertex cornerAt(const Scene& scene, std::uint32_t corner, const Between& moment) {
    const Vertex& a = scene.vertices[corner + moment.before];
    const Vertex& b = scene.vertices[corner + moment.after];
    const float w = 1 - moment.part;
    return {a.position * w + b.position * moment.part, a.normal * w + b.normal * moment.part, a.uv};
}

/// A shading normal turned just so far towards the viewer that it faces him: interpolated and mapped normals
/// may not.
inline Vec3 facing(const Vec3& normal, const Vec3& toViewer) {
    constexpr float kLeast = 1e-3f;
    const float cosine = dot(normal, toViewer);
    return cosine >= kLeast ? normal : normalized(normal + toViewer * (kLeast - cosine));
}

/// What a ray found. `time`: of the ray.
template <Features F>
SurfacePoint surfacePoint(const Scene& scene, const Hit& hit, const Vec3& rayDirection, float time) {
    const Shape& shape = scene.shapes[hit.shape];
    SurfacePoint p;
    p.shape = &shape;
    p.material = &scene.materials[shape.material];
    p.triangle = shape.firstTriangle + hit.triangle;
    const auto& corner = scene.triangles[p.triangle];
    std::array<const Vertex*, 3> vertex;
    for (std::size_t i = 0; i < 3; ++i) vertex[i] = &scene.vertices[corner[i]];
    [[maybe_unused]] std::array<Vertex, 3> moved;
    std::uint32_t block = 0;
    if constexpr (F.rare) {
        const std::uint32_t steps =
            shape.deformation < 0 ? 1 : scene.deformations[static_cast<std::size_t>(shape.deformation)].steps;
        if (steps > 1) {
            countEffect(Effect::ObjectMotion);
            const Between moment = blocksAt(shape, 0, steps, time);
            for (std::size_t i = 0; i < 3; ++i) {
                moved[i] = cornerAt(scene, corner[i], moment);
                vertex[i] = &moved[i];
            }
            block = moment.part < 0.5f ? moment.before : moment.after;
        }
    }
    const Vertex& a = *vertex[0];
    const Vertex& b = *vertex[1];
    const Vertex& c = *vertex[2];
    const float w = 1 - hit.u - hit.v;

    p.position = a.position * w + b.position * hit.u + c.position * hit.v;
    Vec3 geometric = cross(b.position - a.position, c.position - a.position);
    Vec3 shading = a.normal * w + b.normal * hit.u + c.normal * hit.v;
    // Vertices without a normal, or with normals that cancel out: the triangle's own.
    const float norm = length(shading);
    shading = norm > 1e-6f ? shading / norm : normalized(geometric);
    if constexpr (F.textures) {
        if (p.material->textured) p.uv = textureCoordinates(scene, shape, p.triangle, hit.u, hit.v);
        if (p.material->normalTexture)
            shading = mappedNormal(scene, shape, *p.material, corner, hit.u, hit.v, p.uv, shading, block);
        if (shape.firstColour >= 0) p.colour = vertexColourAt(scene, shape, corner, hit.u, hit.v).rgb;
    }
    if (hit.instance >= 0) {
        const Instance& instance = scene.instances[static_cast<std::size_t>(hit.instance)];
        const auto place = [&](const Transform& toWorld) {
            p.position = toWorld.point(p.position);
            geometric = toWorld.normal(geometric);
            shading = normalized(toWorld.normal(shading));
        };
        if (F.rare && instance.motion >= 0) {
            countEffect(Effect::ObjectMotion);
            place(scene.motions[static_cast<std::size_t>(instance.motion)].at(time));
        } else {
            place(instance.toWorld);
        }
    }
    geometric = normalized(geometric);
    if (dot(shading, geometric) < 0) shading = -shading;
    p.frontNormal = shading;

    p.fromBehind = dot(geometric, rayDirection) > 0;
    p.geometricNormal = p.fromBehind ? -geometric : geometric;
    p.shadingNormal = facing(p.fromBehind ? -shading : shading, -rayDirection);
    return p;
}

/// A material's own parameters, as they are where it has no textures.
SurfaceParameters plainParameters(const Scene& scene, const Material& material);

/// Whether the textures of a material leave alone what its DielectricLayer is made of.
inline bool hasOneLayer(const Material& m) {
    return !m.metallicRoughnessTexture && !m.specularTexture && !m.specularColourTexture;
}

/// The material there: `plain` with textures and vertex colours applied.
template <Features F>
SurfaceParameters parametersAt(const Scene& scene, const SurfacePoint& point,
                               const SurfaceParameters& plain) {
    SurfaceParameters s = plain;
    if constexpr (F.textures) {
        const Material& m = *point.material;
        s.baseColour *= point.colour;
        if (!m.textured) return s;
        const auto sampled = [&](const TextureRef& ref) {
            countEffect(Effect::Textures);
            return scene.textures[static_cast<std::size_t>(ref.texture)].lookup(point.uv.of(ref));
        };
        if (m.baseColourTexture) s.baseColour *= sampled(m.baseColourTexture).rgb;
        if (m.metallicRoughnessTexture) {
            const Rgb t = sampled(m.metallicRoughnessTexture).rgb;
            s.roughness *= t.y;
            s.metallic *= t.z;
        }
        if (m.transmissionTexture) s.transmission *= sampled(m.transmissionTexture).rgb.x;
        if (m.specularTexture) s.specular *= sampled(m.specularTexture).a;
        if (m.specularColourTexture) s.specularColour *= sampled(m.specularColourTexture).rgb;
        if (m.clearcoatTexture) s.clearcoat *= sampled(m.clearcoatTexture).rgb.x;
        if (m.clearcoatRoughnessTexture) s.clearcoatRoughness *= sampled(m.clearcoatRoughnessTexture).rgb.y;
        if (m.sheenColourTexture) s.sheenColour *= sampled(m.sheenColourTexture).rgb;
        if (m.sheenRoughnessTexture) s.sheenRoughness *= sampled(m.sheenRoughnessTexture).a;
    }
    return s;
}

}  // namespace vlx::render
