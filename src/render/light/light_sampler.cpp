#include "render/light/light_sampler.h"

namespace vlx::render {
LightSampler::LightSampler(const Scene& scene, bool measures)
    : scene_(&scene), measures_(measures), alone_(!measures && scene.lights.size() == 1) {
    for (const Light& light : scene.lights) {
        const float strength = maxComponent(light.intensity);
        candidates_.push_back({light.position, light.radius, light.direction, strength, light.area,
                               light.coneScale, light.coneOffset, light.coneStep, light.type});
        meshes_.emplace_back();
        if (light.type == LightType::Mesh) addTriangles(light);
        if (light.type == LightType::Environment)
            environmentLight_ = static_cast<std::int32_t>(candidates_.size()) - 1;
    }
    if (candidates_.size() > kLocalLights) tree_ = LightTree(candidates_);
}

void LightSampler::addTriangles(const Light& light) {
    const Shape& shape = scene_->shapes[light.shape];
    const Material& material = scene_->materials[shape.material];
    const bool plain = !measures_ && !material.emissionTexture && material.clearcoat == 0 &&
                       material.alphaMode == AlphaMode::Opaque;
    meshes_.back() = {&light, triangles_.size(), material.visibleFromBehind(), plain, material.emission};
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

template <class Real, std::size_t n>
void LightSampler::estimate(const std::array<Local*, n>& locals, const ReceiverOf<Real>& receivers) const {
    Real sum{}, possible{};
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        const Real weight = lightImportance(receivers, candidates_[i]);
        sum += weight;
        possible += weight > 0 ? spread<Real>(1) : Real{};
        for (std::size_t k = 0; k < n; ++k) locals[k]->weights[i] = laneOf(weight, k);
    }
    for (std::size_t k = 0; k < n; ++k) {
        locals[k]->sum = laneOf(sum, k);
        locals[k]->possible = laneOf(possible, k);
    }
}

template void LightSampler::estimate(const std::array<Local*, 1>&, const Receiver&) const;
template void LightSampler::estimate(const std::array<Local*, kLanes>&, const ReceiverOf<Lanes>&) const;

LightSampler::Choice LightSampler::choose(const Local& local, float u) const {
    if (candidates_.size() > kLocalLights) {
        const LightTree::Choice c = tree_.choose(candidates_, local.receiver, u);
        return {c.light, c.probability};
    }
    if (local.possible == 0) return {};
    const float even = kEvenPart / local.possible;
    float rest = u;
    Choice last;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
        if (local.weights[i] == 0) continue;
        last = {i, even + (1 - kEvenPart) * (local.weights[i] / local.sum)};
        if (rest < last.probability) break;
        rest -= last.probability;
    }
    return last;
}

float LightSampler::probability(const Local& local, std::size_t light) const {
    if (candidates_.size() > kLocalLights) return tree_.probability(candidates_, local.receiver, light);
    const float own = local.weights[light];
    if (own == 0) return 0;
    return kEvenPart / local.possible + (1 - kEvenPart) * (own / local.sum);
}

LightSample LightSampler::sampleSphere(const Receiver& receiver, const Light& light, Vec2 u) const {
    countEffect(Effect::SphereLights);
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

LightSample LightSampler::sampleAny(const Local& local, float choice, Vec2 u) const {
    const Receiver& receiver = local.receiver;
    const Choice chosen = alone_ ? Choice{0, 1} : choose(local, choice);
    if (chosen.probability == 0) return {};
    const Light& light = scene_->lights[chosen.light];
    LightSample s;
    switch (light.type) {
        case LightType::Point:
        case LightType::Spot: {
            countEffect(Effect::PunctualLights);
            const Vec3 to = light.position - receiver.position;
            const float d2 = lengthSquared(to);
            if (d2 == 0) return {};
            const float distance = std::sqrt(d2);
            const Vec3 direction = to / distance;
            return {direction,
                    distance * kReach,
                    light.intensity * (light.cone(-direction) * light.window(d2) / d2),
                    chosen.probability,
                    true,
                    static_cast<std::uint32_t>(chosen.light)};
        }
        case LightType::Directional:
            countEffect(Effect::PunctualLights);
            return {-light.direction,
                    std::numeric_limits<float>::infinity(),
                    light.intensity,
                    chosen.probability,
                    true,
                    static_cast<std::uint32_t>(chosen.light)};
        case LightType::Sphere:
            s = sampleSphere(receiver, light, u);
            break;
        case LightType::Mesh:
            s = sampleMesh(receiver, chosen.light, u);
            break;
        case LightType::Environment: {
            countEffect(Effect::Environment);
            const Environment& env = scene_->environment;
            const Environment::Sample e = env.sample(receiver.normal, receiver.bothSides, u);
            s = {e.direction, std::numeric_limits<float>::infinity(), env.radiance(e.direction), e.pdf,
                 false};
            break;
        }
    }
    s.pdf *= chosen.probability;
    s.light = static_cast<std::uint32_t>(chosen.light);
    return s;
}

double LightSampler::density(const Local& local, std::uint32_t light, std::uint32_t triangle,
                             const Vec3& direction, float distance, float cosLight) const {
    switch (scene_->lights[light].type) {
        case LightType::Mesh:
            return meshPdf(local, light, triangle, distance, cosLight);
        case LightType::Sphere:
            return spherePdf(local, light);
        case LightType::Environment:
            return environmentPdf(local, direction);
        case LightType::Directional:
            return probability(local, light);
        case LightType::Point:
        case LightType::Spot:
            return probability(local, light) * static_cast<double>(distance) * distance;
    }
    return 0;
}

float LightSampler::meshPdf(const Local& local, std::uint32_t light, std::uint32_t triangle, float distance,
                            float cosLight) const {
    return probability(local, light) * triangles_[meshes_[light].firstTriangle + triangle].density *
           square(distance) / std::max(std::abs(cosLight), 1e-12f);
}

float LightSampler::spherePdf(const Local& local, std::uint32_t light) const {
    const Light& l = scene_->lights[light];
    const float d2 = lengthSquared(l.position - local.receiver.position), r2 = square(l.radius);
    if (d2 <= r2) return 0;
    const float sin2Max = r2 / d2;
    const float oneMinusCosMax = sin2Max / (1 + std::sqrt(1 - sin2Max));
    return probability(local, light) / (2 * kPi * oneMinusCosMax);
}

float LightSampler::environmentPdf(const Local& local, const Vec3& direction) const {
    return probability(local, static_cast<std::size_t>(environmentLight_)) *
           scene_->environment.pdf(direction, local.receiver.normal, local.receiver.bothSides);
}

}  // namespace vlx::render
