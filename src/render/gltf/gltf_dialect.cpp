#include "render/gltf/gltf_dialect.h"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <string_view>

namespace vlx::render {
namespace {

bool hasAny(const tinygltf::Value& extras, std::initializer_list<const char*> names) {
    return extras.IsObject() &&
           std::ranges::any_of(names, [&](const char* name) { return extras.Has(name); });
}

bool isOwn(const tinygltf::Model& model) {
    const auto ofCamera = [](const auto& c) {
        return hasAny(c.extras, {"lens_radius", "focus_distance", "active"});
    };
    const auto ofNode = [&](const tinygltf::Node& n) { return n.camera >= 0 && ofCamera(n); };
    const auto ofScene = [](const auto& s) { return hasAny(s.extras, {"env_constant", "light_units"}); };
    return std::ranges::any_of(model.nodes, ofNode) || std::ranges::any_of(model.cameras, ofCamera) ||
           std::ranges::any_of(model.scenes, ofScene);
}

}  // namespace

Dialect dialectOf(const tinygltf::Model& model) {
    constexpr std::string_view kBlender = "Khronos glTF Blender I/O v";
    Dialect d;
    d.own = isOwn(model);
    const std::string& generator = model.asset.generator;
    if (!d.own && generator.starts_with(kBlender)) d.blender = std::atoi(generator.c_str() + kBlender.size());
    return d;
}

}  // namespace vlx::render
