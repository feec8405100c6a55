#include "render/scene/scene_loader.h"

#include <algorithm>
#include <map>

#include "render/gltf/gltf_camera.h"
#include "render/gltf/gltf_extensions.h"
#include "render/gltf/gltf_file.h"
#include "render/gltf/gltf_geometry.h"
#include "render/gltf/gltf_instancing.h"
#include "render/gltf/gltf_light.h"
#include "render/gltf/gltf_material.h"
#include "render/gltf/gltf_nodes.h"
#include "render/gltf/gltf_variants.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx::render {
namespace {

/// Singular or not finite: meshes and lights there have no place.
bool usable(const Transform& t) {
    for (const auto& row : t.m)
        for (const double v : row)
            if (!std::isfinite(v)) return false;
    return std::abs(t.determinant()) > 0;
}

class Loader {
  public:
    Loader(const std::string& path, const Shutter& shutter, GltfFile::Use use = GltfFile::Use::Scene)
        : file_(path, use),
          model_(file_.model()),
          geometry_(file_, scene_),
          nodes_(file_, shutter, scene_.report.warnings),
          bends_(file_, nodes_) {
        scene_.name = path.substr(path.find_last_of('/') + 1);
        scene_.shutter = shutter;
        scene_.animations = model_.animations.size();
    }

    Scene load(const EnvironmentOptions& environment, const SceneChoices& choices) {
        if (!choices.variant.empty()) geometry_.setVariant(variantNamed(file_, choices.variant));
        checkExtensions();
        scene_.report.warnings.insert(scene_.report.warnings.end(), file_.warnings().begin(),
                                      file_.warnings().end());
        readMaterials();
        const std::vector<PlacedNode> placed = nodes_.placed();
        if (model_.scenes.empty()) file_.fail("has no scene");
        readCameras(placed);
        scene_.lastKey = nodes_.animations().lastKey();
        readNodes(placed, choices.lightUnits);
        readEnvironment(environment);
        if (scene_.shapes.empty() && !scene_.environment)
            file_.fail("has no triangles" + whyEmpty() +
                       " and no environment (give one with --env-constant or --env)");
        completeScene(scene_);
        const float reach =
            std::max(maxComponent(absolute(scene_.boundsMin)), maxComponent(absolute(scene_.boundsMax)));
        if (!(reach <= kFarthest))
            file_.fail("reaches " + formatted("%.3g", static_cast<double>(reach)) +
                       " m from the origin, expected at most " + kFarthestText +
                       ": see the scales and translations of its nodes");
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
        const std::vector<PlacedNode> placed = nodes_.placed();
        readCameras(placed);
        return std::move(scene_);
    }

  private:
    void warn(const std::string& text) { scene_.report.warnings.push_back(text); }

    /// What became of the triangles, where a message would otherwise leave one wondering.
    std::string whyEmpty() const {
        const auto& report = scene_.report;
        if (report.degenerateTriangles > 0)
            return " but " + std::to_string(report.degenerateTriangles) + " without area";
        return report.warnings.empty() ? "" : " (" + report.warnings.front() + ")";
    }

    void checkExtensions() {
        for (const std::string& name : model_.extensionsUsed)
            if (!isSupported(name)) warn("the extension " + name + " is ignored" + missingWithout(name));
    }

    void readMaterials() {
        MaterialReader reader(file_, scene_.textures);
        for (std::size_t i = 0; i < model_.materials.size(); ++i)
            scene_.materials.push_back(reader.read(model_.materials[i], i));
        scene_.materials.emplace_back();  // the specification's default material
    }

    /// Keeps the course of what the scene holds as it is in the world when `toWorld` is its place. Returns
    /// its number, or -1.
    std::int32_t keep(std::optional<Course> course, const Transform& toWorld) {
        const auto back = toWorld.inverse();
        if (!course || !back) return -1;
        for (Motion* motion : {&course->before, &course->after})
            for (Transform& place : motion->places) place = place * *back;
        scene_.courses.push_back(std::move(*course));
        return static_cast<std::int32_t>(scene_.courses.size()) - 1;
    }

    /// Of a light, which stays where it is in the middle of an exposure and is neither turned nor scaled.
    static std::optional<Course> shifts(const PlacedNode& place) {
        if (!place.course) return {};
        const auto shift = [&](const Motion& motion) -> Motion {
            Transform by;
            for (std::size_t i = 0; i < 3; ++i) by.m[i][3] = motion.at(0.5f).m[i][3] - place.toWorld.m[i][3];
            return {{by}, motion.cause};
        };
        return Course{shift(place.course->before), shift(place.course->after)};
    }

    void readNodes(const std::vector<PlacedNode>& placed, LightUnits units) {
        const LightReader lights(file_, nodes_.scene(), units);
        std::map<std::size_t, std::vector<PlacedNode>> uses;  // mesh -> where
        std::vector<std::size_t> order;
        for (const PlacedNode& place : placed) {
            const tinygltf::Node& node = model_.nodes[place.node];
            const std::string what = described("node", place.node, node.name);
            if (const auto* light = extension(node.extensions, "KHR_lights_punctual")) {
                readLight(lights, static_cast<int>(number(*light, "light", -1)), place, what);
            }
            if (node.mesh < 0) continue;
            const auto mesh = static_cast<std::size_t>(node.mesh);
            if (mesh >= model_.meshes.size())
                file_.fail(what + " refers to mesh " + std::to_string(mesh) + ", the file has " +
                           std::to_string(model_.meshes.size()));
            const std::vector<Transform> instances = instancesOf(file_, node, what);
            if (bends_.bends(place.node)) {
                if (instances.size() != 1) warn(what + " bends: its instances are left out");
                readBent(place);
                continue;
            }
            if (instances.size() > 1) checkCopies(mesh, instances.size(), what);
            for (const Transform& instance : instances) {
                PlacedNode own = place;
                setInside(own, instance);
                if (!usable(own.toWorld) || !std::ranges::all_of(own.motion.places, usable)) {
                    warn(what + " has a transform without an inverse: its mesh is left out");
                    continue;
                }
                if (uses[mesh].empty()) order.push_back(mesh);
                uses[mesh].push_back(std::move(own));
            }
        }
        if (!scene_.lights.empty()) {
            scene_.report.lightUnits = lights.units();
            if (!lights.told().empty()) scene_.report.notes.push_back(lights.told());
        }
        // Shapes of groups come after all others: group them at the end.
        std::vector<std::vector<Shape>> groups;
        for (const std::size_t mesh : order) {
            const auto& places = uses[mesh];
            const bool flat = places.size() == 1 || emissive(mesh);
            for (const PlacedNode& place : places) {
                if (!flat || place.motion.moves()) continue;
                auto shapes = geometry_.read(mesh, place.toWorld);
                const std::int32_t course = shapes.empty() ? -1 : keep(place.course, place.toWorld);
                for (Shape& shape : shapes) shape.course = course;
                scene_.shapes.insert(scene_.shapes.end(), shapes.begin(), shapes.end());
            }
            if (flat && std::ranges::none_of(places, [](const PlacedNode& p) { return p.motion.moves(); }))
                continue;
            auto shapes = geometry_.read(mesh, {});
            if (shapes.empty()) continue;
            const auto group = static_cast<std::uint32_t>(groups.size());
            groups.push_back(std::move(shapes));
            for (const PlacedNode& place : places) {
                if (flat && !place.motion.moves()) continue;
                scene_.instances.push_back({group, place.toWorld, -1, keep(place.course, {})});
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

    /// The place of an instance inside a node.
    static void setInside(PlacedNode& place, const Transform& instance) {
        place.toWorld = place.toWorld * instance;
        for (Transform& at : place.motion.places) at = at * instance;
        if (!place.course) return;
        for (Motion* motion : {&place.course->before, &place.course->after})
            for (Transform& at : motion->places) at = at * instance;
    }

    /// Meshes that shine are copied for each instance: not beyond some gigabytes.
    void checkCopies(std::size_t mesh, std::size_t copies, const std::string& what) const {
        constexpr std::size_t kMostVertices = std::size_t{1} << 26;
        if (!emissive(mesh)) return;
        std::size_t vertices = 0;
        for (const tinygltf::Primitive& p : model_.meshes[mesh].primitives)
            if (const auto found = p.attributes.find("POSITION"); found != p.attributes.end())
                vertices += model_.accessors[static_cast<std::size_t>(found->second)].count;
        if (vertices > kMostVertices / copies)
            file_.fail(what + " has " + std::to_string(copies) + " instances of a mesh that shines, of " +
                       std::to_string(vertices) +
                       " vertices: these are copied, 2^26 vertices at most; let an unlit or dark "
                       "material stand in");
    }

    /// A skinned or morphing mesh: in the world, as the scene has it at every moment.
    void readBent(const PlacedNode& place) {
        const auto mesh = static_cast<std::size_t>(model_.nodes[place.node].mesh);
        const auto shapes = geometry_.readBent(
            mesh, [&](int frame, double time) { return bends_.at(place.node, frame, time); },
            scene_.shutter.frame != 0, bends_.causeOf(place.node));
        scene_.shapes.insert(scene_.shapes.end(), shapes.begin(), shapes.end());
    }

    bool emissive(std::size_t mesh) const {
        return std::ranges::any_of(model_.meshes[mesh].primitives, [&](const tinygltf::Primitive& p) {
            return scene_
                .materials[geometry_.materialOf(p, described("mesh", mesh, model_.meshes[mesh].name))]
                .shines();
        });
    }

    void readCameras(const std::vector<PlacedNode>& placed) {
        for (const auto& [index, toWorld, motion, course] : placed)
            if (model_.nodes[index].camera >= 0)
                scene_.cameras.push_back(readCamera(file_, model_.nodes[index], toWorld, motion, course));
        const auto firstOf = [&](auto which) {
            const auto found = std::ranges::find_if(scene_.cameras, which);
            return static_cast<std::size_t>(found == scene_.cameras.end() ? 0
                                                                          : found - scene_.cameras.begin());
        };
        scene_.wantedCamera = firstOf([](const Camera& c) { return c.preferred; });
        scene_.activeCamera = scene_.wantedCamera;
        if (!scene_.cameras.empty() && !scene_.cameras[scene_.wantedCamera].unusable.empty())
            scene_.activeCamera = firstOf([](const Camera& c) { return c.unusable.empty(); });
        scene_.cameraFault = cameraFault(placed);
    }

    std::string cameraFault(const std::vector<PlacedNode>& placed) const {
        if (model_.scenes.empty()) return "has no scene, and so no camera in one";
        std::string text;
        for (std::size_t i = 0; i < scene_.cameras.size(); ++i) {
            const Camera& c = scene_.cameras[i];
            if (c.unusable.empty()) return {};
            text += (i == 0 ? "has no camera that can be used: " : "; ") + described("camera", i, c.name) +
                    ": " + c.unusable;
        }
        if (!text.empty()) return text;
        for (std::size_t n = 0; n < model_.nodes.size(); ++n)
            if (model_.nodes[n].camera >= 0 &&
                std::ranges::find(placed, n, &PlacedNode::node) == placed.end())
                text += (text.empty() ? " (" : ", ") + described("node", n, model_.nodes[n].name);
        if (text.empty()) return "has no camera";
        return "has no camera in its scene " + std::to_string(std::max(0, model_.defaultScene)) +
               "; those of the file" + text +
               ") are not in it: move one there, or make theirs the file's `scene`";
    }

    void readLight(const LightReader& reader, int index, const PlacedNode& place, const std::string& what) {
        std::optional<Light> light =
            reader.read(index, model_.nodes[place.node], place.toWorld, what, scene_.report.warnings);
        if (!light) return;
        if (light->type == LightType::Sphere) light->course = keep(shifts(place), {});
        scene_.lights.push_back(std::move(*light));
        if (place.motion.moves()) warn(what + ": its light stays where it is in the middle of the exposure");
    }

    void readEnvironment(const EnvironmentOptions& options) {
        const tinygltf::Value extras = nodes_.scene() != nullptr ? nodes_.scene()->extras : tinygltf::Value();
        if (options.constant) {
            scene_.environment = Environment(*options.constant);
        } else if (!options.image.empty()) {
            scene_.environment = loadEnvironment(options.image);
        } else if (extras.IsObject() && extras.Has("env_constant")) {
            const tinygltf::Value& v = extras.Get("env_constant");
            const bool triple = v.IsArray() && v.ArrayLen() == 3 && v.Get(0).IsNumber() &&
                                v.Get(1).IsNumber() && v.Get(2).IsNumber();
            if (!triple) file_.fail("the scene's env_constant must be three numbers");
            const auto at = [&](int i) { return static_cast<float>(v.Get(i).GetNumberAsDouble()); };
            const Rgb radiance{at(0), at(1), at(2)};
            if (!isFinite(radiance) || radiance.x < 0 || radiance.y < 0 || radiance.z < 0)
                file_.fail("the scene's env_constant must be finite and >= 0");
            if (!isBlack(radiance)) scene_.environment = Environment(radiance);
        } else if (extras.IsObject() && extras.Has("envmap")) {
            warn("the scene names an environment image; give it with --env");
        }
    }

    GltfFile file_;
    const tinygltf::Model& model_;
    Scene scene_;
    GeometryReader geometry_;
    NodeTree nodes_;
    Bends bends_;
};

}  // namespace

Scene loadScene(const std::string& path, const EnvironmentOptions& environment, const Shutter& shutter,
                const SceneChoices& choices) {
    return Loader(path, shutter).load(environment, choices);
}

Scene loadCameras(const std::string& path, const Shutter& shutter) {
    return Loader(path, shutter, GltfFile::Use::Cameras).loadCameras();
}

}  // namespace vlx::render
