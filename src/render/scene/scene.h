#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "render/light/light.h"
#include "render/math/transform.h"
#include "render/math/vec.h"
#include "render/scene/camera.h"
#include "render/scene/material.h"
#include "render/scene/motion.h"
#include "render/scene/texture.h"
#include "render/surface/bsdf.h"
#include "render/surface/energy_tables.h"

namespace vlx::render {

/// One half cache line; Embree reads the positions in place.
struct Vertex {
    Vec3 position;
    Vec3 normal;  ///< unit length
    Vec2 uv;
};
static_assert(sizeof(Vertex) == 32);

/// Unit tangent, and the sign of the bitangent.
struct Tangent {
    Vec3 direction;
    float sign = 1;
};

/// One primitive of a glTF mesh: triangles with one material. In world space, unless it belongs to a group.
struct Shape {
    std::uint32_t firstTriangle = 0;
    std::uint32_t triangles = 0;
    std::uint32_t firstVertex = 0;
    std::uint32_t vertices = 0;
    std::uint32_t material = 0;
    std::int32_t light = -1;         ///< index of its mesh light, or -1
    std::int64_t firstTangent = -1;  ///< of the optional arrays: -1 when it has none
    std::int64_t firstFurtherUv = -1;
    std::int64_t firstColour = -1;
    std::int32_t course = -1;       ///< in world space: index into the scene's courses, or -1
    std::int32_t deformation = -1;  ///< in world space: index into the scene's deformations, or -1
};

/// Of a shape whose vertices move on their own. Each step has a block of `Shape::vertices` of them (and of
/// tangents), one after the other: first those of the exposure, from its beginning to its end at equal steps
/// of time, between which they go straight; then, in a sequence, those of the exposures of the frame before
/// and of the one after. Triangles refer to the first block.
struct Deformation {
    std::uint32_t steps = 1;  ///< 1: it stands still while the shutter is open
    std::uint32_t neighbourSteps =
        0;              ///< of each neighbouring frame; 0: its vertices are where they are here
    std::string cause;  ///< the animation, for messages

    bool moves() const { return steps > 1; }
    std::uint32_t blocks() const { return steps + 2 * neighbourSteps; }
};

/// Where a moment lies among the blocks of a deformation: what to add to the number of a vertex of the first.
struct Between {
    std::uint32_t before = 0;
    std::uint32_t after = 0;
    float part = 0;  ///< of the way from one to the other
};
/// In `steps` blocks from block `first` on, `time` being 0 at the first and 1 at the last.
Between blocksAt(const Shape& shape, std::uint32_t first, std::uint32_t steps, float time);

/// Shapes of a mesh that more than one node uses: in the mesh's own space.
struct Group {
    std::uint32_t firstShape = 0;
    std::uint32_t shapes = 0;
};

struct Instance {
    std::uint32_t group = 0;
    Transform toWorld;         ///< in the middle of the exposure, when it moves
    std::int32_t motion = -1;  ///< index into the scene's motions, or -1
    std::int32_t course = -1;  ///< likewise into its courses
};

/// What was met while loading that a person may want to know.
struct LoadReport {
    std::uint64_t degenerateTriangles = 0;  ///< zero area: dropped
    std::vector<std::string> warnings;
    std::vector<std::string> notes;  ///< of what is right, as far as is known
    LightUnits lightUnits =
        LightUnits::Auto;  ///< in which the file has its punctual lights; Auto: it has none
};

/// A scene as the tracer wants it. Meshes that one node uses are stored flat in world space; meshes that
/// several nodes use, or that move, are stored once and instanced, except emissive ones that stand still,
/// which become lights and are flattened.
struct Scene {
    std::string name;
    std::vector<Vertex> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices into vertices; front counter-clockwise
    std::vector<Tangent> tangents;
    std::vector<Vec2> furtherUvs;   ///< a shape's: a block of each of Material::furtherUvSets
    std::vector<Rgba> colours;      ///< linear factors of the base colour
    std::vector<Shape> shapes;      ///< groups' shapes come last
    std::uint32_t worldShapes = 0;  ///< number of shapes that are in no group
    std::vector<Group> groups;
    std::vector<Instance> instances;
    std::vector<Motion> motions;
    std::vector<Course> courses;  ///< of a picture in a sequence (Shutter::frame): of what they move
    std::vector<Deformation> deformations;

    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<AlbedoTable> albedoTables;  ///< one for each index of refraction; the first is of 1.5
    std::vector<GlassTable> glassTables;
    std::vector<SheenTable> sheenTables;  ///< one when anything has sheen

    std::vector<Camera> cameras;
    std::size_t activeCamera = 0;  ///< the one to use by default: wantedCamera or the first usable one
    std::size_t wantedCamera = 0;  ///< which the file means: marked `active`, or the first
    std::string cameraFault;       ///< why there is no camera that can be used; empty where there is one
    std::vector<Light> lights;
    Environment environment;
    Shutter shutter;             ///< during which motions were followed
    std::size_t animations = 0;  ///< in the file, whether they move anything or not
    double lastKey = 0;          ///< when the last of them is over, seconds

    Vec3 boundsMin{0, 0, 0};
    Vec3 boundsMax{0, 0, 0};
    LoadReport report;

    std::uint64_t triangleCount() const;  ///< instances counted
};

/// A shape's vertices wherever they are while the shutter is open.
std::span<const Vertex> verticesOf(const Scene& scene, const Shape& shape);

/// Texture coordinates at a point of a triangle.
struct TextureCoordinates {
    Vec2 first;
    // Of what is rare, what it takes to work it out:
    std::array<const Vec2*, 3> further{};  ///< the corners' coordinates of the first of the further sets
    std::uint32_t stride = 0;              ///< from there to those of the next
    float u = 0, v = 0;                    ///< of the second and third corner

    Vec2 of(const TextureRef& ref) const { return ref.map(ref.uvSlot == 0 ? first : ofFurther(ref.uvSlot)); }
    Vec2 ofFurther(int slot) const {
        const std::size_t at = static_cast<std::size_t>(slot - 1) * stride;
        return further[0][at] * (1 - u - v) + further[1][at] * u + further[2][at] * v;
    }
};

/// Coordinates at barycentric (u, v) of the second and third corner.
TextureCoordinates textureCoordinates(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u,
                                      float v);

/// Opacity in [0, 1] at a point of a triangle: textures and vertex colours applied; 0 or 1 for Mask, 1 for
/// Opaque.
float opacityAt(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u, float v);

/// Radiance emitted at a point of a triangle in a direction at `cosTheta` to its normal: textures and the
/// clearcoat's reflection applied, opacity not.
Rgb emittedRadiance(const Scene& scene, const Shape& shape, std::uint32_t triangle, float u, float v,
                    float cosTheta);

/// What a ray found, as the material wants it.
struct SurfacePoint {
    Vec3 position;
    Vec3 geometricNormal;  ///< unit, on the viewer's side
    Vec3 shadingNormal;    ///< unit, on the viewer's side, interpolated and normal-mapped
    Vec3 frontNormal;      ///< the same on the front, not yet turned towards the viewer
    bool fromBehind = false;
    const Shape* shape = nullptr;
    const Material* material = nullptr;
    std::uint32_t triangle = 0;  ///< of the scene
    TextureCoordinates uv;
    Rgb colour{1, 1, 1};  ///< vertex colour
};

/// The same point seen by another viewer, `toViewer` being the unit direction to him.
SurfacePoint seenFrom(SurfacePoint point, const Vec3& toViewer);

struct Hit;  // accelerator.h

/// `time`: of the ray.
SurfacePoint surfaceAt(const Scene& scene, const Hit& hit, const Vec3& rayDirection, float time = 0);

/// The material there, textures applied.
SurfaceParameters surfaceParameters(const Scene& scene, const SurfacePoint& point);

}  // namespace vlx::render
