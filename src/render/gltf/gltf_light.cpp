#include "render/gltf/gltf_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vlx::render {
namespace {

constexpr double kLumensPerWatt = 683;  // of light of 555 nm, and of exporters

/// Whether a number of 64 bits is one of 32, but for the rounding of a few operations: one in 10^7 is by
/// chance.
bool isSingle(double v) {
    return std::abs(v - static_cast<double>(static_cast<float>(v))) <= 1e-15 * std::abs(v);
}

}  // namespace

LightReader::LightReader(const GltfFile& file, const tinygltf::Scene* scene, LightUnits units)
    : file_(file), dialect_(dialectOf(file.model())) {
    judge(scene);
    if (units == LightUnits::Auto) return;
    told_.clear();
    lumensPerWatt_ = units == LightUnits::Photometric ? kLumensPerWatt : 1;
}

void LightReader::judge(const tinygltf::Scene* scene) {
    if (scene != nullptr && scene->extras.IsObject() && scene->extras.Has("light_units")) {
        const tinygltf::Value& value = scene->extras.Get("light_units");
        const std::string name = value.IsString() ? value.Get<std::string>() : "";
        if (name != "radiometric" && name != "photometric")
            file_.fail("the scene's light_units must be \"radiometric\" or \"photometric\"");
        lumensPerWatt_ = name == "photometric" ? kLumensPerWatt : 1;
        return;
    }
    if (dialect_.own) return;
    if (dialect_.blender > 0) return judgeBlender();
    lumensPerWatt_ = kLumensPerWatt;
    told_ =
        "its lights are taken as photometric, in candela and lux, as KHR_lights_punctual has them, and "
        "divided by 683 lm/W (--light-units radiometric takes them as they are)";
}

void LightReader::judgeBlender() {
    int plain = 0, multiplied = 0;
    for (const tinygltf::Light& light : file_.model().lights) {
        const double watts = light.intensity * (light.type == "directional" ? 1 : 4 * std::numbers::pi);
        if (!(watts > 0)) continue;
        if (isSingle(watts / kLumensPerWatt))
            ++multiplied;
        else if (isSingle(watts))
            ++plain;
    }
    if (plain > 0 && multiplied == 0) {
        told_ =
            "its lights are taken as radiometric: their intensities are watts of Blender's, not times 683 "
            "lm/W (--light-units photometric divides them by that)";
        return;
    }
    lumensPerWatt_ = kLumensPerWatt;
    told_ = multiplied > 0 && plain == 0
                ? "its lights are taken as photometric, and divided by 683 lm/W: their intensities are watts "
                  "of Blender's times that (--light-units radiometric takes them as they are)"
                : "its lights are taken as photometric, in candela and lux, as KHR_lights_punctual has them, "
                  "and divided by 683 lm/W: nothing shows whether Blender's exporter multiplied by that "
                  "(--light-units radiometric takes them as they are)";
}

std::optional<Light> LightReader::read(int index, const tinygltf::Node& node, const Transform& toWorld,
                                       const std::string& what, std::vector<std::string>& warnings) const {
    const std::vector<tinygltf::Light>& lights = file_.model().lights;
    if (index < 0 || static_cast<std::size_t>(index) >= lights.size())
        file_.fail(what + " refers to light " + std::to_string(index) + ", the file has " +
                   std::to_string(lights.size()));
    const tinygltf::Light& source = lights[static_cast<std::size_t>(index)];
    Light light;
    light.name = node.name.empty() ? source.name : node.name;
    Rgb colour{1, 1, 1};
    if (source.color.size() == 3)
        colour = {static_cast<float>(source.color[0]), static_cast<float>(source.color[1]),
                  static_cast<float>(source.color[2])};
    light.intensity = colour * static_cast<float>(source.intensity / lumensPerWatt_);
    if (!isFinite(light.intensity) || light.intensity.x < 0 || light.intensity.y < 0 || light.intensity.z < 0)
        file_.fail(what + ": the light's color times its intensity must be finite and >= 0");
    if (isBlack(light.intensity)) {
        warnings.push_back(what + ": the light has no power");
        return std::nullopt;
    }
    light.position = toWorld.point({0, 0, 0});
    if (!(maxComponent(absolute(light.position)) <= kFarthest))
        file_.fail(what + ": the light is more than " + kFarthestText + " from the origin");
    const Vec3 axis = toWorld.vector({0, 0, -1});
    const bool directed = source.type != "point";
    if (directed && !(length(axis) > 0)) file_.fail(what + ": the light has no direction");
    light.direction = directed ? normalized(axis) : Vec3{0, 0, -1};
    const double radius = number(node.extras, "radius", number(source.extras, "radius", 0));
    if (source.range > 0) light.range = static_cast<float>(source.range);
    if (source.type == "directional") {
        light.type = LightType::Directional;
    } else if (source.type == "point" || source.type == "spot") {
        light.type = radius > 0 ? LightType::Sphere : directed ? LightType::Spot : LightType::Point;
        light.radius = static_cast<float>(std::max(0.0, radius));
        if (directed) setCone(light, source.spot);
    } else {
        file_.fail(what + ": the light's type is '" + source.type + "', expected point, spot or directional");
    }
    return light;
}

void LightReader::setCone(Light& light, const tinygltf::SpotLight& spot) const {
    const double outer = std::cos(spot.outerConeAngle);
    double width = std::max(0.001, std::cos(spot.innerConeAngle) - outer);
    if (dialect_.blender > 0) {
        const double blend = 1 - spot.innerConeAngle / spot.outerConeAngle;
        width = std::max(1e-5, (1 - outer) * std::clamp(blend, 0.0, 1.0));
        light.coneStep = 1;
        light.coneCosine = dialect_.oldBlender() ? 1.f : 0.f;
    }
    const double scale = 1 / width;
    light.coneScale = static_cast<float>(scale);
    light.coneOffset = static_cast<float>(-outer * scale);
}

}  // namespace vlx::render
