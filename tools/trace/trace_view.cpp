#include "trace/trace_view.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "render/scene/camera_placement.h"
#include "trace/trace_report.h"
#include "variolux/base/error.h"

namespace vlx::render {

namespace {

std::size_t chosenCamera(const TraceOptions& o, const Scene& loaded) {
    if (o.camera.empty()) {
        const auto named = [&](std::size_t i) {
            const std::string& name = loaded.cameras[i].name;
            return "camera " + std::to_string(i) + (name.empty() ? "" : " '" + name + "'");
        };
        if (loaded.activeCamera != loaded.wantedCamera)
            note(o, "warning: " + named(loaded.wantedCamera) +
                        " cannot be used: " + loaded.cameras[loaded.wantedCamera].unusable + "; " +
                        named(loaded.activeCamera) + " is taken (--camera takes another)");
        return loaded.activeCamera;
    }
    for (std::size_t i = 0; i < loaded.cameras.size(); ++i)
        if (loaded.cameras[i].name == o.camera) return i;
    const bool isNumber =
        o.camera.find_first_not_of("0123456789") == std::string::npos && o.camera.size() < 9;
    if (isNumber && std::stoul(o.camera) < loaded.cameras.size()) return std::stoul(o.camera);
    if (loaded.cameras.empty())
        throw Error(o.scene, "has no camera '" + o.camera + "', and no other; without --camera one is made");
    std::string names;
    for (std::size_t i = 0; i < loaded.cameras.size(); ++i)
        names += (i == 0 ? "" : ", ") + std::to_string(i) +
                 (loaded.cameras[i].name.empty() ? "" : " '" + loaded.cameras[i].name + "'");
    throw Error(o.scene, "has no camera '" + o.camera + "'; it has " + names);
}

void setSize(TraceOptions& o, const Camera& chosen) {
    const double aspect = chosen.aspect > 0 ? static_cast<double>(chosen.aspect) : 1.0;
    const auto derived = [&](double side, const char* option) {
        if (!(side < (1 << 20) + 0.5))
            throw Error(o.scene, "the camera's aspectRatio of " + std::to_string(aspect) + " makes " +
                                     std::to_string(side) + " pixels, expected at most 2^20: give " + option);
        return std::max(1, static_cast<int>(std::lround(side)));
    };
    if (o.width == 0) o.width = o.height == 0 ? 512 : derived(o.height * aspect, "--width");
    if (o.height == 0) o.height = derived(o.width / aspect, "--height");
    o.render.width = o.width;
    o.render.height = o.height;
}

/// As short as reads back as the same.
std::string textOf(float value) {
    char text[32];
    return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string textOf(const Vec3& v) { return textOf(v.x) + "," + textOf(v.y) + "," + textOf(v.z); }

std::pair<Vec3, Vec3> boxOf(const TraceOptions& o, const Scene& loaded, const Shutter& first) {
    if (loaded.shapes.empty())
        throw Error(o.scene,
                    (loaded.cameraFault.empty() ? "" : loaded.cameraFault + "; and it ") +
                        "has no triangles to place a camera by: give --camera-position and --look-at");
    if (!o.frame) return {loaded.boundsMin, loaded.boundsMax};
    const Shutter all{first.open, std::max(first.close, loaded.lastKey)};
    const Scene course = loadScene(o.scene, o.environment, all, {o.lightUnits, o.variant});
    return {course.boundsMin, course.boundsMax};
}

}  // namespace

void chooseView(TraceOptions& o, Scene known) {
    if (o.camera.empty() && !known.cameraFault.empty()) {
        o.render.camera = known.cameras.size();
        known.cameras.emplace_back();
    } else {
        o.render.camera = chosenCamera(o, known);
    }
    setSize(o, known.cameras[o.render.camera]);
    if (o.crop.size() == 4) o.render.crop = Window{o.crop[0], o.crop[1], o.crop[2], o.crop[3]};
    if (const auto fault = o.render.validate(known)) throw CLI::ValidationError(*fault);
}

void placeCamera(const TraceOptions& o, Scene& loaded, const Shutter& first) {
    const bool made = o.render.camera == loaded.cameras.size();
    const bool placed = !o.position.empty(), turned = !o.target.empty();
    Viewpoint view;
    if (o.verticalDegrees > 0) view.verticalDegrees = o.verticalDegrees;
    if ((made || placed) && !(placed && turned)) {
        const auto [low, high] = boxOf(o, loaded, first);
        if (placed)
            view.target = (low + high) * 0.5f;
        else
            view = framed(low, high, o.render.width / static_cast<double>(o.render.height),
                          view.verticalDegrees);
    }
    if (placed) view.position = {o.position[0], o.position[1], o.position[2]};
    if (turned) view.target = {o.target[0], o.target[1], o.target[2]};
    if (made) {
        loaded.cameras.emplace_back();
        loaded.cameras.back().name = "made";
    }
    Camera& camera = loaded.cameras[o.render.camera];
    if (made || o.verticalDegrees > 0) {
        camera.verticalFov = view.verticalDegrees * (kPi / 180);
        camera.orthographicHeight = 0;
    }
    const bool still = made || placed;
    if (still ? view.position == view.target : turned && !turnTowards(camera, view.target))
        throw CLI::ValidationError("--look-at",
                                   "expected another place than the camera's, found " + textOf(view.target));
    if (still) {
        camera.motion = {};
        camera.course.reset();
        camera.toWorld = lookingAt(view.position, view.target);
    }
    if (made && o.tellsView && !(placed && turned && o.verticalDegrees > 0))
        note(o, loaded.cameraFault + ": one is made, --camera-position " + textOf(view.position) +
                    " --look-at " + textOf(view.target) + " --fov " + textOf(view.verticalDegrees));
}

void takeSizeOf(TraceOptions& o, const EarlierDump& earlier) {
    o.render.earlier = &earlier;
    const DumpHeader& header = earlier.header();
    if (o.width == 0 && o.height == 0) {
        o.width = header.display.width;
        o.height = header.display.height;
    }
    if (o.crop.empty() && header.data != header.display)
        o.crop = {header.data.x, header.data.y, header.data.width, header.data.height};
}

}  // namespace vlx::render
