#include <algorithm>
#include <limits>

#include "render/scene/scene_loader.h"

namespace vlx::render {
namespace {

void setBounds(Scene& scene) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    Vec3 low(inf), high(-inf);
    const auto include = [&](const Vec3& p) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    };
    const auto includeShape = [&](const Shape& shape, const Transform* toWorld) {
        for (const Vertex& v : verticesOf(scene, shape))
            include(toWorld != nullptr ? toWorld->point(v.position) : v.position);
    };
    for (std::uint32_t i = 0; i < scene.worldShapes; ++i) includeShape(scene.shapes[i], nullptr);
    for (const Instance& instance : scene.instances) {
        const Group& group = scene.groups[instance.group];
        for (std::uint32_t i = 0; i < group.shapes; ++i) {
            const Shape& shape = scene.shapes[group.firstShape + i];
            includeShape(shape, &instance.toWorld);
            if (instance.motion < 0) continue;
            for (const Transform& place : scene.motions[static_cast<std::size_t>(instance.motion)].places)
                includeShape(shape, &place);
        }
    }
    if (low.x <= high.x) {
        scene.boundsMin = low;
        scene.boundsMax = high;
    }
}

/// The index of the table of `ior` among `tables`, which grow when there is none.
template <class Table>
int tableOf(std::vector<Table>& tables, float ior) {
    const auto found = std::ranges::find_if(tables, [&](const Table& t) { return t.ior() == ior; });
    if (found == tables.end()) {
        tables.emplace_back(ior);
        return static_cast<int>(tables.size()) - 1;
    }
    return static_cast<int>(found - tables.begin());
}

void prepareMaterials(Scene& scene) {
    tableOf(scene.albedoTables, 1.5f);
    for (Material& material : scene.materials) {
        material.textured = material.baseColourTexture || material.metallicRoughnessTexture ||
                            material.emissionTexture || material.normalTexture ||
                            material.transmissionTexture || material.specularTexture ||
                            material.specularColourTexture || material.clearcoatTexture ||
                            material.clearcoatRoughnessTexture || material.sheenColourTexture ||
                            material.sheenRoughnessTexture;
        material.albedoTable = tableOf(scene.albedoTables, material.ior);
        if (material.transmissive() && square(material.roughness) >= kSmoothAlpha)
            material.glassTable = tableOf(scene.glassTables, material.ior);
        if (!isBlack(material.sheenColour) && scene.sheenTables.empty()) scene.sheenTables.emplace_back();
    }
}

/// Mean emission over a triangle: a grid of 4 x 4 points where a texture varies it.
Rgb meanEmission(const Scene& scene, const Shape& shape, std::uint32_t triangle) {
    if (!scene.materials[shape.material].emissionTexture)
        return emittedRadiance(scene, shape, triangle, 0.3f, 0.3f, 1);
    Rgb sum;
    constexpr int n = 4;
    for (int i = 0; i < n * n; ++i) {
        const Vec2 u{(static_cast<float>(i % n) + 0.5f) / n, (static_cast<float>(i / n) + 0.5f) / n};
        const Vec2 b = uniformTriangle(u);
        sum += emittedRadiance(scene, shape, triangle, b.x, b.y, 1);
    }
    return sum / static_cast<float>(n * n);
}

/// The mesh light of an emissive shape in world space.
Light meshLight(const Scene& scene, std::uint32_t index) {
    const Shape& shape = scene.shapes[index];
    Light light;
    light.type = LightType::Mesh;
    light.name = scene.materials[shape.material].name;
    light.shape = index;
    std::vector<float> powers(shape.triangles);
    double area = 0;
    double flux[3] = {0, 0, 0};
    constexpr float inf = std::numeric_limits<float>::infinity();
    Vec3 low(inf), high(-inf);
    for (std::uint32_t i = 0; i < shape.triangles; ++i) {
        const auto& corner = scene.triangles[shape.firstTriangle + i];
        const Vec3& a = scene.vertices[corner[0]].position;
        const Vec3& b = scene.vertices[corner[1]].position;
        const Vec3& c = scene.vertices[corner[2]].position;
        const float part = 0.5f * length(cross(b - a, c - a));
        const Rgb emission = meanEmission(scene, shape, shape.firstTriangle + i);
        // A floor: the grid may have missed the bright part of a texture.
        powers[i] = part * std::max(maxComponent(emission),
                                    1e-3f * maxComponent(scene.materials[shape.material].emission));
        area += part;
        flux[0] += part * emission.x;
        flux[1] += part * emission.y;
        flux[2] += part * emission.z;
        for (const Vec3& p : {a, b, c}) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
    }
    light.area = static_cast<float>(area);
    light.intensity = {static_cast<float>(flux[0] / area), static_cast<float>(flux[1] / area),
                       static_cast<float>(flux[2] / area)};
    // Where the texture is black at every grid point there may still be light.
    light.intensity += Rgb(1e-3f * maxComponent(scene.materials[shape.material].emission));
    light.position = (low + high) * 0.5f;
    light.radius = 0.5f * length(high - low);
    light.triangles = Distribution(powers);
    return light;
}

}  // namespace

void completeScene(Scene& scene) {
    setBounds(scene);
    prepareMaterials(scene);
    for (std::uint32_t i = 0; i < scene.worldShapes; ++i) {
        const std::int32_t deformation = scene.shapes[i].deformation;
        if (!scene.materials[scene.shapes[i].material].shines() ||
            (deformation >= 0 && scene.deformations[static_cast<std::size_t>(deformation)].moves()))
            continue;
        scene.shapes[i].light = static_cast<std::int32_t>(scene.lights.size());
        scene.lights.push_back(meshLight(scene, i));
    }
    if (scene.environment && !isBlack(scene.environment.mean())) {
        Light light;
        light.type = LightType::Environment;
        light.name = "environment";
        light.intensity = scene.environment.mean();
        scene.lights.push_back(std::move(light));
    }
}

}  // namespace vlx::render
