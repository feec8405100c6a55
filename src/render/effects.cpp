#include "effects.h"

namespace vlx::render {

std::vector<std::string> sceneEffects(const Scene& scene, const Camera& camera, int maxBounces) {
    std::vector<std::string> names;
    std::vector<const Material*> used;
    for (const Shape& shape : scene.shapes) used.push_back(&scene.materials[shape.material]);
    const auto anyMaterial = [&](const char* name, auto has) {
        for (const Material* m : used) {
            if (!has(*m)) continue;
            names.emplace_back(name);
            return;
        }
    };
    const auto anyLight = [&](const char* name, auto has) {
        for (const Light& light : scene.lights) {
            if (!has(light.type)) continue;
            names.emplace_back(name);
            return;
        }
    };
    const auto smooth = [](const Material& m) { return square(m.roughness) < kSmoothAlpha; };
    const auto reflects = [](const Material& m) {
        return m.metallic > 0 || m.specular > 0 || m.clearcoat > 0;
    };
    anyMaterial("diffuse", [](const Material& m) {
        return m.metallic < 1 && m.transmission < 1 && !isBlack(m.baseColour);
    });
    anyMaterial("glossy", [&](const Material& m) { return reflects(m) && !smooth(m); });
    anyMaterial("mirror", [&](const Material& m) { return reflects(m) && smooth(m); });
    anyMaterial("transmission", [&](const Material& m) { return m.transmissive() && smooth(m); });
    anyMaterial("rough_transmission", [&](const Material& m) { return m.transmissive() && !smooth(m); });
    anyMaterial("clearcoat", [](const Material& m) { return m.clearcoat > 0; });
    anyMaterial("textures", [](const Material& m) { return m.textured; });
    anyMaterial("normal_maps", [](const Material& m) { return static_cast<bool>(m.normalTexture); });
    anyMaterial("alpha", [](const Material& m) { return m.alphaMode != AlphaMode::Opaque; });
    anyLight("emissive_meshes", [](LightType t) { return t == LightType::Mesh; });
    anyLight("punctual_lights", [](LightType t) {
        return t == LightType::Point || t == LightType::Spot || t == LightType::Directional;
    });
    anyLight("sphere_lights", [](LightType t) { return t == LightType::Sphere; });
    if (scene.environment) names.emplace_back("environment");
    if (camera.lensRadius > 0) names.emplace_back("depth_of_field");
    if (maxBounces > 1) names.emplace_back("indirect");
    return names;
}

}  // namespace vlx::render
