#include "render/light/light_emitter.h"

#include "render/plan/effect_counters.h"

namespace vlx::render {
namespace {

struct Corners {
    Vec3 p, edge1, edge2;
};

Corners cornersOf(const Scene& scene, const Shape& shape, std::uint32_t triangle) {
    const auto& corner = scene.triangles[shape.firstTriangle + triangle];
    const Vec3& p = scene.vertices[corner[0]].position;
    return {p, scene.vertices[corner[1]].position - p, scene.vertices[corner[2]].position - p};
}

/// Rays start off the surface by more than rounding can err, as path_kernel.h's do.
float clearance(const Vec3& position) { return 4e-6f * maxComponent(absolute(position)) + 1e-9f; }

}  // namespace

LightEmitter::LightEmitter(const Scene& scene)
    : scene_(&scene),
      centre_((scene.boundsMin + scene.boundsMax) * 0.5f),
      radius_(0.5001f * length(scene.boundsMax - scene.boundsMin) + 1e-6f) {
    std::vector<float> powers;
    const float disk = kPi * square(radius_);
    for (const Light& light : scene.lights) {
        float power = maxComponent(light.intensity);
        std::vector<float>& areas = areas_.emplace_back();
        switch (light.type) {
            case LightType::Mesh: {
                const Shape& shape = scene.shapes[light.shape];
                for (std::uint32_t i = 0; i < shape.triangles; ++i) {
                    const Corners c = cornersOf(scene, shape, i);
                    areas.push_back(0.5f * length(cross(c.edge1, c.edge2)));
                }
                const bool both = scene.materials[shape.material].visibleFromBehind();
                power *= kPi * light.area * (both ? 2 : 1);
                break;
            }
            case LightType::Point:
            case LightType::Spot:
            case LightType::Sphere:
                power /= static_cast<float>(coneDensity(light));
                break;
            case LightType::Directional:
                power *= disk;
                break;
            case LightType::Environment:
                power *= 4 * kPi * disk;
                break;
        }
        powers.push_back(power);
        power_ += power;
    }
    if (!powers.empty()) lights_ = Distribution(powers);  // all that is seen may be unlit
}

float LightEmitter::leastCosine(const Light& light) const {
    if (light.coneScale <= 0) return -1;
    return std::clamp(-light.coneOffset / light.coneScale, -1.f, 1.f - 1e-6f);
}

double LightEmitter::coneDensity(const Light& light) const {
    return 1 / (2 * std::numbers::pi * (1 - static_cast<double>(leastCosine(light))));
}

double LightEmitter::density(std::size_t index, std::uint32_t triangle, const Vec3& direction) const {
    const Light& light = scene_->lights[index];
    const double chosen = lights_.probability(index);
    const double disk = std::numbers::pi * square(radius_);
    switch (light.type) {
        case LightType::Mesh: {
            const Shape& shape = scene_->shapes[light.shape];
            const double sides = scene_->materials[shape.material].visibleFromBehind() ? 2 : 1;
            return chosen * light.triangles.probability(triangle) / areas_[index][triangle] /
                   (std::numbers::pi * sides);
        }
        case LightType::Point:
        case LightType::Spot:
        case LightType::Sphere: {
            if (light.coneScale > 0 && dot(direction, light.direction) < leastCosine(light)) return 0;
            const double across =
                light.type == LightType::Sphere ? std::numbers::pi * square(light.radius) : 1;
            return chosen * coneDensity(light) / across;
        }
        case LightType::Directional:
            return chosen / disk;
        case LightType::Environment:
            return chosen * scene_->environment.pdf(-direction, {0, 1, 0}, true) / disk;
    }
    return 0;
}

Emission LightEmitter::sample(float choice, Vec2 origin, Vec2 direction, float time) const {
    const Distribution::Sample chosen = lights_.sample(choice);
    Emission e;
    switch (scene_->lights[chosen.index].type) {
        case LightType::Mesh:
            e = fromMesh(chosen.index, chosen.remapped, origin, direction);
            break;
        case LightType::Point:
        case LightType::Spot:
        case LightType::Sphere:
            e = fromCone(chosen.index, origin, direction);
            break;
        case LightType::Directional:
        case LightType::Environment:
            e = fromAfar(chosen.index, origin, direction);
            break;
    }
    e.light = static_cast<std::uint32_t>(chosen.index);
    e.ray.time = time;
    e.density = density(chosen.index, e.triangle, e.ray.direction);
    if (!(e.density > 0)) return {};
    e.throughput *= static_cast<float>(1 / e.density);
    return e;
}

Emission LightEmitter::fromMesh(std::size_t index, float side, Vec2 origin, Vec2 direction) const {
    countEffect(Effect::EmissiveMeshes);
    const Light& light = scene_->lights[index];
    const Shape& shape = scene_->shapes[light.shape];
    const Distribution::Sample chosen = light.triangles.sample(origin.x);
    const Vec2 b = uniformTriangle({chosen.remapped, origin.y});
    Emission e;
    e.triangle = static_cast<std::uint32_t>(chosen.index);
    const Corners c = cornersOf(*scene_, shape, e.triangle);
    Vec3 normal = normalized(cross(c.edge1, c.edge2));
    if (side < 0.5f && scene_->materials[shape.material].visibleFromBehind()) normal = -normal;
    const Vec3 local = cosineHemisphere(direction);
    const Vec3 point = c.p + c.edge1 * b.x + c.edge2 * b.y;
    e.ray = {point + normal * clearance(point), normalized(Frame(normal).toWorld(local)), 0};
    e.cosLight = local.z;
    const auto triangle = shape.firstTriangle + e.triangle;
    e.throughput = emittedRadiance(*scene_, shape, triangle, b.x, b.y, local.z) *
                   opacityAt(*scene_, shape, triangle, b.x, b.y);
    return e;
}

Emission LightEmitter::fromCone(std::size_t index, Vec2 origin, Vec2 direction) const {
    const Light& light = scene_->lights[index];
    const bool sphere = light.type == LightType::Sphere;
    countEffect(sphere ? Effect::SphereLights : Effect::PunctualLights);
    const Vec3 axis = light.coneScale > 0 ? light.direction : Vec3{0, 0, 1};
    const Vec3 away = normalized(Frame(axis).toWorld(uniformCone(direction, 1 - leastCosine(light))));
    Emission e;
    e.ray = {light.position, away, 0};
    e.throughput = light.intensity * light.cone(away);
    if (!sphere) return e;
    const Vec2 d = toDisk(origin);
    const float height = std::sqrt(std::max(0.f, 1 - d.x * d.x - d.y * d.y));
    const Vec3 normal = Frame(away).toWorld({d.x, d.y, height});
    const Vec3 point = light.position + normal * light.radius;
    e.ray.origin = point + normal * (clearance(point) + 1e-5f * light.radius);
    e.cosLight = height;
    e.throughput = light.sphereRadiance(away);
    return e;
}

Emission LightEmitter::fromAfar(std::size_t index, Vec2 origin, Vec2 direction) const {
    const Light& light = scene_->lights[index];
    Emission e;
    Vec3 along = light.direction;
    if (light.type == LightType::Environment) {
        countEffect(Effect::Environment);
        const Environment::Sample s = scene_->environment.sample({0, 1, 0}, true, direction);
        along = -normalized(s.direction);
        e.throughput = scene_->environment.radiance(-along);
    } else {
        countEffect(Effect::PunctualLights);
        e.throughput = light.intensity;
    }
    const Vec2 d = toDisk(origin);
    e.ray = {centre_ + Frame(along).toWorld({d.x * radius_, d.y * radius_, -radius_}), along, 0};
    return e;
}

}  // namespace vlx::render
