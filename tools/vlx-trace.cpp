// vlx-trace: traces a glTF scene into a dump of samples.

#include <malloc.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "finished.h"
#include "frames.h"
#include "progress_bar.h"
#include "render/film/render.h"
#include "render/gltf/gltf_references.h"
#include "render/pilot/choose_integrator.h"
#include "render/pilot/pilot.h"
#include "render/plan/plan.h"
#include "render/scene/scene_loader.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/parallel.h"

namespace {

using namespace vlx::render;

struct TraceCommand {
    std::string scene;
    std::string dump;
    std::string camera;
    int width = 0;
    int height = 0;
    std::vector<int> crop;
    std::vector<float> environmentConstant;
    EnvironmentOptions environment;
    int threads = 0;
    bool listCameras = false;
    bool json = false;
    std::string effects = "auto";
    IntegratorRequest integrator = IntegratorRequest::Auto;
    std::string explain;
    std::vector<double> shutter;
    double timeLimit = 0;
    double targetError = 0;
    std::string earlierPath;
    std::string mapPath;
    std::string band;
    std::string frames;
    double framesPerSecond = 24;
    std::optional<int> frame;  // of --frames, the one at work
    bool overwrite = false;
    RenderOptions options;
    const CLI::App* commandLine = nullptr;

    void bind(CLI::App& app) {
        commandLine = &app;
        app.footer(
            "Examples:\n"
            "  vlx-trace room.glb -o room.exr --width 640 --spp 32\n"
            "  vlx-trace room.glb -o room.exr --hierarchical --tolerance 0.05 --seed 7\n"
            "  vlx-trace house.gltf -o house.exr --env sky.exr --camera kitchen --crop 100,50,64,64\n"
            "  vlx-trace room.glb -o room_####.exr --frames 1-100 --band 2/5\n"
            "The dump is a deep OpenEXR file: its part `beauty` is the plain average, its part `samples` "
            "holds\n"
            "every sample with position, albedo, normal and depth. vlx-krige reconstructs it.");
        app.add_option("SCENE", scene, "A glTF 2.0 scene, .glb or .gltf")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)");
        app.add_option("--camera", camera,
                       "Name or number of the camera (default: the scene's active one, or the\n"
                       "first that can be used)")
            ->type_name("NAME|INDEX");
        app.add_flag("--list-cameras", listCameras, "Print the scene's cameras and exit");
        app.add_option("--width", width, "Of the picture, in pixels (default: 512, or from the height)")
            ->check(CLI::Range(1, 1 << 20));
        app.add_option("--height", height, "Of the picture (default: from the width, by the camera's aspect)")
            ->check(CLI::Range(1, 1 << 20));
        app.add_option("--crop", crop, "Render only this part of the picture")
            ->delimiter(',')
            ->expected(4)
            ->type_name("X,Y,WIDTH,HEIGHT");
        auto* spp = app.add_option("--spp", options.spp, "Samples a pixel, the same everywhere")
                        ->check(CLI::Range(1, 1 << 24))
                        ->capture_default_str();
        auto* hierarchical =
            app.add_flag("--hierarchical", options.hierarchical,
                         "Sample cells of 4, 2, 1, 1/2, 1/4 pixels in turn, as long as their residual\n"
                         "variance asks for it: 1 to 256 samples a pixel")
                ->excludes(spp);
        app.add_option("--tolerance", options.refinement.tolerance,
                       "Hierarchical: the relative standard error of a pixel at which its cells are\n"
                       "no longer refined; 0 takes all 256 samples. Large values darken the image:\n"
                       "cells that have not met rare bright paths stop early")
            ->check(vlx::finiteNonNegative())
            ->needs(hierarchical)
            ->capture_default_str();
        auto* time = app.add_option("--time", timeLimit,
                                    "Take as many samples a pixel as this many seconds of tracing allow,\n"
                                    "judged by a short pilot")
                         ->check(vlx::finitePositive())
                         ->excludes(spp)
                         ->excludes(hierarchical)
                         ->type_name("SECONDS");
        app.add_option("--target-error", targetError,
                       "Take as many samples a pixel as bring the relMSE of the plain average down to\n"
                       "this, judged by a short pilot (before reconstruction)")
            ->check(vlx::finitePositive())
            ->excludes(spp)
            ->excludes(hierarchical)
            ->excludes(time)
            ->type_name("RELMSE");
        app.add_option("--append", earlierPath,
                       "A dump of the same view: its samples are kept, --spp more are added to\n"
                       "them, and both are written to the output")
            ->excludes(hierarchical)
            ->type_name("DUMP");
        app.add_option("--sample-map", mapPath,
                       "Where samples are wanted: an image with a channel sampling.density (or Y),\n"
                       ">= 0, relative to its mean. --spp is then the mean over the picture")
            ->excludes(hierarchical)
            ->type_name("MAP");
        app.add_option("--replicates", options.replicates,
                       "Divide the samples of each pixel into this many independent randomisations\n"
                       "(written as sample.replicate)")
            ->check(CLI::Range(1, 1 << 24))
            ->excludes(hierarchical)
            ->capture_default_str();
        app.add_option("--seed", options.seed, "Another seed, other noise")->capture_default_str();
        app.add_option("--max-bounces", options.path.maxBounces, "Scattering events of a path at most")
            ->check(CLI::Range(0, 1 << 16))
            ->capture_default_str();
        auto* constant = app.add_option("--env-constant", environmentConstant,
                                        "Radiance from all around, in place of the scene's own environment")
                             ->delimiter(',')
                             ->expected(3)
                             ->check(vlx::finiteNonNegative())
                             ->type_name("R,G,B");
        app.add_option("--env", environment.image,
                       "Latitude-longitude image of the environment (EXR, HDR, ...); its middle is -z")
            ->excludes(constant);
        app.add_option("--effects", effects,
                       "What to simulate: auto, what the scene calls for; all, everything (the general\n"
                       "tracer, slower); auto,-NAME,... leaves effects out, which biases the image.\n"
                       "--explain prints their names")
            ->type_name("auto|all|auto,-NAME")
            ->capture_default_str();
        using enum IntegratorRequest;
        vlx::addChoice(app, "--integrator", integrator,
                       {{"auto", Auto}, {"path", Path}, {"bidirectional", Bidirectional}},
                       "How light is followed. path: from the camera; bidirectional: from the lights too, "
                       "for caustics of small lights and hidden lights, at several times the cost of a "
                       "sample; auto: where the scene may call for it, a short pilot decides");
        app.add_flag("--explain{text}", explain,
                     "Print which effects the scene calls for, why, what part of the time each takes\n"
                     "(from a short pilot), and which integrator is chosen, and end; --explain=json: the "
                     "same as JSON")
            ->check(CLI::IsMember({"text", "json"}));
        app.add_option("--shutter", shutter,
                       "When the shutter opens and closes, in seconds of the scene's animations\n"
                       "(default: 0,0.0208; equal times freeze the picture)")
            ->delimiter(',')
            ->expected(2)
            ->type_name("OPEN,CLOSE");
        app.add_option(
               "--band", band,
               "Only band I of N, cut by rows from the top: the samples, bit for bit, that the whole\n"
               "picture has there; vlx-pack merge joins them")
            ->excludes(time)
            ->excludes("--target-error")
            ->type_name("I/N");
        auto* sequence =
            app.add_option(
                   "--frames", frames,
                   "Trace these frames, for example 1-100x2,150: #### in the names of files stands for\n"
                   "the frame's number F. The shutter is moved by F / --fps seconds, the seed is a hash\n"
                   "of --seed and F. When a frame fails the others go on")
                ->excludes("--list-cameras")
                ->excludes("--explain")
                ->type_name("LIST");
        app.add_option("--fps", framesPerSecond, "Frames a second of the scene's animations")
            ->check(vlx::finiteWithin(1e-6, 1e6))
            ->needs(sequence)
            ->capture_default_str();
        vlx::addOverwrite(app, overwrite);
        app.add_option("--threads", threads, "0: all processors. The result does not depend on it")
            ->check(CLI::Range(0, 4096))
            ->capture_default_str();
        using enum vlx::DumpCompression;
        vlx::addChoice(app, "--compression", options.compression,
                       {{"none", None}, {"rle", Rle}, {"zips", Zips}},
                       "Of the dump. rle: hardly slows tracing down; zips: a tenth smaller");
        app.add_flag("--json", json, "Print what was done as JSON on standard output");
    }

    int run() {
        const bool renders = !listCameras && explain.empty();
        if (dump.empty() && renders) throw CLI::RequiredError("--output");
        checkOptions();
        if (!band.empty()) options.band = vlx::parseBand(band);
        const vlx::ThreadLimit limit(threads);
        vlx::ProgressBar bar("tracing");
        if (frames.empty()) return runOne(bar);
        vlx::requireFramePlace("--output", dump);
        vlx::forEachFrame(vlx::parseFrames(frames), bar, [&](int number, const vlx::Progress& progress) {
            ofFrame(number).runOne(progress);
        });
        return vlx::kDone;
    }

  private:
    // What is printed and no dump made would else seem to depend on them.
    void checkOptions() const {
        const std::string trace = "tracing", explaining = "--explain";
        const std::string atHand = listCameras ? "--list-cameras" : explain.empty() ? trace : explaining;
        vlx::checkOptionUse(
            *commandLine,
            {{{"--output", "--overwrite", "--compression", "--json", "--band"}, {trace}},
             {{"--camera", "--width", "--height", "--crop", "--spp", "--hierarchical", "--tolerance",
               "--time", "--replicates", "--target-error", "--append", "--sample-map", "--seed",
               "--max-bounces", "--effects", "--integrator", "--explain"},
              {trace, explaining}}},
            {atHand});
        if (shutter.size() == 2 &&
            !(std::isfinite(shutter[0]) && std::isfinite(shutter[1]) && shutter[0] <= shutter[1]))
            throw CLI::ValidationError("--shutter",
                                       "expected two finite times, the second not before the first");
        for (const float value : environmentConstant)
            if (!std::isfinite(value)) throw CLI::ValidationError("--env-constant", "expected finite values");
        if (integrator == IntegratorRequest::Bidirectional && targetError > 0)
            throw CLI::ValidationError("--target-error", "judges by path tracing: not with bidirectional");
    }

    TraceCommand ofFrame(int number) const {
        TraceCommand one = *this;
        for (std::string* name :
             {&one.scene, &one.dump, &one.environment.image, &one.earlierPath, &one.mapPath})
            *name = vlx::frameName(*name, number);
        one.frame = number;
        one.options.seed = vlx::hashOf(options.seed, number) >> 1;
        return one;
    }

    /// What --frames leaves of a run: one picture.
    int runOne(const vlx::Progress& progress) {
        const bool renders = !listCameras && explain.empty();
        if (renders) {
            std::vector<std::string> files = gltfFiles(scene);
            files.insert(files.end(), {scene, environment.image, earlierPath, mapPath});
            vlx::checkOutputName(dump, files);
        }
        std::string broken;
        const auto request = parseEffects(effects, broken);
        if (!request) throw CLI::ValidationError("--effects", broken);
        Shutter exposure;
        if (shutter.size() == 2) exposure = {shutter[0], shutter[1]};
        if (frame) {
            exposure.open += *frame / framesPerSecond;
            exposure.close += *frame / framesPerSecond;
        }
        if (environmentConstant.size() == 3)
            environment.constant =
                Rgb{environmentConstant[0], environmentConstant[1], environmentConstant[2]};
        std::optional<vlx::InputsHash> hash;
        if (renders) {
            options.inputs = hash.emplace(inputs()).text(options.band);
            if (!overwrite && vlx::isFinished({dump}, options.inputs)) return skip();
        }
        if (listCameras) return printCameras(loadCameras(scene, exposure));
        options.version = VARIOLUX_VERSION;
        std::optional<EarlierDump> earlier;
        if (!earlierPath.empty()) takeSizeOf(earlier.emplace(earlierPath));
        chooseView(loadCameras(scene, exposure));
        Scene loaded = loadScene(scene, environment, exposure);
        for (const std::string& warning : loaded.report.warnings) note("warning: " + warning);
        if (loaded.report.degenerateTriangles > 0)
            note(std::to_string(loaded.report.degenerateTriangles) + " triangles without area were dropped");

        std::optional<SampleMap> map;
        if (!mapPath.empty()) {
            const vlx::Window whole{0, 0, options.width, options.height};
            options.map = &map.emplace(mapPath, options.crop.value_or(whole));
        }
        const Plan plan = planEffects(
            loaded, {options.camera, options.width, options.height, options.path.maxBounces, *request});
        for (const std::string& warning : plan.warnings) note("warning: " + warning);
        applyPlan(loaded, plan);
        options.follow(plan);
        const Accelerator accelerator(loaded, options.path.effects);
        const IntegratorChoice choice = chooseIntegrator(loaded, accelerator);
        if (!explain.empty()) return printPlan(loaded, plan, choice);
        options.integrator = choice.chosen;
        options.integratorReason = std::string(nameOf(choice.chosen)) + ": " + choice.reason;
        if (const auto fault = options.validate(loaded)) throw CLI::ValidationError(*fault);
        if (choice.tried || choice.chosen == Integrator::Bidirectional)
            note("integrator " + options.integratorReason);

        if (timeLimit > 0 || targetError > 0) chooseSamples(loaded, accelerator);
        hash->checkUnchanged();  // all is read but the dump that is added to, which stays open
        const RenderReport report = renderDump(loaded, accelerator, dump, options, progress);
        if (report.nonFinite > 0)
            note("warning: " + std::to_string(report.nonFinite) +
                 " samples overflowed and were written as black");
        summarize(loaded, report);
        return vlx::kDone;
    }

    /// Of what variolux:inputs is to say.
    vlx::InputsHash inputs() const {
        vlx::InputsHash hash(*commandLine, {"SCENE", "--env", "--append", "--sample-map"});
        hash.add("scene", std::filesystem::path(scene).filename().string());  // it is in the header
        if (frame) hash.add("frame", std::to_string(*frame));
        for (const std::string& file : gltfFiles(scene)) hash.addFile(file);
        for (const std::string& file : {environment.image, earlierPath, mapPath}) hash.addFile(file);
        return hash;
    }

    int skip() const {
        if (json)
            std::cout << nlohmann::ordered_json{{"scene", scene}, {"dump", dump}, {"skipped", true}}.dump(2)
                      << "\n";
        return vlx::kDone;
    }

    void note(const std::string& text) const { vlx::say(scene + ": " + text); }

    int printCameras(const Scene& loaded) const {
        for (const std::string& warning : loaded.report.warnings) note("warning: " + warning);
        for (std::size_t i = 0; i < loaded.cameras.size(); ++i) {
            const Camera& c = loaded.cameras[i];
            std::cout << i << "  " << c.name
                      << (i == loaded.activeCamera && c.unusable.empty() ? "  (active)" : "")
                      << (c.unusable.empty() ? "" : "  unusable: " + c.unusable) << "\n";
        }
        return vlx::kDone;
    }

    IntegratorChoice chooseIntegrator(const Scene& loaded, const Accelerator& accelerator) const {
        if (integrator != IntegratorRequest::Auto)
            return {integrator == IntegratorRequest::Path ? Integrator::Path : Integrator::Bidirectional,
                    "asked for", false};
        if (targetError > 0) return {Integrator::Path, "--target-error judges by path tracing", false};
        // With --time as many samples as take a second are worth a pilot.
        const double samples = timeLimit > 0 ? timeLimit * 2e5 : options.spp;
        const vlx::Window whole{0, 0, options.width, options.height};
        const auto pixels = static_cast<double>(options.crop.value_or(whole).pixels());
        return vlx::render::chooseIntegrator(loaded, accelerator, options,
                                             timeLimit > 0 ? samples : samples * pixels);
    }

    int printPlan(const Scene& loaded, const Plan& plan, const IntegratorChoice& choice) const {
        const auto shares = pilotShares(loaded, plan, options);
        if (explain == "json") {
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
            const nlohmann::ordered_json chosen{{"chosen", nameOf(choice.chosen)}, {"reason", choice.reason}};
            std::cout << nlohmann::ordered_json{{"effects", list},
                                                {"lights", loaded.lights.size()},
                                                {"recorded", features},
                                                {"integrator", chosen}}
                             .dump(2)
                      << "\n";
            return vlx::kDone;
        }
        std::printf("%-19s%-9s%-7s%s\n", "effect", "planned", "cost", "reason");
        for (const PlannedEffect& e : plan.effects) {
            const auto share = shares[static_cast<std::size_t>(e.effect)];
            const std::string cost = share ? std::to_string(std::lround(*share * 100)) + " %" : "";
            std::printf("%-19s%-9s%-7s%s\n", std::string(nameOf(e.effect)).c_str(), e.planned ? "yes" : "no",
                        cost.c_str(), e.reason.c_str());
        }
        if (!plan.features.albedo)
            std::printf("not recorded: %s, %s\n",
                        plan.features.normalAndDepth ? "albedo" : "albedo, normal and depth",
                        plan.features.reason.c_str());
        std::printf("integrator %s: %s\n", std::string(nameOf(choice.chosen)).c_str(), choice.reason.c_str());
        return vlx::kDone;
    }

    /// Camera and picture, by the scene's cameras alone: what is wrong with them is told before the scene is
    /// read. Without a camera that can be used nothing is chosen: reading the scene says why.
    void chooseView(const Scene& known) {
        if (std::ranges::all_of(known.cameras, [](const Camera& c) { return !c.unusable.empty(); })) return;
        options.camera = chosenCamera(known);
        setSize(known.cameras[options.camera]);
        if (crop.size() == 4) options.crop = vlx::Window{crop[0], crop[1], crop[2], crop[3]};
        if (const auto fault = options.validate(known)) throw CLI::ValidationError(*fault);
    }

    std::size_t chosenCamera(const Scene& loaded) const {
        if (camera.empty()) {
            const auto named = [&](std::size_t i) {
                const std::string& name = loaded.cameras[i].name;
                return "camera " + std::to_string(i) + (name.empty() ? "" : " '" + name + "'");
            };
            if (loaded.activeCamera != loaded.wantedCamera)
                note("warning: " + named(loaded.wantedCamera) +
                     " cannot be used: " + loaded.cameras[loaded.wantedCamera].unusable + "; " +
                     named(loaded.activeCamera) + " is taken (--camera takes another)");
            return loaded.activeCamera;
        }
        for (std::size_t i = 0; i < loaded.cameras.size(); ++i)
            if (loaded.cameras[i].name == camera) return i;
        const bool isNumber =
            camera.find_first_not_of("0123456789") == std::string::npos && camera.size() < 9;
        if (isNumber && std::stoul(camera) < loaded.cameras.size()) return std::stoul(camera);
        std::string names;
        for (const Camera& c : loaded.cameras) names += (names.empty() ? "'" : ", '") + c.name + "'";
        throw vlx::Error(scene, "has no camera '" + camera + "'; it has " + names);
    }

    /// The picture of the dump that is added to, where the command line names none.
    void takeSizeOf(const EarlierDump& earlier) {
        options.earlier = &earlier;
        const vlx::DumpHeader& header = earlier.header();
        if (width == 0 && height == 0) {
            width = header.display.width;
            height = header.display.height;
        }
        if (crop.empty() && header.data != header.display)
            crop = {header.data.x, header.data.y, header.data.width, header.data.height};
    }

    /// --time and --target-error.
    void chooseSamples(const Scene& loaded, const Accelerator& accelerator) {
        constexpr double kBeside = 1.2;  // gathering and writing the samples takes time too
        const PilotMeasure pilot =
            pilotMeasure(loaded, accelerator, options, std::min(1.0, 0.05 * std::max(timeLimit, 1.0)));
        const vlx::Window whole{0, 0, options.width, options.height};
        const auto pixels = static_cast<double>(options.crop.value_or(whole).pixels());
        const double wanted =
            timeLimit > 0
                ? std::floor((timeLimit - pilot.seconds) / (kBeside * pixels * pilot.secondsPerSample))
                : std::ceil(pilot.relativeVariance / targetError);
        const auto replicates = static_cast<double>(options.replicates);
        const double most = std::floor((1 << 24) / replicates) * replicates;
        const double rounded =
            replicates * (timeLimit > 0 ? std::floor(wanted / replicates) : std::ceil(wanted / replicates));
        options.spp = static_cast<int>(std::clamp(rounded, replicates, most));
        if (options.integrator == Integrator::Bidirectional)
            while (options.splatReplicates() == 0 && options.spp > 1) --options.spp;
        note(std::to_string(options.spp) + " samples a pixel");
    }

    void setSize(const Camera& chosen) {
        const double aspect = chosen.aspect > 0 ? static_cast<double>(chosen.aspect) : 1.0;
        const auto derived = [&](double side, const char* option) {
            if (!(side < (1 << 20) + 0.5))
                throw vlx::Error(scene, "the camera's aspectRatio of " + std::to_string(aspect) + " makes " +
                                            std::to_string(side) + " pixels, expected at most 2^20: give " +
                                            option);
            return std::max(1, static_cast<int>(std::lround(side)));
        };
        if (width == 0) width = height == 0 ? 512 : derived(height * aspect, "--width");
        if (height == 0) height = derived(width / aspect, "--height");
        options.width = width;
        options.height = height;
    }

    void summarize(const Scene& loaded, const RenderReport& report) const {
        const double seconds = report.traceSeconds;
        const double rate = seconds > 0 ? static_cast<double>(report.samples) / seconds * 1e-6 : 0;
        const double cpu = report.traceCpuSeconds;
        const double share = cpu > 0 ? report.writeCpuSeconds / cpu : 0;
        if (json) {
            nlohmann::ordered_json j{{"scene", scene},
                                     {"dump", dump},
                                     {"camera", loaded.cameras[options.camera].name},
                                     {"width", options.width},
                                     {"height", options.height},
                                     {"triangles", loaded.triangleCount()},
                                     {"lights", loaded.lights.size()},
                                     {"effects", options.plan->simulated()},
                                     {"integrator", nameOf(options.integrator)},
                                     {"samples", report.samples},
                                     {"nonFinite", report.nonFinite},
                                     {"degenerateTriangles", loaded.report.degenerateTriangles},
                                     {"threads", vlx::threadCount()},
                                     {"traceSeconds", seconds},
                                     {"megasamplesPerSecond", rate},
                                     {"traceCpuSeconds", report.traceCpuSeconds},
                                     {"writeCpuSeconds", report.writeCpuSeconds},
                                     {"warnings", loaded.report.warnings}};
            if (!options.hierarchical) j["samplesPerPixel"] = options.spp;
            if (options.hierarchical) j["refinedCells"] = report.refinedCells;
            std::cout << j.dump(2) << "\n";
        }
        char text[160];
        std::snprintf(text, sizeof text,
                      "%llu samples in %.2f s (%.3f Msamples/s, %d threads); compressing and writing took "
                      "%.2f processor seconds (%.1f %% of tracing's)",
                      static_cast<unsigned long long>(report.samples), seconds, rate, vlx::threadCount(),
                      report.writeCpuSeconds, 100 * share);
        vlx::say(dump + ": " + text);
    }
};

}  // namespace

int main(int argc, char** argv) {
#ifdef __GLIBC__
    // Bands of samples come and go all the time: their memory is kept, not given back and cleared anew.
    mallopt(M_MMAP_THRESHOLD, 1 << 28);
    mallopt(M_TRIM_THRESHOLD, 1 << 28);
#endif
    CLI::App app("Trace a glTF scene by path tracing into a dump of samples.", "vlx-trace");
    TraceCommand command;
    command.bind(app);
    return vlx::runTool(argc, argv, app, [&] { return command.run(); });
}
