#include "trace/trace_report.h"

#include <cmath>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "render/pilot/pilot.h"
#include "tool_main.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx::render {

void note(const TraceOptions& o, const std::string& text) { say(o.scene + ": " + text); }

int printCameras(const TraceOptions& o, const Scene& loaded) {
    for (const std::string& warning : loaded.report.warnings) note(o, "warning: " + warning);
    if (!loaded.cameraFault.empty())
        note(o, loaded.cameraFault +
                    ": one is made that has the whole scene in its picture, from 45 degrees to the right of "
                    "the front (+z) and 22.5 up (rendering and --explain tell its --camera-position, "
                    "--look-at and --fov)");
    for (std::size_t i = 0; i < loaded.cameras.size(); ++i) {
        const Camera& c = loaded.cameras[i];
        std::cout << i << "  " << c.name
                  << (i == loaded.activeCamera && c.unusable.empty() ? "  (active)" : "")
                  << (c.unusable.empty() ? "" : "  unusable: " + c.unusable) << "\n";
    }
    return kDone;
}

int printPlan(const TraceOptions& o, const Scene& loaded, const Plan& plan, const IntegratorChoice& choice) {
    const auto [shares, hits] = pilotEffects(loaded, plan, o.render);
    if (o.explain == "json") {
        nlohmann::ordered_json list = nlohmann::ordered_json::array();
        for (const PlannedEffect& e : plan.effects) {
            nlohmann::ordered_json j{
                {"name", nameOf(e.effect)}, {"planned", e.planned}, {"reason", e.reason}};
            const auto share = shares[static_cast<std::size_t>(e.effect)];
            if (share) j["share"] = std::round(*share * 1000) / 1000;
            list.push_back(std::move(j));
        }
        const nlohmann::ordered_json features{{"albedo", plan.features.albedo},
                                              {"normal", plan.features.normalAndDepth},
                                              {"depth", plan.features.normalAndDepth}};
        nlohmann::ordered_json met = nlohmann::ordered_json::array();
        for (std::size_t k = 0; k < hits.size(); ++k)
            if (hits[k] > 0)
                met.push_back({{"kernel", kKernelNames[k]}, {"share", std::round(hits[k] * 1000) / 1000}});
        const nlohmann::ordered_json chosen{{"chosen", nameOf(choice.chosen)}, {"reason", choice.reason}};
        std::cout << nlohmann::ordered_json{{"effects", list},
                                            {"hits", met},
                                            {"lights", loaded.lights.size()},
                                            {"recorded", features},
                                            {"integrator", chosen}}
                         .dump(2)
                  << "\n";
        return kDone;
    }
    std::printf("%-19s%-9s%-7s%s\n", "effect", "planned", "cost", "reason");
    for (const PlannedEffect& e : plan.effects) {
        const auto share = shares[static_cast<std::size_t>(e.effect)];
        const std::string cost = share ? std::to_string(std::lround(*share * 100)) + " %" : "";
        std::printf("%-19s%-9s%-7s%s\n", std::string(nameOf(e.effect)).c_str(), e.planned ? "yes" : "no",
                    cost.c_str(), e.reason.c_str());
    }
    std::string met;
    for (std::size_t k = 0; k < hits.size(); ++k)
        if (hits[k] > 0)
            met += (met.empty() ? "" : "; ") + std::to_string(std::lround(hits[k] * 100)) + " % " +
                   std::string(kKernelNames[k]);
    if (!met.empty()) std::printf("surfaces that paths meet: %s\n", met.c_str());
    if (!plan.features.albedo)
        std::printf("not recorded: %s, %s\n",
                    plan.features.normalAndDepth ? "albedo" : "albedo, normal and depth",
                    plan.features.reason.c_str());
    std::printf("integrator %s: %s\n", std::string(nameOf(choice.chosen)).c_str(), choice.reason.c_str());
    return kDone;
}

int printSkipped(const TraceOptions& o) {
    if (o.json)
        std::cout << nlohmann::ordered_json{{"scene", o.scene}, {"dump", o.dump}, {"skipped", true}}.dump(2)
                  << "\n";
    return kDone;
}

void warnOfBacks(const TraceOptions& o, const Scene& loaded, const Accelerator& accelerator) {
    constexpr int kAcross = 32;
    const View view(loaded.cameras[o.render.camera], o.render.width, o.render.height);
    int met = 0, hidden = 0;
    for (int y = 0; y < kAcross; ++y)
        for (int x = 0; x < kAcross; ++x) {
            const Ray ray =
                view.ray((static_cast<float>(x) + 0.5f) / kAcross * static_cast<float>(o.render.width),
                         (static_cast<float>(y) + 0.5f) / kAcross * static_cast<float>(o.render.height),
                         {0.5f, 0.5f}, 0.5f);
            const auto first = accelerator.intersectBothSides(ray, 0);
            if (!first) continue;
            ++met;
            const auto seen = accelerator.intersect(ray, 0);
            hidden += !seen || seen->distance > first->distance;
        }
    if (2 * hidden <= met) return;
    note(o, "warning: " + std::to_string(100 * hidden / met) +
                " % of what is in the picture shows its back, and is not seen: the surfaces have one side. "
                "Where that is not meant, turn their triangles round, or set their materials' doubleSided");
}

void warnOfBrightness(const TraceOptions& o, const Scene& loaded, const RenderReport& report) {
    constexpr double kBrightest = 100, kDarkest = 0.001;
    const double mean = report.meanLuminance;
    // A part of the picture may well be dark, and a scene without light was told of.
    if (o.render.crop || o.render.band.count > 1 || !o.render.plan->lit()) return;
    if (mean >= kDarkest && mean <= kBrightest) return;
    const bool bright = mean > kBrightest;
    const LightUnits units = loaded.report.lightUnits;
    std::string remedy;
    if (mean == 0)
        remedy = "nothing that it shows is lit; --env-constant 1,1,1 lights it from all around";
    else if (bright && units == LightUnits::Radiometric)
        remedy = "--light-units photometric divides its lights by 683 lm/W";
    else if (!bright && units == LightUnits::Photometric)
        remedy = "--light-units radiometric takes its lights as they are, 683 times as strong";
    else
        remedy = bright ? "expose it accordingly" : "--env-constant 1,1,1 lights it from all around";
    note(o, "warning: the picture's mean luminance is " + formatted("%.3g", mean) + ", " +
                (bright ? "white" : "black") + " on a screen: " + remedy);
}

void summarize(const TraceOptions& o, const Scene& loaded, const RenderReport& report) {
    const double seconds = report.traceSeconds;
    const double rate = seconds > 0 ? static_cast<double>(report.samples) / seconds * 1e-6 : 0;
    const double cpu = report.traceCpuSeconds;
    const double share = cpu > 0 ? report.writeCpuSeconds / cpu : 0;
    if (o.json) {
        nlohmann::ordered_json j{{"scene", o.scene},
                                 {"dump", o.dump},
                                 {"camera", loaded.cameras[o.render.camera].name},
                                 {"width", o.render.width},
                                 {"height", o.render.height},
                                 {"triangles", loaded.triangleCount()},
                                 {"lights", loaded.lights.size()},
                                 {"effects", o.render.plan->simulated()},
                                 {"integrator", nameOf(o.render.integrator)},
                                 {"samples", report.samples},
                                 {"nonFinite", report.nonFinite},
                                 {"degenerateTriangles", loaded.report.degenerateTriangles},
                                 {"threads", threadCount()},
                                 {"traceSeconds", seconds},
                                 {"megasamplesPerSecond", rate},
                                 {"traceCpuSeconds", report.traceCpuSeconds},
                                 {"writeCpuSeconds", report.writeCpuSeconds},
                                 {"warnings", loaded.report.warnings}};
        if (o.frame) {
            const RecordedMotion& motion = o.render.plan->motion;
            j["motion"] = {{"recorded", motion.recorded}, {"reason", motion.reason}};
        }
        if (!o.render.hierarchical) j["samplesPerPixel"] = o.render.spp;
        if (o.render.hierarchical) j["refinedCells"] = report.refinedCells;
        std::cout << j.dump(2) << "\n";
    }
    char text[160];
    std::snprintf(text, sizeof text,
                  "%llu samples in %.2f s (%.3f Msamples/s, %d threads); compressing and writing took "
                  "%.2f processor seconds (%.1f %% of tracing's)",
                  static_cast<unsigned long long>(report.samples), seconds, rate, threadCount(),
                  report.writeCpuSeconds, 100 * share);
    say(o.dump + ": " + text);
}

}  // namespace vlx::render
