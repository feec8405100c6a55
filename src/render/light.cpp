#include "light.h"

#include "scene.h"

namespace vlx::render {
namespace {

/// Part of the choice that is spread evenly over all lights that may reach the receiver: the estimate of the
/// rest may be far too low for some of them.
constexpr float kEvenPart = 0.1f;

/// Shadow rays end a little before the light.
constexpr float kReach = 1 - 1e-4f;

/// Of light towards a receiver, the part above its horizon as far as its bounds tell.
bool belowHorizon(const Receiver& receiver, const Vec3& toCentre, float radius) {
    return !receiver.bothSides && dot(toCentre, receiver.normal) <= -radius * 1.001f;
}

float cosineAt(const Receiver& receiver, const Vec3& direction) {
    return receiver.bothSides ? 1.f : std::max(0.f, dot(receiver.normal, direction));
}

}  // namespace

/// Estimated irradiance, unoccluded: 0 only where the light cannot contribute.
float LightSampler::importance(const Receiver& receiver, const Candidate& light) {
    const float strength = light.strength;
    const Vec3 to = light.position - receiver.position;
    const float d2 = lengthSquared(to);
    switch (light.type) {
        case LightType::Point:
        case LightType::Spot: {
            if (d2 == 0) return 0;
            const Vec3 direction = to / std::sqrt(d2);
            const float cone =
                std::clamp(light.coneOffset - dot(direction, light.direction) * light.coneScale, 0.f, 1.f);
            return strength * cone * cone * cosineAt(receiver, direction) / d2;
        }
        case LightType::Directional:
            return strength * cosineAt(receiver, -light.direction);
        case LightType::Sphere:
            return belowHorizon(receiver, to, light.radius) ? 0
                                                            : strength / std::max(d2, square(light.radius));
        case LightType::Mesh:
            return belowHorizon(receiver, to, light.radius)
                       ? 0
                       : strength * std::min(light.area / std::max(d2, 0.25f * square(light.radius)), kPi);
        case LightType::Environment:
            return strength * kPi;
    }
    return 0;
}

LightSampler::LightSampler(const Scene& scene) : scene_(&scene), lights_(scene.lights) {
    if (lights_.empty()) return;
    const float radius = 0.5f * length(scene.boundsMax - scene.boundsMin);
    std::vector<float> powers;
    for (const Light& light : lights_) {
        const float strength = maxComponent(light.intensity);
        candidates_.push_back({light.position, light.radius, light.direction, strength, light.area,
                               light.coneScale, light.coneOffset, light.type});
        firstTriangle_.push_back(triangles_.size());
        switch (light.type) {
            case LightType::Point:
            case LightType::Spot:
            case LightType::Sphere:
                powers.push_back(strength * 4 * kPi);
                break;
            case LightType::Mesh:
                powers.push_back(strength * light.area * kPi);
                addTriangles(light);
                break;
            case LightType::Directional:
                powers.push_back(strength * kPi * square(radius));
                break;
            case LightType::Environment:
                environmentLight_ = static_cast<std::int64_t>(powers.size());
                powers.push_back(strength * kPi * kPi * square(radius));
                break;
        }
    }
    byPower_ = Distribution(powers);
}

void LightSampler::addTriangles(const Light& light) {
    const Shape& shape = scene_->shapes[light.shape];
    for (std::uint32_t i = 0; i < shape.triangles; ++i) {
        const auto& corner = scene_->triangles[shape.firstTriangle + i];
        const Vec3& p = scene_->vertices[corner[0]].position;
        const Vec3 e1 = scene_->vertices[corner[1]].position - p,
                   e2 = scene_->vertices[corner[2]].position - p;
        const Vec3 n = cross(e1, e2);
        const float twiceArea = length(n);
        triangles_.push_back({p, e1, e2, n / twiceArea, light.triangles.probability(i) * 2 / twiceArea});
    }
}

LightSampler::Choice LightSampler::choose(const Receiver& receiver, float u) const {
    if (lights_.size() > kLocalLights) {
        const Distribution::Sample s = byPower_.sample(u);
        return {s.index, s.probability};
    }
    std::array<float, kLocalLights> weights;
    float sum = 0;
    std::size_t possible = 0;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        weights[i] = importance(receiver, candidates_[i]);
        sum += weights[i];
        possible += weights[i] > 0;
    }
    if (possible == 0) return {};
    const float even = kEvenPart / static_cast<float>(possible);
    float rest = u;
    Choice last;
    for (std::size_t i = 0; i < lights_.size(); ++i) {
        if (weights[i] == 0) continue;
        last = {i, even + (1 - kEvenPart) * weights[i] / sum};
        if (rest < last.probability) break;
        rest -= last.probability;
    }
    return last;
}

float LightSampler::probability(const Receiver& receiver, std::size_t light) const {
    if (lights_.size() > kLocalLights) return byPower_.probability(light);
    const float own = importance(receiver, candidates_[light]);
    if (own == 0) return 0;
    float sum = 0;
    int possible = 0;
    for (const Candidate& candidate : candidates_) {
        const float w = importance(receiver, candidate);
        sum += w;
        possible += w > 0;
    }
    return kEvenPart / static_cast<float>(possible) + (1 - kEvenPart) * own / sum;
}

LightSample LightSampler::sampleMesh(const Receiver& receiver, std::size_t index, Vec2 u) const {
    // u.x chooses the triangle, and its remainder the place on it.
    const Light& light = lights_[index];
    const Distribution::Sample chosen = light.triangles.sample(u.x);
    const Vec2 b = uniformTriangle({chosen.remapped, u.y});
    const EmitterTriangle& t = triangles_[firstTriangle_[index] + chosen.index];
    const Vec3 to = t.corner + t.edge1 * b.x + t.edge2 * b.y - receiver.position;
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return {};
    LightSample s;
    s.distance = std::sqrt(d2);
    s.direction = to / s.distance;
    const float cosLight = -dot(t.normal, s.direction);
    const Shape& shape = scene_->shapes[light.shape];
    if (cosLight == 0 || (cosLight < 0 && !scene_->materials[shape.material].visibleFromBehind())) return {};
    s.pdf = t.density * d2 / std::abs(cosLight);
    const auto triangle = shape.firstTriangle + static_cast<std::uint32_t>(chosen.index);
    s.radiance = emittedRadiance(*scene_, shape, triangle, b.x, b.y, std::abs(cosLight)) *
                 opacityAt(*scene_, shape, triangle, b.x, b.y);
    s.distance *= kReach;
    return s;
}

LightSample LightSampler::sampleSphere(const Receiver& receiver, const Light& light, Vec2 u) const {
    const Vec3 to = light.position - receiver.position;
    const float d2 = lengthSquared(to), r2 = square(light.radius);
    if (d2 <= r2) return {};  // inside: the sphere shines outwards
    const float sin2Max = r2 / d2;
    const float oneMinusCosMax = sin2Max / (1 + std::sqrt(1 - sin2Max));
    const float distance = std::sqrt(d2);
    LightSample s;
    const Vec3 local = uniformCone(u, oneMinusCosMax);
    s.direction = Frame(to / distance).toWorld(local);
    s.pdf = 1 / (2 * kPi * oneMinusCosMax);
    // Nearest crossing of the ray and the sphere.
    const float along = distance * local.z;
    const float half = std::sqrt(std::max(0.f, r2 - d2 * std::max(0.f, 1 - local.z * local.z)));
    s.distance = (along - half) * kReach;
    s.radiance = light.sphereRadiance(-s.direction);
    return s;
}

LightSample LightSampler::sample(const Receiver& receiver, float choice, Vec2 u) const {
    const Choice chosen = choose(receiver, choice);
    if (chosen.probability == 0) return {};
    const Light& light = lights_[chosen.light];
    LightSample s;
    switch (light.type) {
        case LightType::Point:
        case LightType::Spot: {
            const Vec3 to = light.position - receiver.position;
            const float d2 = lengthSquared(to);
            if (d2 == 0) return {};
            const float distance = std::sqrt(d2);
            const Vec3 direction = to / distance;
            return {direction, distance * kReach,
                    light.intensity * (light.cone(-direction) * light.window(d2) / d2), chosen.probability,
                    true};
        }
        case LightType::Directional:
            return {-light.direction, std::numeric_limits<float>::infinity(), light.intensity,
                    chosen.probability, true};
        case LightType::Sphere:
            s = sampleSphere(receiver, light, u);
            break;
        case LightType::Mesh:
            s = sampleMesh(receiver, chosen.light, u);
            break;
        case LightType::Environment: {
            const Environment& env = scene_->environment;
            const Environment::Sample e = env.sample(receiver.normal, receiver.bothSides, u);
            s = {e.direction, std::numeric_limits<float>::infinity(), env.radiance(e.direction), e.pdf,
                 false};
            break;
        }
    }
    s.pdf *= chosen.probability;
    return s;
}

float LightSampler::meshPdf(const Receiver& receiver, std::uint32_t light, std::uint32_t triangle,
                            float distance, float cosLight) const {
    return probability(receiver, light) * triangles_[firstTriangle_[light] + triangle].density *
           square(distance) / std::max(std::abs(cosLight), 1e-12f);
}

float LightSampler::spherePdf(const Receiver& receiver, std::uint32_t light) const {
    const Light& l = lights_[light];
    const float d2 = lengthSquared(l.position - receiver.position), r2 = square(l.radius);
    if (d2 <= r2) return 0;
    const float sin2Max = r2 / d2;
    const float oneMinusCosMax = sin2Max / (1 + std::sqrt(1 - sin2Max));
    return probability(receiver, light) / (2 * kPi * oneMinusCosMax);
}

float LightSampler::environmentPdf(const Receiver& receiver, const Vec3& direction) const {
    if (environmentLight_ < 0) return 0;
    return probability(receiver, static_cast<std::size_t>(environmentLight_)) *
           scene_->environment.pdf(direction, receiver.normal, receiver.bothSides);
}

}  // namespace vlx::render
