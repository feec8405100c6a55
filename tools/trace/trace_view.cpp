#include "trace/trace_view.h"

#include <algorithm>
#include <cmath>

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
    std::string names;
    for (const Camera& c : loaded.cameras) names += (names.empty() ? "'" : ", '") + c.name + "'";
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

}  // namespace

void chooseView(TraceOptions& o, const Scene& known) {
    if (std::ranges::all_of(known.cameras, [](const Camera& c) { return !c.unusable.empty(); })) return;
    o.render.camera = chosenCamera(o, known);
    setSize(o, known.cameras[o.render.camera]);
    if (o.crop.size() == 4) o.render.crop = Window{o.crop[0], o.crop[1], o.crop[2], o.crop[3]};
    if (const auto fault = o.render.validate(known)) throw CLI::ValidationError(*fault);
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
