#include "render/gltf/gltf_camera.h"

#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

namespace vlx::render {
namespace {

/// Of a picture's sides: no aspect is beyond it.
constexpr double kMostSide = 1 << 20;

/// Rotation and translation of a transform: cameras do not scale.
std::optional<Transform> rigid(const Transform& t) {
    Transform r = t;
    for (std::size_t j = 0; j < 3; ++j) {
        const double norm = std::sqrt(t.m[0][j] * t.m[0][j] + t.m[1][j] * t.m[1][j] + t.m[2][j] * t.m[2][j]);
        if (!(norm > 0) || !std::isfinite(norm)) return std::nullopt;
        for (std::size_t i = 0; i < 3; ++i) r.m[i][j] = t.m[i][j] / norm;
    }
    return r;
}

std::string is(const char* what, double value, const char* expected) {
    std::ostringstream text;
    text << "its " << what << " is " << value << ", expected " << expected;
    return text.str();
}

/// Why a perspective cannot be rendered with, or nothing.
std::string faultOf(const tinygltf::PerspectiveCamera& p, bool zeroAspect) {
    const auto fov = static_cast<float>(p.yfov);
    if (!(fov > std::numeric_limits<float>::epsilon() && fov < kPi))
        return is("yfov", p.yfov, "between 0 and pi");
    const bool given = p.aspectRatio != 0 || zeroAspect;
    if (given && !(p.aspectRatio >= 1 / kMostSide && p.aspectRatio <= kMostSide))
        return is("aspectRatio", p.aspectRatio, "2^-20 to 2^20");
    return {};
}

/// The same of an orthographic one.
std::string faultOf(const tinygltf::OrthographicCamera& o) {
    for (const auto& [name, half] : {std::pair{"xmag", o.xmag}, std::pair{"ymag", o.ymag}})
        if (!(half > 0 && std::isfinite(2 * static_cast<float>(half)))) return is(name, half, "more than 0");
    if (const double aspect = o.xmag / o.ymag; !(aspect >= 1 / kMostSide && aspect <= kMostSide))
        return is("xmag / ymag", aspect, "2^-20 to 2^20");
    return {};
}

}  // namespace

Camera readCamera(const GltfFile& file, const tinygltf::Node& node, const Transform& toWorld,
                  const Motion& motion, const std::optional<Course>& course) {
    const auto index = static_cast<std::size_t>(node.camera);
    const tinygltf::Camera& source = file.model().cameras[index];
    Camera camera;
    camera.name = node.name.empty() ? source.name : node.name;
    if (source.type == "orthographic") {
        camera.unusable = faultOf(source.orthographic);
        camera.orthographicHeight = static_cast<float>(2 * source.orthographic.ymag);
        camera.aspect = static_cast<float>(source.orthographic.xmag / source.orthographic.ymag);
    } else if (source.type != "perspective") {
        camera.unusable = "it is neither perspective nor orthographic";
    } else {
        camera.unusable = faultOf(source.perspective, file.zeroAspect(index));
        camera.verticalFov = static_cast<float>(source.perspective.yfov);
        camera.aspect = static_cast<float>(source.perspective.aspectRatio);
    }
    const auto place = rigid(toWorld);
    if (!place)
        camera.unusable = "its transform has no inverse";
    else if (!(maxComponent(absolute(place->point({0, 0, 0}))) <= kFarthest))
        camera.unusable = std::string("it is more than ") + kFarthestText + " from the origin";
    camera.toWorld = place.value_or(Transform{});
    camera.motion.cause = motion.cause;
    for (const Transform& at : motion.places) {
        const auto rigidPlace = rigid(at);
        if (!rigidPlace) camera.unusable = "its transform has no inverse while the shutter is open";
        camera.motion.places.push_back(rigidPlace.value_or(at));
    }
    if (camera.course = course; course)
        for (Motion* other : {&camera.course->before, &camera.course->after})
            for (Transform& at : other->places) at = rigid(at).value_or(at);  // without one it sees nothing
    const auto extra = [&](const char* key) {
        return number(node.extras, key, number(source.extras, key, 0));
    };
    camera.lensRadius = static_cast<float>(extra("lens_radius"));
    camera.focusDistance = static_cast<float>(extra("focus_distance"));
    if (camera.lensRadius > 0 && !(camera.focusDistance > 0))
        camera.unusable = "it has a lens_radius but no positive focus_distance";
    camera.preferred = extra("active") != 0;
    return camera;
}

}  // namespace vlx::render
