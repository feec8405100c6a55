// vlx-trace: traces a glTF scene into a dump of samples.

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "finished.h"
#include "frames.h"
#include "progress_bar.h"
#include "render/film/render.h"
#include "render/gltf/check/gltf_files.h"
#include "render/pilot/choose_integrator.h"
#include "render/pilot/pilot.h"
#include "render/plan/plan.h"
#include "render/scene/scene_loader.h"
#include "tool_main.h"
#include "trace/trace_options.h"
#include "trace/trace_report.h"
#include "trace/trace_view.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace {

using namespace vlx::render;

/// Of what variolux:inputs is to say.
vlx::Fingerprint inputs(const TraceOptions& o) {
    vlx::Fingerprint made =
        vlx::fingerprintOf(*o.commandLine, {"SCENE", "--env", "--append", "--sample-map"});
    made.add("scene", std::filesystem::path(o.scene).filename().string());  // it is in the header
    if (o.frame) made.add("frame", std::to_string(*o.frame));
    for (const std::string& file : gltfFiles(o.scene)) made.addFile(file);
    for (const std::string& file : {o.environment.image, o.earlierPath, o.mapPath}) made.addFile(file);
    return made;
}

/// For kPictureAttribute: what --append may not change.
std::string pictureOf(const TraceOptions& o, const Scene& loaded, const EffectRequest& request) {
    vlx::Fingerprint scene, environment;
    for (const std::string& file : gltfFiles(o.scene)) scene.addFile(file);
    environment.addFile(o.environment.image);
    for (const float v : o.environmentConstant) environment.add("constant", std::to_string(v));
    std::string leftOut;
    for (std::size_t e = 0; e < kEffects; ++e)
        if (request.without.has(static_cast<Effect>(e))) leftOut += "-" + std::string(kEffectNames[e]);
    const auto text = [](double v) { return vlx::formatted("%.9g", v); };
    std::string variant = o.variant;
    std::ranges::replace(variant, ';', ',');
    const bool moves = loaded.animations > 0;
    return "scene: " + scene.text() + "; environment: " + environment.text() + "; light units: " +
           (loaded.report.lightUnits == LightUnits::Photometric ? "photometric" : "radiometric") +
           "; variant: " + (variant.empty() ? "default" : variant) + "; exposure: " +
           (moves ? text(loaded.shutter.open) + " to " + text(loaded.shutter.close) + " s" : "any") +
           "; most bounces: " + std::to_string(o.render.path.maxBounces) +
           "; effects left out: " + (leftOut.empty() ? "none" : leftOut);
}

IntegratorChoice chooseIntegrator(const TraceOptions& o, const Scene& loaded,
                                  const Accelerator& accelerator) {
    if (o.integrator != IntegratorRequest::Auto)
        return {
            o.integrator == IntegratorRequest::Path ? IntegratorKind::Path : IntegratorKind::Bidirectional,
            "asked for", false};
    if (o.targetError > 0) return {IntegratorKind::Path, "--target-error judges by path tracing", false};
    // With --time as many samples as take a second are worth a pilot.
    const double samples = o.timeLimit > 0 ? o.timeLimit * 2e5 : o.render.spp;
    const vlx::Window whole{0, 0, o.render.width, o.render.height};
    const auto pixels = static_cast<double>(o.render.crop.value_or(whole).pixels());
    return vlx::render::chooseIntegrator(loaded, accelerator, o.render,
                                         o.timeLimit > 0 ? samples : samples * pixels);
}

/// --time and --target-error.
void chooseSamples(TraceOptions& o, const Scene& loaded, const Accelerator& accelerator) {
    constexpr double kBeside = 1.2;  // gathering and writing the samples takes time too
    const PilotMeasure pilot =
        pilotMeasure(loaded, accelerator, o.render, std::min(1.0, 0.05 * std::max(o.timeLimit, 1.0)));
    const vlx::Window whole{0, 0, o.render.width, o.render.height};
    const auto pixels = static_cast<double>(o.render.crop.value_or(whole).pixels());
    const double wanted =
        o.timeLimit > 0
            ? std::floor((o.timeLimit - pilot.seconds) / (kBeside * pixels * pilot.secondsPerSample))
            : std::ceil(pilot.relativeVariance / o.targetError);
    const auto replicates = static_cast<double>(o.render.replicates);
    const double most = std::floor((1 << 24) / replicates) * replicates;
    const double rounded =
        replicates * (o.timeLimit > 0 ? std::floor(wanted / replicates) : std::ceil(wanted / replicates));
    o.render.spp = static_cast<int>(std::clamp(rounded, replicates, most));
    if (o.render.integrator == IntegratorKind::Bidirectional)
        while (o.render.splatReplicates() == 0 && o.render.spp > 1) --o.render.spp;
    note(o, std::to_string(o.render.spp) + " samples a pixel");
}

/// What --frames leaves of a run: one picture.
int runOne(TraceOptions& o, const vlx::Progress& progress) {
    const bool renders = !o.listCameras && o.explain.empty();
    if (renders) {
        std::vector<std::string> files = gltfFiles(o.scene);
        files.insert(files.end(), {o.scene, o.environment.image, o.earlierPath, o.mapPath});
        vlx::checkOutputName(o.dump, files);
    }
    std::string broken;
    const auto request = parseEffects(o.effects, broken);
    if (!request) throw CLI::ValidationError("--effects", broken);
    Shutter exposure;
    if (o.shutter.size() == 2) exposure = {o.shutter[0], o.shutter[1]};
    const Shutter first = exposure;
    if (o.frame) {
        exposure.open += *o.frame / o.framesPerSecond;
        exposure.close += *o.frame / o.framesPerSecond;
        exposure.frame = 1 / o.framesPerSecond;
    }
    if (o.environmentConstant.size() == 3)
        o.environment.constant =
            Rgb{o.environmentConstant[0], o.environmentConstant[1], o.environmentConstant[2]};
    std::optional<vlx::Fingerprint> made;
    if (renders) {
        o.render.inputs = made.emplace(inputs(o)).text(o.render.band);
        if (!o.overwrite && vlx::isFinished({o.dump}, o.render.inputs)) return printSkipped(o);
    }
    if (o.listCameras) return printCameras(o, loadCameras(o.scene, exposure));
    o.render.version = VARIOLUX_VERSION;
    std::optional<EarlierDump> earlier;
    if (!o.earlierPath.empty()) takeSizeOf(o, earlier.emplace(o.earlierPath));
    chooseView(o, loadCameras(o.scene, exposure));
    Scene loaded = loadScene(o.scene, o.environment, exposure, {o.lightUnits, o.variant});
    for (const std::string& warning : loaded.report.warnings) note(o, "warning: " + warning);
    for (const std::string& told : loaded.report.notes) note(o, told);
    if (loaded.report.degenerateTriangles > 0)
        note(o, std::to_string(loaded.report.degenerateTriangles) + " triangles without area were dropped");

    placeCamera(o, loaded, first);

    std::optional<SampleMap> map;
    if (!o.mapPath.empty()) {
        const vlx::Window whole{0, 0, o.render.width, o.render.height};
        o.render.map = &map.emplace(o.mapPath, whole, o.render.crop.value_or(whole));
    }
    const Plan plan = planEffects(
        loaded, {o.render.camera, o.render.width, o.render.height, o.render.path.maxBounces, *request});
    for (const std::string& warning : plan.warnings) note(o, "warning: " + warning);
    applyPlan(loaded, plan);
    o.render.follow(plan);
    o.render.picture = pictureOf(o, loaded, *request);
    if (plan.motion.recorded) note(o, "motion is recorded: " + plan.motion.reason);
    const Accelerator accelerator(loaded, o.render.path.effects);
    if (o.tellsView) warnOfBacks(o, loaded, accelerator);
    const IntegratorChoice choice = chooseIntegrator(o, loaded, accelerator);
    if (!o.explain.empty()) return printPlan(o, loaded, plan, choice);
    o.render.integrator = choice.chosen;
    o.render.integratorReason = std::string(nameOf(choice.chosen)) + ": " + choice.reason;
    if (const auto fault = o.render.validate(loaded)) throw CLI::ValidationError(*fault);
    if (choice.tried || choice.chosen == IntegratorKind::Bidirectional)
        note(o, "integrator " + o.render.integratorReason);

    if (o.timeLimit > 0 || o.targetError > 0) chooseSamples(o, loaded, accelerator);
    made->checkUnchanged();  // all is read but the dump that is added to, which stays open
    const RenderReport report = renderDump(loaded, accelerator, o.dump, o.render, progress);
    if (report.nonFinite > 0)
        note(o, "warning: " + std::to_string(report.nonFinite) +
                    " samples overflowed and were written as black");
    warnOfBrightness(o, loaded, report);
    summarize(o, loaded, report);
    return vlx::kDone;
}

int run(TraceOptions& o) {
    const bool renders = !o.listCameras && o.explain.empty();
    if (o.dump.empty() && renders) throw CLI::RequiredError("--output");
    checkOptions(o);
    if (!o.band.empty()) o.render.band = vlx::parseBand(o.band);
    const vlx::ThreadLimit limit(o.threads);
    vlx::ProgressBar bar("tracing");
    if (o.frames.empty()) return runOne(o, bar);
    vlx::requireFramePlace("--output", o.dump);
    bool told = false;
    vlx::forEachFrame(vlx::parseFrames(o.frames), bar, [&](int number, const vlx::Progress& progress) {
        TraceOptions one = ofFrame(o, number);
        one.tellsView = !std::exchange(told, true);
        runOne(one, progress);
    });
    return vlx::kDone;
}

}  // namespace

int main(int argc, char** argv) {
#ifdef __GLIBC__
    // Bands of samples come and go all the time: their memory is kept, not given back and cleared anew.
    mallopt(M_MMAP_THRESHOLD, 1 << 28);
    mallopt(M_TRIM_THRESHOLD, 1 << 28);
#endif
    CLI::App app("Trace a glTF scene by path tracing into a dump of samples.", "vlx-trace");
    TraceOptions options;
    bindOptions(app, options);
    return vlx::runTool(argc, argv, app, [&] { return run(options); });
}
