#include "sweep/sweep_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include "frames.h"
#include "process/child_process.h"
#include "sweep/sweep_command.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/metrics.h"

namespace vlx {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

template <typename Value>
void sortedOnce(std::vector<Value>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

std::vector<int> sortedFrames(const std::string& text) {
    std::vector<int> frames = parseFrames(text);
    std::sort(frames.begin(), frames.end());
    return frames;
}

void readReference(SweepPlan& plan) {
    for (const std::string& path : plan.files(plan.options.reference)) {
        ColourImage image = readColour(path, {}, true);
        plan.references.push_back({std::move(image.colour), std::move(image.stddev)});
        plan.referenceIdentity += fileFingerprint(path);
    }
}

/// Finds the program, and what tells this version of it from others.
void identify(SweepPlan& plan, const std::string& program) {
    if (plan.programs.contains(program)) return;
    std::string path = plan.options.programs + "/" + program;
    if (!program.starts_with("vlx-") || !fs::exists(path)) {
        ProcessRun found = runCommand("command -v " + program);
        if (found.exitCode != 0 || found.out.empty())
            throw Error(program, "expected a program that the shell finds");
        found.out.erase(found.out.find_last_not_of('\n') + 1);
        path = found.out;
    }
    std::error_code ignored;
    // A shell builtin is no file: its name has to do.
    const std::string identity = fs::is_regular_file(path, ignored) ? fileFingerprint(path) : path;
    plan.programs[program] = {path, identity};
}

void prepareScene(SweepPlan& plan) {
    if (!plan.references.empty()) {
        const Window& window = plan.references.front().colour.display;  // of a crop, the whole picture
        if (plan.options.width == 0) plan.options.width = window.width;
        if (plan.options.height == 0) plan.options.height = window.height;
        if (plan.options.width != window.width || plan.options.height != window.height)
            throw Error(plan.options.reference,
                        "expected a reference of " + std::to_string(plan.options.width) + " x " +
                            std::to_string(plan.options.height) + " pixels, found " +
                            std::to_string(window.width) + " x " + std::to_string(window.height));
    }
    if (plan.options.spp.empty()) plan.options.spp = {4, 16, 64, 256};
}

void prepareDump(SweepPlan& plan) {
    const ProcessRun run =
        runCommand(plan.executable("vlx-pack info " + shellQuoted(plan.options.input) + " --json"));
    if (run.exitCode != 0) throw Error("", "vlx-pack info failed: " + run.err);
    const Json info = reportOf(run, "vlx-pack info");
    const Window window{info.at("dataWindow").at("x"), info.at("dataWindow").at("y"),
                        info.at("dataWindow").at("width"), info.at("dataWindow").at("height")};
    plan.requireReferenceWindow(window);
    plan.dumpSamples = info.at("samples").at("min");
    const int replicates = info.at("samples").at("replicates");
    if (plan.dumpSamples < 1)
        throw Error(plan.options.input, "expected samples in every pixel, found an empty one");
    if (plan.options.traceSeconds == 0 && info.contains("renderSeconds"))
        plan.options.traceSeconds = info.at("renderSeconds");
    plan.samplingTimeKnown = plan.options.traceSeconds > 0;
    plan.meanSamples = info.at("samples").at("mean");
    if (plan.options.spp.empty())
        for (int spp = plan.dumpSamples; spp > 0 && plan.options.spp.size() < 5; spp /= 2) {
            if (replicates > 1 && std::fmod(static_cast<double>(spp) * replicates, plan.meanSamples) != 0)
                break;
            plan.options.spp.insert(plan.options.spp.begin(), spp);
            if (spp % 2 != 0) break;
        }
    for (const int spp : plan.options.spp)
        if (spp > plan.dumpSamples)
            throw Error(plan.options.input, "expected at least " + std::to_string(spp) +
                                                " samples in every pixel, found " +
                                                std::to_string(plan.dumpSamples));
}

/// Runs of different settings must be independent of each other: no two share a seed of vlx-trace.
std::uint32_t seedOf(const SweepSampling& sampling, int seed) {
    return static_cast<std::uint32_t>(
        hashOf(seed, sampling.hierarchical ? 1 : 0, std::llround(sampling.setting * 1e6)) >> 33);
}

}  // namespace

int SweepPlan::repetitions(const SweepSampling& sampling) const {
    return fromDump ? std::min(options.seeds, dumpSamples / static_cast<int>(sampling.setting))
                    : options.seeds;
}

std::vector<const SweepMethod*> SweepPlan::methodsFor(const SweepSampling& sampling) const {
    std::vector<const SweepMethod*> methods;
    for (const SweepMethod& method : options.methods)
        if (!sampling.hierarchical || method.hierarchical) methods.push_back(&method);
    if (!sampling.hierarchical && sampling.setting == options.detailSpp)
        for (const SweepMethod& method : options.variations) methods.push_back(&method);
    return methods;
}

int SweepPlan::countSteps() const {
    int steps = 0;
    for (int seed = 1; seed <= options.seeds; ++seed)
        for (const SweepSampling& sampling : samplings)
            if (seed <= repetitions(sampling)) steps += 1 + static_cast<int>(methodsFor(sampling).size());
    return steps;
}

std::string SweepPlan::imageName(const std::string& name) const {
    return name + (frames.empty() ? ".exr" : "_####.exr");
}

std::vector<std::string> SweepPlan::files(const std::string& pattern) const {
    if (frames.empty()) return {pattern};
    std::vector<std::string> names;
    for (const int frame : frames) names.push_back(frameName(pattern, frame));
    return names;
}

std::string SweepPlan::samplingCommand(const SweepSampling& sampling, int seed) const {
    const std::string input = shellQuoted(options.input);
    if (fromDump)  // the parts of one division are disjoint
        return "vlx-pack subset " + input + " -o {output} --samples " + numberText(sampling.setting) +
               " --part " + std::to_string(seed - 1) + " --seed " + std::to_string(seedOf(sampling, 0));
    std::string command =
        "vlx-trace " + input + " -o {output} --json --seed " + std::to_string(seedOf(sampling, seed)) +
        (sampling.hierarchical ? " --hierarchical --tolerance " : " --spp ") + numberText(sampling.setting);
    if (options.width > 0) command += " --width " + std::to_string(options.width);
    if (options.height > 0) command += " --height " + std::to_string(options.height);
    if (options.threads > 0) command += " --threads " + std::to_string(options.threads);
    if (!frames.empty()) command += " --frames " + options.frames;
    return command + (options.traceArguments.empty() ? "" : " " + options.traceArguments);
}

std::string SweepPlan::methodCommand(const SweepMethod& method, const SweepSampling& sampling,
                                     int seed) const {
    const bool asSequence = !frames.empty() && firstWord(method.command) == "vlx-krige";
    return filled(method.command, {{"spp", numberText(sampling.setting)},
                                   {"seed", std::to_string(seed)},
                                   {"threads", std::to_string(options.threads)}}) +
           (asSequence ? " --frames " + options.frames : "");
}

std::string SweepPlan::executable(const std::string& command) const {
    const std::string program = firstWord(command);
    // What is run is timed: finished work of an interrupted sweep is not to be skipped.
    const bool skips = program == "vlx-trace" || program == "vlx-krige";
    return shellQuoted(programs.at(program).first) + command.substr(program.size()) +
           (skips ? " --overwrite" : "");
}

std::string SweepPlan::samplingKey(const std::string& command) const {
    return Fingerprint()
        .add("command", command)
        .add("input", inputIdentity)
        .add("program", programs.at(firstWord(command)).second)
        .text();
}

std::string SweepPlan::imageKey(const std::string& sampling, const SweepMethod& method,
                                const std::string& command) const {
    return Fingerprint()
        .add("command", command)
        .add("sampling", sampling)
        .add("reference", referenceIdentity)
        .add("program", programs.at(firstWord(command)).second)
        .add("judge", !references.empty() ? "" : programs.at("vlx-krige").second)  // assess_image.h
        .add("files", methodFiles.at(method.name))
        .text();
}

void SweepPlan::requireReferenceWindow(const Window& window) const {
    for (const ReferenceImage& reference : references)
        if (!(reference.colour.data == window))
            throw Error(options.reference, "expected the dump's " + windowText(window) + ", found " +
                                               windowText(reference.colour.data));
}

std::string shownFrame(const SweepOptions& options, const std::string& pattern) {
    if (options.frames.empty()) return pattern;
    const std::vector<int> frames = sortedFrames(options.frames);
    return frameName(pattern, frames[frames.size() / 2]);
}

SweepPlan planSweep(SweepOptions options, const std::function<void(const std::string&)>& log) {
    SweepPlan plan;
    plan.options = std::move(options);
    const std::string extension = fs::path(plan.options.input).extension().string();
    const bool scene = extension == ".glb" || extension == ".gltf";
    if (!scene && extension != ".exr")
        throw Error(plan.options.input, "expected a scene (.glb, .gltf) or a sample dump (.exr)");
    plan.fromDump = !scene;
    if (plan.options.seeds < 1) throw Error("", "expected at least one seed");
    if (!plan.options.frames.empty()) plan.frames = sortedFrames(plan.options.frames);
    plan.inputIdentity = fileFingerprint(plan.options.input);
    if (!plan.options.reference.empty()) readReference(plan);
    for (const char* program : {"vlx-trace", "vlx-pack", "vlx-krige"}) identify(plan, program);
    for (auto* methods : {&plan.options.methods, &plan.options.variations}) {
        std::erase_if(*methods, [&](const SweepMethod& m) {
            const bool unknown = plan.references.empty() && m.command.find("{sigma}") != std::string::npos;
            if (unknown && log)
                log(m.name + " is left out: its best sigma can only be told with a reference");
            return unknown;
        });
        for (const SweepMethod& method : *methods) {
            identify(plan, firstWord(method.command));
            plan.methodFiles[method.name] = namedFiles(method.command);
        }
    }
    scene ? prepareScene(plan) : prepareDump(plan);
    sortedOnce(plan.options.tolerances);
    sortedOnce(plan.options.spp);
    if (plan.options.detailSpp == 0)
        plan.options.detailSpp = plan.options.spp[(plan.options.spp.size() - 1) / 2];
    if (std::find(plan.options.spp.begin(), plan.options.spp.end(), plan.options.detailSpp) ==
        plan.options.spp.end())
        throw Error("", "expected details of one of the ladder's samples a pixel, found " +
                            std::to_string(plan.options.detailSpp));
    for (const int spp : plan.options.spp) plan.samplings.push_back({false, static_cast<double>(spp)});
    if (scene)  // the tracer's own way of sampling
        for (const double tolerance : plan.options.tolerances) plan.samplings.push_back({true, tolerance});
    return plan;
}

}  // namespace vlx
