#include <algorithm>

#include "render/plan/plan.h"
#include "render/surface/surface.h"

namespace vlx::render {
namespace {

bool isPunctual(LightType t) {
    return t == LightType::Point || t == LightType::Spot || t == LightType::Directional;
}

/// Removes lights; shapes keep the numbers of theirs.
template <class Unwanted>
void removeLights(Scene& scene, Unwanted unwanted) {
    std::vector<std::int32_t> number(scene.lights.size(), -1);
    std::vector<Light> kept;
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        if (unwanted(i)) continue;
        number[i] = static_cast<std::int32_t>(kept.size());
        kept.push_back(std::move(scene.lights[i]));
    }
    scene.lights = std::move(kept);
    for (Shape& shape : scene.shapes)
        if (shape.light >= 0) shape.light = number[static_cast<std::size_t>(shape.light)];
}

void leaveOutOfMaterial(Material& m, const EffectSet& out) {
    if (out.has(Effect::Absorption)) m.absorption = {};
    if (out.has(Effect::Clearcoat)) m.clearcoat = 0;
    if (out.has(Effect::Sheen)) m.sheenColour = {};
    if (out.has(Effect::NormalMaps)) m.normalTexture = {};
    if (out.has(Effect::Alpha)) m.alphaMode = AlphaMode::Opaque;
    if (out.has(m.unlit ? Effect::Unlit : Effect::EmissiveMeshes)) m.emission = {};
    if (out.has(Effect::Textures)) {
        m.baseColourTexture = m.metallicRoughnessTexture = m.emissionTexture = m.transmissionTexture =
            m.specularTexture = m.specularColourTexture = m.clearcoatTexture = m.clearcoatRoughnessTexture =
                m.sheenColourTexture = m.sheenRoughnessTexture = {};
        m.textured = static_cast<bool>(m.normalTexture);
    }
}

/// What is left out of this picture's exposure is left out of its neighbours'.
void freeze(Course& course) {
    for (Motion* motion : {&course.before, &course.after}) motion->places = {motion->at(0.5f)};
}

/// Leaves of each exposure one block, of its middle.
void freeze(Scene& scene, const Shape& shape, const Deformation& d) {
    const std::array<std::uint32_t, 3> steps{d.steps, d.neighbourSteps, d.neighbourSteps};
    std::uint32_t first = 0;
    for (std::uint32_t frame = 0; frame < 3 && steps[frame] > 0; first += steps[frame++]) {
        // Written where nothing is read any more: before or in the blocks that it is made of.
        const Between middle = blocksAt(shape, first, steps[frame], 0.5f);
        for (std::uint32_t i = shape.firstVertex; i < shape.firstVertex + shape.vertices; ++i)
            scene.vertices[i + frame * shape.vertices] = cornerAt(scene, i, middle);
        if (frame > 0 || shape.firstTangent < 0) continue;
        const std::uint32_t nearest = middle.part < 0.5f ? middle.before : middle.after;
        const auto tangents = scene.tangents.begin() + shape.firstTangent;
        std::copy_n(tangents + nearest, shape.vertices, tangents);
    }
}

}  // namespace

bool tracerLeavesOut(Effect effect) {
    switch (effect) {
        case Effect::Diffuse:
        case Effect::Glossy:
        case Effect::Mirror:
        case Effect::Transmission:
        case Effect::RoughTransmission:
        case Effect::Caustics:
            return true;
        default:
            return false;
    }
}

void applyPlan(Scene& scene, const Plan& plan) {
    const EffectSet& out = plan.leftOut;
    const auto idle = [&](std::size_t i) { return std::ranges::binary_search(plan.idleLights, i); };
    removeLights(scene, [&](std::size_t i) {
        const LightType type = scene.lights[i].type;
        // Black surfaces are no lights, but those that nothing meets may as well shine.
        return idle(i) || (out.has(Effect::EmissiveMeshes) && type == LightType::Mesh) ||
               (out.has(Effect::PunctualLights) && isPunctual(type)) ||
               (out.has(Effect::SphereLights) && type == LightType::Sphere) ||
               (out.has(Effect::Environment) && type == LightType::Environment);
    });
    if (out.has(Effect::Environment)) scene.environment = {};
    for (Material& m : scene.materials) leaveOutOfMaterial(m, out);
    for (Camera& camera : scene.cameras) {
        if (out.has(Effect::DepthOfField)) camera.lensRadius = 0;
        if (out.has(Effect::CameraMotion)) {
            camera.motion = {};
            if (camera.course) freeze(*camera.course);
        }
    }
    if (!out.has(Effect::ObjectMotion)) return;
    for (Instance& instance : scene.instances) instance.motion = -1;
    scene.motions.clear();
    for (Course& course : scene.courses) freeze(course);
    for (const Shape& shape : scene.shapes)
        if (shape.deformation >= 0)
            freeze(scene, shape, scene.deformations[static_cast<std::size_t>(shape.deformation)]);
    for (Deformation& d : scene.deformations) {
        d.steps = 1;
        d.neighbourSteps = std::min(d.neighbourSteps, 1u);
    }
}

}  // namespace vlx::render
