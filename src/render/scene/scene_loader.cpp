#include "render/scene/scene_loader.h"

#include <algorithm>
#include <map>

#include "render/gltf/gltf_animation.h"
#include "render/gltf/gltf_camera.h"
#include "render/gltf/gltf_check.h"
#include "render/gltf/gltf_file.h"
#include "render/gltf/gltf_geometry.h"
#include "render/gltf/gltf_material.h"
#include "variolux/base/error.h"

namespace vlx::render {
namespace {

/// Singular or not finite: meshes and lights there have no place.
bool usable(const Transform& t) {
    for (const auto& row : t.m)
        for (const double v : row)
            if (!std::isfinite(v)) return false;
    return std::abs(t.determinant()) > 0;
}

Transform localTransform(const GltfFile& file, const tinygltf::Node& node, const std::string& what) {
    Transform t;
    if (node.matrix.size() == 16) {
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 4; ++j) t.m[i][j] = node.matrix[j * 4 + i];
    } else {
        Pose pose;
        if (node.rotation.size() == 4)
            std::copy(node.rotation.begin(), node.rotation.end(), pose.rotation.begin());
        if (node.scale.size() == 3) std::copy(node.scale.begin(), node.scale.end(), pose.scale.begin());
        if (node.translation.size() == 3)
            std::copy(node.translation.begin(), node.translation.end(), pose.translation.begin());
        if (std::ranges::all_of(pose.rotation, [](double v) { return v == 0; }))
            file.fail(what + " has a rotation that is no quaternion");
        t = placeOf(pose);
    }
    for (const auto& row : t.m)
        for (const double v : row)
            if (!std::isfinite(v)) file.fail(what + " has a transform that is not finite");
    return t;
}

class Loader {
  public:
    Loader(const std::string& path, const Shutter& shutter, GltfFile::Use use = GltfFile::Use::Scene)
        : file_(path, use),
          model_(file_.model()),
          geometry_(file_, scene_),
          shutter_(shutter),
          animations_(file_, scene_.report.warnings) {
        scene_.name = path.substr(path.find_last_of('/') + 1);
        scene_.shutter = shutter;
        scene_.animations = model_.animations.size();
    }

    Scene load(const EnvironmentOptions& environment) {
        checkExtensions();
        readMaterials();
        const std::vector<Placed> placed = placedNodes();
        readCameras(placed);
        readNodes(placed);
        readEnvironment(environment);
        if (const std::string fault = cameraFault(placed); !fault.empty()) file_.fail(fault);
        if (scene_.shapes.empty() && !scene_.environment)
            file_.fail("has no triangles and no environment (give one with --env-constant or --env)");
        completeScene(scene_);
        const bool glows = std::ranges::any_of(
            scene_.shapes, [&](const Shape& shape) { return scene_.materials[shape.material].emissive(); });
        if (scene_.lights.empty() && !glows)
            file_.fail(
                "has no light: neither punctual lights nor emissive surfaces nor an environment (give one "
                "with "
                "--env-constant or --env)");
        return std::move(scene_);
    }

    Scene loadCameras() {
        const std::vector<Placed> placed = placedNodes();
        readCameras(placed);
        if (const std::string fault = cameraFault(placed); !fault.empty()) warn(fault);
        return std::move(scene_);
    }

  private:
    struct Placed {
        std::size_t node;
        Transform toWorld;  ///< in the middle of the exposure
        Motion motion;
    };
    struct Place {
        Transform toWorld;
        Motion motion;
    };

    void warn(const std::string& text) { scene_.report.warnings.push_back(text); }

    void checkExtensions() {
        for (const std::string& name : model_.extensionsUsed)
            if (!isSupported(name)) warn("the extension " + name + " is ignored");
        if (!model_.skins.empty()) warn("skins are left at rest");
    }

    void readMaterials() {
        MaterialReader reader(file_, scene_.textures);
        for (std::size_t i = 0; i < model_.materials.size(); ++i)
            scene_.materials.push_back(reader.read(model_.materials[i], i));
        scene_.materials.emplace_back();  // the specification's default material
    }

    /// A node's own transform at rest.
    Transform localOf(std::size_t node) const {
        return localTransform(file_, model_.nodes[node], described("node", node, model_.nodes[node].name));
    }

    /// What animates a node or one above it, or nothing.
    std::string movesBy(std::size_t node) const {
        for (auto n = static_cast<std::int64_t>(node); n >= 0; n = parents_[static_cast<std::size_t>(n)]) {
            std::string cause = animations_.causeOf(static_cast<std::size_t>(n));
            if (!cause.empty()) return cause;
        }
        return {};
    }

    Transform placeAt(std::size_t node, double seconds) const {
        Transform place;
        for (auto n = static_cast<std::int64_t>(node); n >= 0; n = parents_[static_cast<std::size_t>(n)]) {
            const auto i = static_cast<std::size_t>(n);
            place = (animations_.causeOf(i).empty() ? localOf(i) : animations_.local(i, seconds)) * place;
        }
        return place;
    }

    /// All nodes of the scene with their places, in the order of the file's trees.
    std::vector<Placed> placedNodes() {
        std::vector<int> roots;
        if (!model_.scenes.empty()) {
            const int which = model_.defaultScene >= 0 ? model_.defaultScene : 0;
            if (static_cast<std::size_t>(which) >= model_.scenes.size())
                file_.fail("refers to scene " + std::to_string(which) + ", it has " +
                           std::to_string(model_.scenes.size()));
            roots = model_.scenes[static_cast<std::size_t>(which)].nodes;
            sceneExtras_ = model_.scenes[static_cast<std::size_t>(which)].extras;
        }
        struct Pending {
            int node;
            Transform parent;
            std::int64_t parentNode;  ///< -1: a root
        };
        std::vector<Pending> stack;
        std::vector<char> visited(model_.nodes.size(), 0);
        parents_.assign(model_.nodes.size(), -1);
        std::vector<Placed> placed;
        for (auto r = roots.rbegin(); r != roots.rend(); ++r) stack.push_back({*r, {}, -1});
        while (!stack.empty()) {
            const Pending next = stack.back();
            stack.pop_back();
            if (next.node < 0 || static_cast<std::size_t>(next.node) >= model_.nodes.size())
                file_.fail("refers to node " + std::to_string(next.node) + ", it has " +
                           std::to_string(model_.nodes.size()));
            const auto index = static_cast<std::size_t>(next.node);
            const tinygltf::Node& node = model_.nodes[index];
            if (visited[index]++)
                file_.fail(described("node", index, node.name) + " has more than one parent");
            parents_[index] = next.parentNode;
            const std::string cause = movesBy(index);
            const Transform toWorld = cause.empty() ? next.parent * localOf(index)
                                                    : placeAt(index, 0.5 * (shutter_.open + shutter_.close));
            Motion motion;
            if (!cause.empty() && shutter_.close > shutter_.open) {
                motion = followed([&](double t) {
                    return placeAt(index, shutter_.open + t * (shutter_.close - shutter_.open));
                });
                motion.cause = cause;
            }
            placed.push_back({index, toWorld, std::move(motion)});
            for (auto c = node.children.rbegin(); c != node.children.rend(); ++c)
                stack.push_back({*c, toWorld, static_cast<std::int64_t>(index)});
        }
        return placed;
    }

    void readNodes(const std::vector<Placed>& placed) {
        std::map<std::size_t, std::vector<Place>> uses;  // mesh -> where
        std::vector<std::size_t> order;
        for (const auto& [index, toWorld, motion] : placed) {
            const tinygltf::Node& node = model_.nodes[index];
            const std::string what = described("node", index, node.name);
            if (const auto* light = extension(node.extensions, "KHR_lights_punctual")) {
                readLight(static_cast<int>(number(*light, "light", -1)), node, toWorld, what);
                if (motion.moves())
                    warn(what + ": its light stays where it is in the middle of the exposure");
            }
            if (node.mesh < 0) continue;
            const auto mesh = static_cast<std::size_t>(node.mesh);
            if (mesh >= model_.meshes.size())
                file_.fail(what + " refers to mesh " + std::to_string(mesh) + ", the file has " +
                           std::to_string(model_.meshes.size()));
            if (!usable(toWorld) || !std::ranges::all_of(motion.places, usable)) {
                warn(what + " has a transform without an inverse: its mesh is left out");
                continue;
            }
            if (uses[mesh].empty()) order.push_back(mesh);
            uses[mesh].push_back({toWorld, motion});
        }
        // Shapes of groups come after all others: group them at the end.
        std::vector<std::vector<Shape>> groups;
        for (const std::size_t mesh : order) {
            const auto& places = uses[mesh];
            const bool flat = places.size() == 1 || emissive(mesh);
            for (const Place& place : places) {
                if (!flat || place.motion.moves()) continue;
                const auto shapes = geometry_.read(mesh, place.toWorld);
                scene_.shapes.insert(scene_.shapes.end(), shapes.begin(), shapes.end());
            }
            if (flat && std::ranges::none_of(places, [](const Place& p) { return p.motion.moves(); }))
                continue;
            auto shapes = geometry_.read(mesh, {});
            if (shapes.empty()) continue;
            const auto group = static_cast<std::uint32_t>(groups.size());
            groups.push_back(std::move(shapes));
            for (const Place& place : places) {
                if (flat && !place.motion.moves()) continue;
                scene_.instances.push_back({group, place.toWorld, -1});
                if (!place.motion.moves()) continue;
                scene_.instances.back().motion = static_cast<std::int32_t>(scene_.motions.size());
                scene_.motions.push_back(place.motion);
            }
        }
        scene_.worldShapes = static_cast<std::uint32_t>(scene_.shapes.size());
        for (const auto& shapes : groups) {
            scene_.groups.push_back({static_cast<std::uint32_t>(scene_.shapes.size()),
                                     static_cast<std::uint32_t>(shapes.size())});
            scene_.shapes.insert(scene_.shapes.end(), shapes.begin(), shapes.end());
        }
    }

    bool emissive(std::size_t mesh) const {
        return std::ranges::any_of(model_.meshes[mesh].primitives, [&](const tinygltf::Primitive& p) {
            return p.material >= 0 && static_cast<std::size_t>(p.material) < scene_.materials.size() &&
                   scene_.materials[static_cast<std::size_t>(p.material)].emissive();
        });
    }

    void readCameras(const std::vector<Placed>& placed) {
        for (const auto& [index, toWorld, motion] : placed)
            if (model_.nodes[index].camera >= 0)
                scene_.cameras.push_back(readCamera(file_, model_.nodes[index], toWorld, motion));
        const auto firstOf = [&](auto which) {
            const auto found = std::ranges::find_if(scene_.cameras, which);
            return static_cast<std::size_t>(found == scene_.cameras.end() ? 0
                                                                          : found - scene_.cameras.begin());
        };
        scene_.wantedCamera = firstOf([](const Camera& c) { return c.preferred; });
        scene_.activeCamera = scene_.wantedCamera;
        if (!scene_.cameras.empty() && !scene_.cameras[scene_.wantedCamera].unusable.empty())
            scene_.activeCamera = firstOf([](const Camera& c) { return c.unusable.empty(); });
    }

    /// Why there is no camera to render from, or nothing.
    std::string cameraFault(const std::vector<Placed>& placed) const {
        constexpr const char* remedy =
            "; no option stands in for a camera: add a perspective one to the scene";
        if (model_.scenes.empty()) return "has no scene, and so no camera in one";
        std::string text;
        for (std::size_t i = 0; i < scene_.cameras.size(); ++i) {
            const Camera& c = scene_.cameras[i];
            if (c.unusable.empty()) return {};
            text += (i == 0 ? "has no camera that can be used: " : "; ") + described("camera", i, c.name) +
                    ": " + c.unusable;
        }
        if (!text.empty()) return text + remedy;
        for (std::size_t n = 0; n < model_.nodes.size(); ++n)
            if (model_.nodes[n].camera >= 0 && std::ranges::find(placed, n, &Placed::node) == placed.end())
                text += (text.empty() ? " (" : ", ") + described("node", n, model_.nodes[n].name);
        if (text.empty()) return std::string("has no camera") + remedy;
        return "has no camera in its scene " + std::to_string(std::max(0, model_.defaultScene)) +
               "; those of the file" + text +
               ") are not in it: move one there, or make theirs the file's `scene`";
    }

    void readLight(int index, const tinygltf::Node& node, const Transform& toWorld, const std::string& what) {
        if (index < 0 || static_cast<std::size_t>(index) >= model_.lights.size())
            file_.fail(what + " refers to light " + std::to_string(index) + ", the file has " +
                       std::to_string(model_.lights.size()));
        const tinygltf::Light& source = model_.lights[static_cast<std::size_t>(index)];
        Light light;
        light.name = node.name.empty() ? source.name : node.name;
        Rgb colour{1, 1, 1};
        if (source.color.size() == 3)
            colour = {static_cast<float>(source.color[0]), static_cast<float>(source.color[1]),
                      static_cast<float>(source.color[2])};
        light.intensity = colour * static_cast<float>(source.intensity);
        if (!isFinite(light.intensity) || light.intensity.x < 0 || light.intensity.y < 0 ||
            light.intensity.z < 0)
            file_.fail(what + ": the light's intensity must be finite and >= 0");
        if (isBlack(light.intensity)) {
            warn(what + ": the light has no power");
            return;
        }
        light.position = toWorld.point({0, 0, 0});
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
            if (directed) {
                const double inner = std::cos(source.spot.innerConeAngle);
                const double outer = std::cos(source.spot.outerConeAngle);
                const double scale = 1 / std::max(0.001, inner - outer);
                light.coneScale = static_cast<float>(scale);
                light.coneOffset = static_cast<float>(-outer * scale);
            }
        } else {
            file_.fail(what + ": the light's type is '" + source.type +
                       "', expected point, spot or directional");
        }
        scene_.lights.push_back(std::move(light));
    }

    void readEnvironment(const EnvironmentOptions& options) {
        if (options.constant) {
            scene_.environment = Environment(*options.constant);
        } else if (!options.image.empty()) {
            scene_.environment = loadEnvironment(options.image);
        } else if (sceneExtras_.IsObject() && sceneExtras_.Has("env_constant")) {
            const tinygltf::Value& v = sceneExtras_.Get("env_constant");
            const bool triple = v.IsArray() && v.ArrayLen() == 3 && v.Get(0).IsNumber() &&
                                v.Get(1).IsNumber() && v.Get(2).IsNumber();
            if (!triple) file_.fail("the scene's env_constant must be three numbers");
            const auto at = [&](int i) { return static_cast<float>(v.Get(i).GetNumberAsDouble()); };
            const Rgb radiance{at(0), at(1), at(2)};
            if (!isFinite(radiance) || radiance.x < 0 || radiance.y < 0 || radiance.z < 0)
                file_.fail("the scene's env_constant must be finite and >= 0");
            if (!isBlack(radiance)) scene_.environment = Environment(radiance);
        } else if (sceneExtras_.IsObject() && sceneExtras_.Has("envmap")) {
            warn("the scene names an environment image; give it with --env");
        }
    }

    GltfFile file_;
    const tinygltf::Model& model_;
    Scene scene_;
    GeometryReader geometry_;
    Shutter shutter_;
    Animations animations_;
    tinygltf::Value sceneExtras_;
    std::vector<std::int64_t> parents_;  ///< of each node; -1: a root
};

}  // namespace

Scene loadScene(const std::string& path, const EnvironmentOptions& environment, const Shutter& shutter) {
    return Loader(path, shutter).load(environment);
}

Scene loadCameras(const std::string& path, const Shutter& shutter) {
    return Loader(path, shutter, GltfFile::Use::Cameras).loadCameras();
}

}  // namespace vlx::render
