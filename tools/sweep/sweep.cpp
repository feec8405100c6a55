#include "sweep/sweep.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "sweep/child_process.h"
#include "sweep/machine.h"
#include "sweep/sweep_images.h"
#include "sweep/sweep_store.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"
#include "variolux/compare/metrics.h"

namespace vlx {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kStddev = "stddev";

std::string filled(std::string text, const std::map<std::string, std::string>& places) {
    for (std::size_t at = text.find('{'); at != std::string::npos; at = text.find('{', at)) {
        const std::size_t end = text.find('}', at);
        const auto place =
            end == std::string::npos ? places.end() : places.find(text.substr(at + 1, end - at - 1));
        if (place == places.end()) {
            ++at;  // a brace of the shell's
            continue;
        }
        text.replace(at, end - at + 1, place->second);
        at += place->second.size();
    }
    return text;
}

/// Which scripts and other files a command names: a change of theirs changes its results.
std::string namedFiles(const std::string& command) {
    std::string identities;
    std::istringstream words(command);
    std::error_code ignored;
    for (std::string word; words >> word;)
        if (fs::is_regular_file(word, ignored)) identities += fileIdentity(word);
    return identities;
}

std::string firstWord(const std::string& command) { return command.substr(0, command.find(' ')); }

std::string numberText(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

std::string samplingText(const SweepSampling& sampling) {
    return sampling.hierarchical ? "tolerance " + numberText(sampling.setting)
                                 : numberText(sampling.setting) + " spp";
}

/// What a program of ours printed with --json.
Json reportOf(const ProcessRun& run, const std::string& command) {
    Json report = Json::parse(run.out, nullptr, false);
    if (!report.is_object()) throw Error(command, "expected a JSON report on standard output");
    return report;
}

/// One sweep while it runs.
class Runner {
  public:
    Runner(SweepOptions options, std::function<void(const std::string&)> log)
        : options_(std::move(options)), log_(std::move(log)) {}

    Sweep run() {
        prepare();
        std::error_code status;
        fs::create_directories(options_.folder + "/images", status);
        fs::create_directories(scratch(), status);
        if (status) throw Error(options_.folder, "expected to make this folder: " + status.message());
        ResultsFile results(options_.folder + "/results.jsonl", options_.overwrite);
        results_ = &results;
        total_ = countSteps();
        for (int seed = 1; seed <= options_.seeds; ++seed)
            for (const SweepSampling& sampling : samplings_)
                if (seed <= repetitions(sampling)) runSampling(sampling, seed);
        if (!options_.keepDumps) fs::remove_all(scratch(), status);
        writeCsv();
        results_ = nullptr;
        sweep_.options = options_;
        return std::move(sweep_);
    }

  private:
    struct Task {
        const SweepMethod* method;
        SweepRecord record;
    };

    void say(const std::string& text) const {
        if (log_) log_(text);
    }

    // --- before anything is run

    void prepare() {
        const std::string extension = fs::path(options_.input).extension().string();
        const bool scene = extension == ".glb" || extension == ".gltf";
        if (!scene && extension != ".exr")
            throw Error(options_.input, "expected a scene (.glb, .gltf) or a sample dump (.exr)");
        sweep_.fromDump = !scene;
        if (options_.methods.empty()) throw Error("", "expected at least one method");
        if (options_.seeds < 1) throw Error("", "expected at least one seed");
        inputIdentity_ = fileIdentity(options_.input);
        if (!options_.reference.empty()) readReference();
        for (const char* program : {"vlx-trace", "vlx-pack", "vlx-krige"}) identify(program);
        for (auto* methods : {&options_.methods, &options_.variations}) {
            std::erase_if(*methods, [&](const SweepMethod& m) {
                const bool unknown = !reference_ && m.command.find("{sigma}") != std::string::npos;
                if (unknown) say(m.name + " is left out: its best sigma can only be told with a reference");
                return unknown;
            });
            for (const SweepMethod& method : *methods) {
                identify(firstWord(method.command));
                methodFiles_[method.name] = namedFiles(method.command);
            }
        }
        scene ? prepareScene() : prepareDump();
        sortedOnce(options_.tolerances);
        sortedOnce(options_.spp);
        if (options_.detailSpp == 0) options_.detailSpp = options_.spp[(options_.spp.size() - 1) / 2];
        if (std::find(options_.spp.begin(), options_.spp.end(), options_.detailSpp) == options_.spp.end())
            throw Error("", "expected details of one of the ladder's samples a pixel, found " +
                                std::to_string(options_.detailSpp));
        for (const int spp : options_.spp) samplings_.push_back({false, static_cast<double>(spp)});
        if (scene)  // the tracer's own way of sampling
            for (const double tolerance : options_.tolerances) samplings_.push_back({true, tolerance});
        sweep_.machine = thisMachine();
        char date[32];
        const std::time_t now = std::time(nullptr);
        std::tm utc{};
        std::strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", ::gmtime_r(&now, &utc));
        sweep_.date = date;
    }

    template <typename Value>
    static void sortedOnce(std::vector<Value>& values) {
        std::sort(values.begin(), values.end());
        values.erase(std::unique(values.begin(), values.end()), values.end());
    }

    void readReference() {
        const Image image = readImage(options_.reference);
        reference_ = ReferenceImage{colourOf(image, options_.reference), {}};
        if (hasLayer(image, kStddev)) reference_->stddev = colourOf(image, options_.reference, kStddev);
        referenceIdentity_ = fileIdentity(options_.reference);
    }

    /// Finds the program, and what tells this version of it from others.
    void identify(const std::string& program) {
        if (programs_.contains(program)) return;
        std::string path = options_.programs + "/" + program;
        if (!program.starts_with("vlx-") || !fs::exists(path)) {
            ProcessRun found = runCommand("command -v " + program);
            if (found.exitCode != 0 || found.out.empty())
                throw Error(program, "expected a program that the shell finds");
            found.out.erase(found.out.find_last_not_of('\n') + 1);
            path = found.out;
        }
        std::error_code ignored;
        // A shell builtin is no file: its name has to do.
        const std::string identity = fs::is_regular_file(path, ignored) ? fileIdentity(path) : path;
        programs_[program] = {path, identity};
    }

    void prepareScene() {
        if (reference_) {
            const Window& window = reference_->colour.display;  // of a crop, the whole picture
            if (options_.width == 0) options_.width = window.width;
            if (options_.height == 0) options_.height = window.height;
            if (options_.width != window.width || options_.height != window.height)
                throw Error(options_.reference, "expected a reference of " + std::to_string(options_.width) +
                                                    " x " + std::to_string(options_.height) +
                                                    " pixels, found " + std::to_string(window.width) + " x " +
                                                    std::to_string(window.height));
        }
        if (options_.spp.empty()) options_.spp = {4, 16, 64, 256};
    }

    void requireReferenceWindow(const Window& window) const {
        const auto text = [](const Window& w) {
            return std::to_string(w.width) + " x " + std::to_string(w.height) + " pixels at (" +
                   std::to_string(w.x) + ", " + std::to_string(w.y) + ")";
        };
        const Window& found = reference_->colour.data;
        if (!(found == window))
            throw Error(options_.reference, "expected the dump's " + text(window) + ", found " + text(found));
    }

    void prepareDump() {
        const ProcessRun run =
            runCommand(executable("vlx-pack info " + shellQuoted(options_.input) + " --json"));
        if (run.exitCode != 0) throw Error("", "vlx-pack info failed: " + run.err);
        const Json info = reportOf(run, "vlx-pack info");
        const Window window{info.at("dataWindow").at("x"), info.at("dataWindow").at("y"),
                            info.at("dataWindow").at("width"), info.at("dataWindow").at("height")};
        if (reference_) requireReferenceWindow(window);
        dumpSamples_ = info.at("samples").at("min");
        const int replicates = info.at("samples").at("replicates");
        if (dumpSamples_ < 1)
            throw Error(options_.input, "expected samples in every pixel, found an empty one");
        if (options_.traceSeconds == 0 && info.contains("renderSeconds"))
            options_.traceSeconds = info.at("renderSeconds");
        sweep_.samplingTimeKnown = options_.traceSeconds > 0;
        meanSamples_ = info.at("samples").at("mean");
        if (options_.spp.empty())
            for (int spp = dumpSamples_; spp > 0 && options_.spp.size() < 5; spp /= 2) {
                if (replicates > 1 && std::fmod(static_cast<double>(spp) * replicates, meanSamples_) != 0)
                    break;
                options_.spp.insert(options_.spp.begin(), spp);
                if (spp % 2 != 0) break;
            }
        for (const int spp : options_.spp)
            if (spp > dumpSamples_)
                throw Error(options_.input, "expected at least " + std::to_string(spp) +
                                                " samples in every pixel, found " +
                                                std::to_string(dumpSamples_));
    }

    // --- the plan

    /// Of a dump no more than it has disjoint sub-sets.
    int repetitions(const SweepSampling& sampling) const {
        return sweep_.fromDump ? std::min(options_.seeds, dumpSamples_ / static_cast<int>(sampling.setting))
                               : options_.seeds;
    }

    std::vector<const SweepMethod*> methodsFor(const SweepSampling& sampling) const {
        std::vector<const SweepMethod*> methods;
        for (const SweepMethod& method : options_.methods)
            if (!sampling.hierarchical || method.hierarchical) methods.push_back(&method);
        if (!sampling.hierarchical && sampling.setting == options_.detailSpp)
            for (const SweepMethod& method : options_.variations) methods.push_back(&method);
        return methods;
    }

    int countSteps() const {
        int steps = 0;
        for (int seed = 1; seed <= options_.seeds; ++seed)
            for (const SweepSampling& sampling : samplings_)
                if (seed <= repetitions(sampling)) steps += 1 + static_cast<int>(methodsFor(sampling).size());
        return steps;
    }

    /// Runs of different settings must be independent of each other: no two share a seed of vlx-trace.
    static std::uint32_t seedOf(const SweepSampling& sampling, int seed) {
        return static_cast<std::uint32_t>(
            hashOf(seed, sampling.hierarchical ? 1 : 0, std::llround(sampling.setting * 1e6)) >> 33);
    }

    std::string samplingCommand(const SweepSampling& sampling, int seed) const {
        const std::string input = shellQuoted(options_.input);
        if (sweep_.fromDump)  // the parts of one division are disjoint
            return "vlx-pack subset " + input + " -o {output} --samples " + numberText(sampling.setting) +
                   " --part " + std::to_string(seed - 1) + " --seed " + std::to_string(seedOf(sampling, 0));
        std::string command = "vlx-trace " + input + " -o {output} --json --seed " +
                              std::to_string(seedOf(sampling, seed)) +
                              (sampling.hierarchical ? " --hierarchical --tolerance " : " --spp ") +
                              numberText(sampling.setting);
        if (options_.width > 0) command += " --width " + std::to_string(options_.width);
        if (options_.height > 0) command += " --height " + std::to_string(options_.height);
        if (options_.threads > 0) command += " --threads " + std::to_string(options_.threads);
        return command + (options_.traceArguments.empty() ? "" : " " + options_.traceArguments);
    }

    std::string methodCommand(const SweepMethod& method, const SweepSampling& sampling, int seed) const {
        return filled(method.command, {{"spp", numberText(sampling.setting)},
                                       {"seed", std::to_string(seed)},
                                       {"threads", std::to_string(options_.threads)}});
    }

    std::string executable(const std::string& command) const {
        const std::string program = firstWord(command);
        // What is run is timed: finished work of an interrupted sweep is not to be skipped.
        const bool skips = program == "vlx-trace" || program == "vlx-krige";
        return shellQuoted(programs_.at(program).first) + command.substr(program.size()) +
               (skips ? " --overwrite" : "");
    }

    std::string samplingKey(const std::string& command) const {
        return hexText(textHash(command, textHash(inputIdentity_ + programs_.at(firstWord(command)).second)));
    }

    std::string imageKey(const std::string& sampling, const SweepMethod& method,
                         const std::string& command) const {
        return hexText(textHash(
            command, textHash(sampling + referenceIdentity_ + programs_.at(firstWord(command)).second +
                              methodFiles_.at(method.name))));
    }

    // --- the work

    void announce(const std::string& what, const SweepSampling& sampling, int seed, const SweepRecord& record,
                  bool reused) {
        ++step_;
        char time[32];
        std::snprintf(time, sizeof time, "%.2f s", record.seconds);
        std::string text = "[" + std::to_string(step_) + "/" + std::to_string(total_) + "] " + what + ", " +
                           samplingText(sampling) + ", seed " + std::to_string(seed) + ": ";
        text += !record.failure.empty() ? "failed: " + record.failure
                                        : (std::isfinite(record.seconds) ? std::string(time) : "done");
        say(text + (reused ? " (done before)" : ""));
    }

    /// Where dumps and images are until they are measured.
    std::string scratch() const { return options_.folder + "/scratch"; }

    void runSampling(const SweepSampling& sampling, int seed) {
        const std::string command = samplingCommand(sampling, seed);
        const std::string key = samplingKey(command);
        const std::string dump = scratch() + "/" + key + ".exr";

        std::vector<Task> tasks;
        for (const SweepMethod* method : methodsFor(sampling)) {
            SweepRecord record;
            record.method = method->name;
            record.knob = method->knob;
            record.sampling = sampling;
            record.seed = seed;
            record.command = methodCommand(*method, sampling, seed);
            record.key = imageKey(key, *method, record.command);
            if (seed == 1 && method->knob.empty()) record.file = "images/" + record.key + ".exr";
            tasks.push_back({method, record});
        }

        const SweepRecord* known = results_->find(key);
        const bool needed = std::any_of(tasks.begin(), tasks.end(), [&](const Task& task) {
            return !done(task.record) || (inspects(task) && !doneInspection(task.record));
        });
        SweepRecord traced = known ? *known : SweepRecord{};
        const bool reused = known && (!needed || fs::exists(dump));
        if (!reused) traced = sample(command, key, dump, sampling, seed);
        if (reused) ++sweep_.reused;
        announce(sweep_.fromDump ? "sub-set" : "tracing", sampling, seed, traced, reused);
        sweep_.records.push_back(traced);

        for (const Task& task : tasks) {
            const SweepRecord* before = done(task.record);
            if (before) ++sweep_.reused;
            const SweepRecord record = before ? *before : makeImage(task, dump);
            announce(record.method, sampling, seed, record, before != nullptr);
            sweep_.records.push_back(record);
            if (inspects(task) && record.failure.empty()) inspect(task, record, dump);
        }
        std::error_code ignored;
        if (!options_.keepDumps) fs::remove(dump, ignored);
    }

    const SweepRecord* done(const SweepRecord& record) const {
        const SweepRecord* found = results_->find(record.key);
        return found && (record.file.empty() || fs::exists(options_.folder + "/" + record.file)) ? found
                                                                                                 : nullptr;
    }

    SweepRecord sample(const std::string& command, const std::string& key, const std::string& dump,
                       const SweepSampling& sampling, int seed) {
        SweepRecord record;
        record.kind = SweepKind::Sampling;
        record.key = key;
        record.sampling = sampling;
        record.seed = seed;
        record.command = filled(command, {{"output", "samples.exr"}});
        record.load = loadAverage();
        const ProcessRun run = runCommand(executable(filled(command, {{"output", shellQuoted(dump)}})));
        if (run.exitCode != 0)
            throw Error(
                "", record.command + " failed (exit code " + std::to_string(run.exitCode) + "):\n" + run.err);
        if (reference_) requireReferenceWindow(readImage(dump).data);
        record.dumpBytes = static_cast<std::int64_t>(fs::file_size(dump));
        if (sweep_.fromDump) {
            record.samplesPerPixel = sampling.setting;
            record.seconds =
                sweep_.samplingTimeKnown ? options_.traceSeconds * sampling.setting / meanSamples_ : kNan;
            record.cpuSeconds = kNan;  // the renderer's, not ours to know
            if (sweep_.samplingTimeKnown) record.stages["trace"] = record.seconds;
        } else {
            const Json report = reportOf(run, record.command);
            const double trace = report.at("traceSeconds"), write = report.at("writeCpuSeconds");
            const double pixels = report.at("width").get<double>() * report.at("height").get<double>();
            record.samplesPerPixel = report.at("samples").get<double>() / pixels;
            record.seconds = run.seconds;
            record.cpuSeconds = run.cpuSeconds();
            record.peakBytes = run.peakBytes;
            // Writing goes on beside tracing: of the wall time it gets its share of the processors.
            const double written = std::min(trace, write / report.at("threads").get<double>());
            record.stages = {{"trace", trace - written},
                             {"write dump", written},
                             {"load scene", std::max(0.0, run.seconds - trace)}};
        }
        results_->add(record);
        return record;
    }

    /// Only what is complete gets its place among the results.
    static void moveTo(const std::string& to, const std::string& from) {
        std::error_code status;
        fs::rename(from, to, status);
        if (status) throw Error(to, "expected to move '" + from + "' here: " + status.message());
    }

    SweepRecord makeImage(const Task& task, const std::string& dump) {
        SweepRecord record = task.record;
        const std::string image = scratch() + "/" + record.key + ".image.exr";
        if (record.command.find("{sigma}") != std::string::npos) {
            const double sigma =
                bestSigma(colourOf(readImage(dump), dump), reference_->colour, options_.input);
            record.values["sigma"] = sigma;
            record.command = filled(record.command, {{"sigma", numberText(sigma)}});
        }
        record.load = loadAverage();
        std::error_code ignored;
        fs::remove(image, ignored);
        const ProcessRun run = runCommand(executable(
            filled(record.command, {{"input", shellQuoted(dump)}, {"output", shellQuoted(image)}})));
        record.command = filled(record.command, {{"input", "samples.exr"}, {"output", "image.exr"}});
        record.seconds = run.seconds;
        record.cpuSeconds = run.cpuSeconds();
        record.peakBytes = run.peakBytes;
        if (run.exitCode != 0)
            record.failure = failureOf(run);
        else
            judge(record, run, image);
        if (record.failure.empty() && !record.file.empty())
            moveTo(options_.folder + "/" + record.file, image);
        else
            fs::remove(image, ignored);
        results_->add(record);
        return record;
    }

    /// Metrics, predicted error and stages of an image that was made.
    void judge(SweepRecord& record, const ProcessRun& run, const std::string& path) const {
        try {
            const Image image = readImage(path);
            const Image colour = colourOf(image, path);
            std::optional<Image> stddev;
            if (hasLayer(image, kStddev)) stddev = colourOf(image, path, kStddev);
            if (reference_) {
                const Comparison comparison = compareColour(reference_->colour, colour, path);
                for (const MetricInfo& info : metricInfos())
                    record.values[std::string(info.name)] = comparison[info.metric];
                if (stddev)
                    record.reliability =
                        reliabilityOf(reference_->colour, colour, *stddev, reference_->stddev, path);
            }
            if (stddev) {
                const PredictedError predicted = predictedError(colour, *stddev, path);
                record.values["predicted_rmse"] = predicted.rmse;
                record.values["predicted_relmse"] = predicted.relMse;
            }
        } catch (const Error& error) {
            record.failure = error.what();
            return;
        }
        record.stages = stagesOf(run);
    }

    static std::map<std::string, double> stagesOf(const ProcessRun& run) {
        std::map<std::string, double> stages;
        const Json report = Json::parse(run.out, nullptr, false);
        if (report.is_object()) {
            if (const auto seconds = report.find("seconds");
                seconds != report.end() && seconds->is_object()) {
                for (const auto& [stage, value] : seconds->items())
                    if (value.is_number()) stages[stage] = value;
            } else {
                for (const auto& [field, stage] :
                     {std::pair{"readSeconds", "read"}, {"solveSeconds", "solve"}})
                    if (const auto value = report.find(field); value != report.end() && value->is_number())
                        stages[stage] = *value;
            }
        }
        double rest = run.seconds;
        for (const auto& [stage, value] : stages) rest -= value;
        stages["other"] = std::max(0.0, rest);
        return stages;
    }

    static std::string failureOf(const ProcessRun& run) {
        std::string text = run.err;
        text.erase(text.find_last_not_of(" \n") + 1);
        const std::size_t end = text.rfind('\n');
        if (end != std::string::npos) text = text.substr(end + 1);
        for (char& c : text)  // a terminal would obey them
            if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
        return "exit code " + std::to_string(run.exitCode) + (text.empty() ? "" : ": " + text);
    }

    // --- regions

    bool inspects(const Task& task) const {
        return task.method->inspectable && options_.inspectedRegions > 0 && task.record.seed == 1 &&
               !task.record.sampling.hierarchical && task.record.sampling.setting == options_.detailSpp;
    }

    std::string inspectionKey(const SweepRecord& record) const {
        return hexText(textHash(record.key + " inspect " + std::to_string(options_.inspectedRegions)));
    }

    const SweepRecord* doneInspection(const SweepRecord& record) const {
        const SweepRecord* found = results_->find(inspectionKey(record));
        return found && fs::exists(options_.folder + "/" + found->file) ? found : nullptr;
    }

    void inspect(const Task& task, const SweepRecord& image, const std::string& dump) {
        SweepRecord record;
        if (const SweepRecord* before = doneInspection(image)) {
            record = *before;
            ++sweep_.reused;
        } else {
            record = image;
            record.kind = SweepKind::Inspection;
            record.key = inspectionKey(image);
            record.values.clear();
            record.stages.clear();
            record.reliability.reset();
            record.file = "images/" + record.key + ".exr.json";
            const std::string path = options_.folder + "/" + image.file;
            const Image made = readImage(path);
            const Image colour = colourOf(made, path);
            std::optional<Image> stddev;
            if (hasLayer(made, kStddev)) stddev = colourOf(made, path, kStddev);
            std::string command = methodCommand(*task.method, image.sampling, image.seed) + " --diagnostics";
            for (const auto& [x, y] :
                 inspectedPixels(errorImage(colour, stddev, reference_), options_.inspectedRegions))
                command += " --inspect " + std::to_string(x) + "," + std::to_string(y);
            const std::string output = scratch() + "/" + record.key + ".exr";
            const ProcessRun run = runCommand(
                executable(filled(command, {{"input", shellQuoted(dump)}, {"output", shellQuoted(output)}})));
            record.command = filled(command, {{"input", "samples.exr"}, {"output", "image.exr"}});
            record.seconds = run.seconds;
            record.cpuSeconds = run.cpuSeconds();
            record.peakBytes = run.peakBytes;
            if (run.exitCode != 0)
                record.failure = failureOf(run);
            else
                moveTo(options_.folder + "/" + record.file, output + ".json");
            std::error_code ignored;
            fs::remove(output, ignored);
            results_->add(record);
        }
        sweep_.records.push_back(record);
    }

    void writeCsv() const {
        OutputFile file(options_.folder + "/results.csv");
        std::ofstream stream(file.temporaryPath(), std::ios::binary);
        stream << toCsv(sweep_.records);
        stream.close();
        if (!stream) throw Error(file.path(), "writing failed");
        file.commit();
    }

    SweepOptions options_;
    std::function<void(const std::string&)> log_;
    Sweep sweep_;
    std::vector<SweepSampling> samplings_;
    std::optional<ReferenceImage> reference_;
    std::string inputIdentity_, referenceIdentity_;
    std::map<std::string, std::pair<std::string, std::string>> programs_;  // name -> path, identity
    std::map<std::string, std::string> methodFiles_;                       // by method
    ResultsFile* results_ = nullptr;
    int dumpSamples_ = 0;
    double meanSamples_ = 0;
    int step_ = 0, total_ = 0;
};

}  // namespace

Sweep runSweep(SweepOptions options, const std::function<void(const std::string&)>& log) {
    return Runner(std::move(options), log).run();
}

}  // namespace vlx
