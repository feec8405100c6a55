#include "render/plan/plan.h"

#include <algorithm>

#include "render/plan/material_range.h"
#include "render/plan/reach.h"

namespace vlx::render {
namespace {

constexpr std::array kLightEffects{Effect::EmissiveMeshes, Effect::PunctualLights, Effect::SphereLights,
                                   Effect::Environment};

std::string quoted(const std::string& kind, const std::string& name, std::size_t index) {
    return kind + " " + (name.empty() ? std::to_string(index) : "'" + name + "'");
}

/// What calls for an effect, in words, or why nothing does.
struct Finding {
    bool called = false;
    std::string reason;
};

class Analysis {
  public:
    Analysis(const Scene& scene, const PlanOptions& options)
        : scene_(scene),
          options_(options),
          camera_(scene.cameras[options.camera]),
          ranges_(scene),
          reach_(scene, ranges_, options),
          shaded_(scene.materials.size(), 0),
          met_(scene.materials.size(), 0) {
        for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
            const std::uint32_t m = scene.shapes[i].material;
            shaded_[m] = shaded_[m] || reach_.shaded(i);
            met_[m] = met_[m] || reach_.met(i);
        }
        for (const Light& light : scene.lights) idle_.push_back(reach_.idle(light));
    }

    Finding find(Effect effect) const {
        using R = MaterialRange;
        switch (effect) {
            case Effect::Diffuse:
                return surface(&R::diffuse, "reflects diffusely");
            case Effect::Glossy:
                return surface(&R::glossy, "has a rough reflection");
            case Effect::Mirror:
                return surface(&R::mirror, "reflects like a mirror");
            case Effect::Transmission:
                return surface(&R::transmission, "is smooth and transmits light");
            case Effect::RoughTransmission:
                return surface(&R::roughTransmission, "is rough and transmits light");
            case Effect::Absorption:
                return surface(&R::absorption, "absorbs light inside");
            case Effect::Clearcoat:
                return surface(&R::clearcoat, "has a clear coat");
            case Effect::Sheen:
                return surface(&R::sheen, "has sheen");
            case Effect::Textures:
                return textures();
            case Effect::NormalMaps:
                return surface(&R::normalMapped, "has a normal map");
            case Effect::Alpha:
                return material(
                    met_, [&](std::size_t m) { return ranges_.of(m).seeThrough; },
                    "lets rays through by its opacity");
            case Effect::EmissiveMeshes:
                return emissiveMeshes();
            case Effect::Unlit:
                return material(
                    met_, [&](std::size_t m) { return scene_.materials[m].unlit; },
                    "shows its colour, whatever the light");
            case Effect::PunctualLights:
                return light("punctual light", [](LightType t) {
                    return t == LightType::Point || t == LightType::Spot || t == LightType::Directional;
                });
            case Effect::SphereLights:
                return light("sphere light", [](LightType t) { return t == LightType::Sphere; });
            case Effect::Environment:
                return environment();
            case Effect::DepthOfField:
                if (camera_.lensRadius > 0)
                    return {true, cameraName() + " has a lens of radius " + number(camera_.lensRadius)};
                return {false, cameraName() + " is a pinhole"};
            case Effect::CameraMotion:
                if (camera_.motion.moves())
                    return {true, cameraName() + " moves while the shutter is open: " + camera_.motion.cause};
                return {false, cameraName() + still()};
            case Effect::ObjectMotion:
                return objectMotion();
            case Effect::Indirect:
                return indirect();
            case Effect::Caustics:
                return caustics();
        }
        return {};
    }

    /// Misses have the alpha to tell them; whatever shines counts, being white in the dump.
    RecordedFeatures features() const {
        const Material* first = nullptr;
        for (const Light& light : scene_.lights)
            if (light.type == LightType::Sphere) return {};
        for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
            if (!reach_.shaded(i)) continue;
            const Shape& shape = scene_.shapes[i];
            const Material& m = scene_.materials[shape.material];
            if (!ranges_.of(shape.material).onlyDiffuse() || m.emissive() || m.baseColourTexture ||
                shape.firstColour >= 0)
                return {};
            if (first == nullptr) first = &m;
            if (!(m.baseColour == first->baseColour)) return {};
        }
        if (first == nullptr) return {false, false, "there is nothing in sight"};
        return {false, true, "all surfaces have one colour"};
    }

    RecordedMotion motion() const {
        if (scene_.shutter.frame == 0) return {false, "the picture is none of a sequence"};
        const auto moves = [](const std::string& what, const Course& course) -> RecordedMotion {
            return {true, what + " from frame to frame: " + course.after.cause};
        };
        if (camera_.course) return moves(cameraName() + " moves", *camera_.course);
        const auto& courses = scene_.courses;
        for (std::size_t i = 0; i < scene_.worldShapes; ++i)
            if (const std::int32_t c = scene_.shapes[i].course; c >= 0 && reach_.seen(i))
                return moves("something in sight moves", courses[static_cast<std::size_t>(c)]);
        for (std::size_t i = 0; i < scene_.worldShapes; ++i)
            if (const Deformation* d = deformationOf(i); d && d->neighbourSteps > 0 && reach_.seen(i))
                return {true, "something in sight deforms from frame to frame: " + d->cause};
        for (const Instance& instance : scene_.instances) {
            if (instance.course < 0) continue;
            const Group& group = scene_.groups[instance.group];
            for (std::size_t i = group.firstShape; i < group.firstShape + group.shapes; ++i)
                if (reach_.seen(i))
                    return moves("something in sight moves",
                                 courses[static_cast<std::size_t>(instance.course)]);
        }
        for (std::size_t i = 0; i < scene_.lights.size(); ++i)
            if (const std::int32_t c = scene_.lights[i].course; c >= 0)
                return moves(lightName(i) + " moves", courses[static_cast<std::size_t>(c)]);
        const bool still = courses.empty() && std::ranges::none_of(scene_.deformations, [](const auto& d) {
                               return d.neighbourSteps > 0;
                           });
        return {false,
                still ? "nothing moves from frame to frame" : "nothing in sight moves from frame to frame"};
    }

    std::string whyIdle(std::size_t light) const {
        return lightName(light) + " does nothing: " + idle_[light];
    }

    std::vector<std::size_t> idleLights() const {
        std::vector<std::size_t> list;
        for (std::size_t i = 0; i < idle_.size(); ++i)
            if (!idle_[i].empty()) list.push_back(i);
        return list;
    }

    /// Whether a path can meet what does not show without light.
    bool needsLight() const {
        bool unlit = false;
        for (std::size_t m = 0; m < met_.size(); ++m) {
            if (met_[m] && !scene_.materials[m].unlit) return true;
            unlit = unlit || met_[m];
        }
        return !unlit;
    }

  private:
    const Deformation* deformationOf(std::size_t shape) const {
        const std::int32_t d = scene_.shapes[shape].deformation;
        return d < 0 ? nullptr : &scene_.deformations[static_cast<std::size_t>(d)];
    }
    static std::string number(double v) {
        std::string text = std::to_string(v);
        text.erase(text.find_last_not_of('0') + 1);
        if (text.back() == '.') text.pop_back();
        return text;
    }
    std::string cameraName() const { return quoted("camera", camera_.name, options_.camera); }
    std::string materialName(std::size_t m) const { return quoted("material", scene_.materials[m].name, m); }
    std::string lightName(std::size_t i) const { return quoted("light", scene_.lights[i].name, i); }

    std::string still() const {
        if (scene_.animations == 0) return " does not move: there is no animation";
        return " does not move" + exposure();
    }
    std::string exposure() const {
        return " while the shutter is open (" + number(scene_.shutter.open) + " to " +
               number(scene_.shutter.close) + " s)";
    }

    /// The first material of those `in` reach that `has` it; or the one out of reach that would.
    template <class Has>
    Finding material(const std::vector<char>& in, Has has, const std::string& what) const {
        std::optional<std::size_t> outside;
        for (std::size_t m = 0; m < scene_.materials.size(); ++m) {
            if (!has(m)) continue;
            if (in[m]) return {true, materialName(m) + " " + what};
            // The default material, last, is there whether anything has it or not.
            if (!outside && m + 1 < scene_.materials.size()) outside = m;
        }
        if (outside) return {false, "no path can meet " + materialName(*outside) + ", which " + what};
        return {false, "no material " + what};
    }
    Finding surface(bool MaterialRange::*lobe, const std::string& what) const {
        return material(
            shaded_, [&](std::size_t m) { return ranges_.of(m).*lobe; }, what);
    }

    Finding textures() const {
        const auto kinds = [&](std::size_t i) {
            const Material& m = scene_.materials[i];
            std::string list;
            const auto add = [&](const TextureRef& ref, const char* name) {
                if (ref) list += (list.empty() ? "" : ", ") + std::string(name);
            };
            add(m.baseColourTexture, "base colour");
            add(m.metallicRoughnessTexture, "metallic and roughness");
            add(m.transmissionTexture, "transmission");
            add(m.specularTexture, "specular");
            add(m.specularColourTexture, "specular colour");
            add(m.clearcoatTexture, "clear coat");
            add(m.clearcoatRoughnessTexture, "clear coat's roughness");
            add(m.sheenColourTexture, "sheen colour");
            add(m.sheenRoughnessTexture, "sheen's roughness");
            if (m.emissive()) add(m.emissionTexture, m.unlit ? "colour" : "emission");
            return list;
        };
        Finding f = material(
            met_, [&](std::size_t m) { return !kinds(m).empty(); }, "has textures");
        for (std::size_t m = 0; f.called && m < scene_.materials.size(); ++m)
            if (met_[m] && !kinds(m).empty()) return {true, materialName(m) + " has textures: " + kinds(m)};
        return f;
    }

    /// The first light of a type that reaches something.
    template <class Is>
    Finding light(const std::string& kind, Is is) const {
        std::string outside;
        for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
            if (!is(scene_.lights[i].type)) continue;
            if (idle_[i].empty()) return {true, lightName(i) + " shines"};
            if (outside.empty()) outside = whyIdle(i);
        }
        return {false, outside.empty() ? "there is no " + kind : outside};
    }

    Finding emissiveMeshes() const {
        Finding f = light("emissive mesh", [](LightType t) { return t == LightType::Mesh; });
        if (f.called) {
            for (std::size_t i = 0; i < scene_.lights.size(); ++i)
                if (scene_.lights[i].type == LightType::Mesh && idle_[i].empty())
                    return {true, materialName(scene_.shapes[scene_.lights[i].shape].material) + " shines"};
        }
        for (std::size_t i = 0; i < scene_.shapes.size(); ++i)
            if (movingEmitter(i))
                return {true, materialName(scene_.shapes[i].material) + " shines and moves"};
        return f;
    }
    bool movingEmitter(std::size_t shape) const {
        const Shape& s = scene_.shapes[shape];
        return s.light < 0 && scene_.materials[s.material].shines() && reach_.met(shape);
    }

    Finding environment() const {
        if (!scene_.environment) return {false, "there is no environment"};
        if (isBlack(scene_.environment.mean())) return {false, "the environment is black"};
        return {true, scene_.environment.isConstant() ? "the environment has constant radiance"
                                                      : "the environment is an image"};
    }

    Finding objectMotion() const {
        for (const Instance& instance : scene_.instances) {
            if (instance.motion < 0) continue;
            const Group& group = scene_.groups[instance.group];
            for (std::size_t i = group.firstShape; i < group.firstShape + group.shapes; ++i)
                if (reach_.met(i))
                    return {true, scene_.motions[static_cast<std::size_t>(instance.motion)].cause};
        }
        for (std::size_t i = 0; i < scene_.worldShapes; ++i)
            if (const Deformation* d = deformationOf(i); d && d->moves() && reach_.met(i))
                return {true, d->cause};
        if (!scene_.motions.empty() || std::ranges::any_of(scene_.deformations, &Deformation::moves))
            return {false, "no path can meet what moves"};
        return {false, scene_.animations == 0 ? "nothing moves: there is no animation"
                                              : "no animation moves anything" + exposure()};
    }

    Finding indirect() const {
        if (options_.maxBounces < 2) return {false, "--max-bounces allows a single scattering"};
        for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
            const std::uint32_t m = scene_.shapes[i].material;
            if (!reach_.seen(i) || !ranges_.of(m).scatters()) continue;
            if (!reach_.indirect()) return {false, "all that scatters lies in one plane"};
            return {true, materialName(m) + " scatters light that other surfaces may have scattered"};
        }
        return {false, "nothing that the camera sees scatters light"};
    }

    Finding caustics() const {
        if (!reach_.indirect()) return {false, "there is no indirect light"};
        const auto first = [&](auto has) -> std::optional<std::size_t> {
            for (std::size_t m = 0; m < scene_.materials.size(); ++m)
                if (shaded_[m] && has(ranges_.of(m))) return m;
            return std::nullopt;
        };
        const auto caster = first([](const MaterialRange& r) { return r.mirror || r.transmission; });
        if (!caster) return {false, "nothing that a path can meet is smooth"};
        const auto receiver = first([](const MaterialRange& r) { return r.spreads(); });
        if (!receiver) return {false, "nothing that a path can meet receives them"};
        const std::string way = materialName(*caster) + " casts light of ";
        std::string punctual;
        for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
            if (!idle_[i].empty()) continue;
            const LightType type = scene_.lights[i].type;
            if (type == LightType::Mesh || type == LightType::Sphere || type == LightType::Environment)
                return {true, way + lightName(i) + " on " + materialName(*receiver)};
            if (punctual.empty()) punctual = lightName(i);
        }
        for (std::size_t i = 0; i < scene_.shapes.size(); ++i)
            if (movingEmitter(i))
                return {true,
                        way + materialName(scene_.shapes[i].material) + " on " + materialName(*receiver)};
        if (punctual.empty()) return {false, "there is no light"};
        return {false, punctual + " has no extent: no path finds it by way of " + materialName(*caster)};
    }

    const Scene& scene_;
    const PlanOptions& options_;
    const Camera& camera_;
    MaterialRanges ranges_;
    Reach reach_;
    std::vector<char> shaded_;  ///< materials whose lobes matter
    std::vector<char> met_;     ///< materials that a ray can hit
    std::vector<std::string> idle_;
};

}  // namespace

bool Plan::lit() const {
    return std::ranges::any_of(kLightEffects, [&](Effect e) { return of(e).called && of(e).planned; });
}

std::vector<std::string> Plan::simulated() const {
    std::vector<std::string> names;
    for (const PlannedEffect& e : effects)
        if (e.called && e.planned) names.emplace_back(nameOf(e.effect));
    return names;
}

Plan planEffects(const Scene& scene, const PlanOptions& options) {
    const Analysis analysis(scene, options);
    Plan plan;
    plan.general = options.request.all;
    for (std::size_t i = 0; i < kEffects; ++i) {
        const auto effect = static_cast<Effect>(i);
        const Finding finding = analysis.find(effect);
        const bool unwanted = options.request.without.has(effect);
        PlannedEffect& e = plan.effects[i];
        e = {effect, finding.called, (finding.called && !unwanted) || plan.general, finding.reason};
        plan.called.set(effect, e.called);
        plan.planned.set(effect, e.planned);
        if (!e.called || !unwanted) continue;
        plan.leftOut.set(effect);
        e.reason = "left out by --effects, although " + finding.reason;
        plan.warnings.push_back("the image is biased: " + std::string(nameOf(effect)) +
                                " left out, although " + finding.reason);
    }
    if (analysis.needsLight() &&
        std::ranges::none_of(kLightEffects, [&](Effect e) { return plan.called.has(e); })) {
        const auto idle = analysis.idleLights();
        plan.warnings.push_back(
            "no light reaches anything, and " +
            std::string(plan.called.has(Effect::Unlit) ? "all that is not unlit" : "the picture") +
            " is black" + (idle.empty() ? "" : " (" + analysis.whyIdle(idle.front()) + ")") +
            ": --env-constant 1,1,1 or --env IMAGE lights it from all around");
    }
    plan.motion = analysis.motion();
    if (plan.general) return plan;
    plan.idleLights = analysis.idleLights();
    if (plan.leftOut.none()) plan.features = analysis.features();
    return plan;
}

}  // namespace vlx::render
