#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vlx::render {

/// What a picture may call for.
enum class Effect : std::uint8_t {
    Diffuse,
    Glossy,
    Mirror,
    Transmission,
    RoughTransmission,
    Absorption,
    Clearcoat,
    Sheen,
    Textures,
    NormalMaps,
    Alpha,
    EmissiveMeshes,
    Unlit,
    PunctualLights,
    SphereLights,
    Environment,
    DepthOfField,
    CameraMotion,
    ObjectMotion,
    Indirect,
    Caustics
};

inline constexpr std::array<std::string_view, 21> kEffectNames = {
    "diffuse",     "glossy",          "mirror",        "transmission",    "rough_transmission",
    "absorption",  "clearcoat",       "sheen",         "textures",        "normal_maps",
    "alpha",       "emissive_meshes", "unlit",         "punctual_lights", "sphere_lights",
    "environment", "depth_of_field",  "camera_motion", "object_motion",   "indirect",
    "caustics"};
inline constexpr std::size_t kEffects = kEffectNames.size();

constexpr std::string_view nameOf(Effect effect) { return kEffectNames[static_cast<std::size_t>(effect)]; }
std::optional<Effect> effectNamed(std::string_view name);

/// A set of effects.
class EffectSet {
  public:
    EffectSet() = default;
    static EffectSet all() {
        EffectSet s;
        s.bits_.set();
        return s;
    }
    bool has(Effect e) const { return bits_[static_cast<std::size_t>(e)]; }
    bool hasAny(std::initializer_list<Effect> effects) const {
        for (const Effect e : effects)
            if (has(e)) return true;
        return false;
    }
    void set(Effect e, bool value = true) { bits_[static_cast<std::size_t>(e)] = value; }
    bool none() const { return bits_.none(); }
    bool operator==(const EffectSet&) const = default;

  private:
    std::bitset<kEffects> bits_;
};

/// What the person asks for: what the scene calls for, less some effects, or everything.
struct EffectRequest {
    bool all = false;
    EffectSet without;
};

/// Reads "auto", "all", or "auto,-NAME,-NAME...". Nothing, with the fault in `broken`, when it is neither.
std::optional<EffectRequest> parseEffects(std::string_view text, std::string& broken);

}  // namespace vlx::render
