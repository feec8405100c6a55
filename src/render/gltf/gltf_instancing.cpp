#include "render/gltf/gltf_instancing.h"

#include <algorithm>
#include <cmath>

#include "render/gltf/gltf_animation.h"

namespace vlx::render {
namespace {

constexpr std::size_t kMostInstances = std::size_t{1} << 24;

}  // namespace

std::vector<Transform> instancesOf(const GltfFile& file, const tinygltf::Node& node,
                                   const std::string& what) {
    const tinygltf::Value* instancing = extension(node.extensions, "EXT_mesh_gpu_instancing");
    if (instancing == nullptr) return {Transform{}};
    const tinygltf::Value& attributes = instancing->Get("attributes");
    std::size_t count = 0;
    std::string counted;  // the attribute that has said how many
    const auto read = [&](const std::string& name, std::size_t width) {
        if (!attributes.IsObject() || !attributes.Has(name)) return std::vector<float>();
        const std::string place = what + " EXT_mesh_gpu_instancing " + name;
        const auto accessor = static_cast<int>(number(attributes, name, -1));  // checked (gltf_check.h)
        const std::size_t found = file.model().accessors[static_cast<std::size_t>(accessor)].count;
        if (found > kMostInstances)
            file.fail(place + " has " + std::to_string(found) + " instances, expected 2^24 at most");
        std::vector<float> values = file.floats(accessor, static_cast<int>(width), place);
        if (!counted.empty() && found != count)
            file.fail(place + " has " + std::to_string(found) + " elements, " + counted + " " +
                      std::to_string(count));
        if (!std::ranges::all_of(values, [](float v) { return std::isfinite(v); }))
            file.fail(place + " has values that are not finite");
        count = found;
        counted = name;
        return values;
    };
    const std::vector<float> translations = read("TRANSLATION", 3), rotations = read("ROTATION", 4),
                             scales = read("SCALE", 3);
    if (counted.empty())
        file.fail(what + " EXT_mesh_gpu_instancing has none of TRANSLATION, ROTATION and SCALE");
    std::vector<Transform> places;
    places.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose;
        const auto take = [&](const std::vector<float>& from, auto& to) {
            if (!from.empty()) std::copy_n(from.data() + i * to.size(), to.size(), to.begin());
        };
        take(translations, pose.translation);
        take(rotations, pose.rotation);
        take(scales, pose.scale);
        if (std::ranges::all_of(pose.rotation, [](double v) { return v == 0; }))
            file.fail(what + " EXT_mesh_gpu_instancing: instance " + std::to_string(i) +
                      " has a rotation that is no quaternion");
        places.push_back(placeOf(pose));
    }
    return places;
}

}  // namespace vlx::render
