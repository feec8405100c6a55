#include "sweep/sweep.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "process/child_process.h"
#include "sweep/judge_images.h"
#include "sweep/machine.h"
#include "sweep/sweep_command.h"
#include "sweep/sweep_images.h"
#include "sweep/sweep_plan.h"
#include "sweep/sweep_store.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"
#include "variolux/base/text.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/metrics.h"

namespace vlx {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// One sweep while it runs.
class Runner {
  public:
    Runner(SweepPlan plan, std::function<void(const std::string&)> log)
        : plan_(std::move(plan)), log_(std::move(log)) {}

    Sweep run() {
        describe();
        std::error_code status;
        fs::create_directories(plan_.options.folder + "/images", status);
        fs::create_directories(scratch(), status);
        if (status) throw Error(plan_.options.folder, "expected to make this folder: " + status.message());
        ResultsFile results(plan_.options.folder + "/results.jsonl", plan_.options.overwrite);
        results_ = &results;
        total_ = plan_.countSteps();
        for (int seed = 1; seed <= plan_.options.seeds; ++seed)
            for (const SweepSampling& sampling : plan_.samplings)
                if (seed <= plan_.repetitions(sampling)) runSampling(sampling, seed);
        if (!plan_.options.keepDumps) fs::remove_all(scratch(), status);
        writeCsv();
        results_ = nullptr;
        sweep_.options = plan_.options;
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

    /// What the sweep says of itself, but for its records.
    void describe() {
        sweep_.fromDump = plan_.fromDump;
        sweep_.samplingTimeKnown = plan_.samplingTimeKnown;
        sweep_.machine = thisMachine();
        char date[32];
        const std::time_t now = std::time(nullptr);
        std::tm utc{};
        std::strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", ::gmtime_r(&now, &utc));
        sweep_.date = date;
    }

    // --- the work

    void announce(const std::string& what, const SweepSampling& sampling, int seed, const SweepRecord& record,
                  bool reused) {
        ++step_;
        std::string text = "[" + std::to_string(step_) + "/" + std::to_string(total_) + "] " + what + ", " +
                           samplingText(sampling) + ", seed " + std::to_string(seed) + ": ";
        text += !record.failure.empty()
                    ? "failed: " + record.failure
                    : (std::isfinite(record.seconds) ? formatted("%.2f s", record.seconds) : "done");
        say(text + (reused ? " (done before)" : ""));
    }

    /// Where dumps and images are until they are measured.
    std::string scratch() const { return plan_.options.folder + "/scratch"; }

    void runSampling(const SweepSampling& sampling, int seed) {
        const std::string command = plan_.samplingCommand(sampling, seed);
        const std::string key = plan_.samplingKey(command);
        const std::string dump = scratch() + "/" + plan_.imageName(key);

        std::vector<Task> tasks;
        for (const SweepMethod* method : plan_.methodsFor(sampling)) {
            SweepRecord record;
            record.method = method->name;
            record.knob = method->knob;
            record.sampling = sampling;
            record.seed = seed;
            record.command = plan_.methodCommand(*method, sampling, seed);
            record.key = plan_.imageKey(key, *method, record.command);
            if (seed == 1 && method->knob.empty()) record.file = "images/" + plan_.imageName(record.key);
            tasks.push_back({method, record});
        }

        const SweepRecord* known = results_->find(key);
        const bool needed = std::any_of(tasks.begin(), tasks.end(), [&](const Task& task) {
            return !done(task.record) || (inspects(task) && !doneInspection(task.record));
        });
        SweepRecord traced = known ? *known : SweepRecord{};
        const bool reused = known && (!needed || areThere(dump));
        if (!reused) traced = sample(command, key, dump, sampling, seed);
        if (reused) ++sweep_.reused;
        announce(plan_.fromDump ? "sub-set" : "tracing", sampling, seed, traced, reused);
        sweep_.records.push_back(traced);

        for (const Task& task : tasks) {
            const SweepRecord* before = done(task.record);
            if (before) ++sweep_.reused;
            SweepRecord record = before ? *before : makeImage(task, dump);
            record.method = task.record.method;  // the same command may have another name now
            announce(record.method, sampling, seed, record, before != nullptr);
            sweep_.records.push_back(record);
            if (inspects(task) && record.failure.empty()) inspect(task, record, dump);
        }
        if (!plan_.options.keepDumps) remove(dump);
    }

    // Of patterns: all frames.
    bool areThere(const std::string& pattern) const {
        const std::vector<std::string> files = plan_.files(pattern);
        return std::all_of(files.begin(), files.end(),
                           [](const std::string& file) { return fs::exists(file); });
    }
    void remove(const std::string& pattern) const {
        std::error_code ignored;
        for (const std::string& file : plan_.files(pattern)) fs::remove(file, ignored);
    }

    const SweepRecord* done(const SweepRecord& record) const {
        const SweepRecord* found = results_->find(record.key);
        return found && (record.file.empty() || areThere(plan_.options.folder + "/" + record.file)) ? found
                                                                                                    : nullptr;
    }

    /// What a run took.
    static void take(const ProcessRun& run, SweepRecord& record) {
        record.seconds = run.seconds;
        record.cpuSeconds = run.cpuSeconds();
        record.peakBytes = run.peakBytes;
    }

    SweepRecord sample(const std::string& command, const std::string& key, const std::string& dump,
                       const SweepSampling& sampling, int seed) {
        SweepRecord record;
        record.kind = SweepKind::Sampling;
        record.key = key;
        record.sampling = sampling;
        record.seed = seed;
        record.command = filled(command, {{"output", plan_.imageName("samples")}});
        record.load = loadAverage();
        const ProcessRun run = runCommand(plan_.executable(filled(command, {{"output", shellQuoted(dump)}})));
        if (run.exitCode != 0)
            throw Error(
                "", record.command + " failed (exit code " + std::to_string(run.exitCode) + "):\n" + run.err);
        for (const std::string& file : plan_.files(dump)) {
            if (!plan_.references.empty()) plan_.requireReferenceWindow(readImage(file).data);
            record.dumpBytes += static_cast<std::int64_t>(fs::file_size(file));
        }
        if (plan_.fromDump) {
            record.samplesPerPixel = sampling.setting;
            record.seconds = plan_.samplingTimeKnown
                                 ? plan_.options.traceSeconds * sampling.setting / plan_.meanSamples
                                 : kNan;
            record.cpuSeconds = kNan;  // the renderer's, not ours to know
            if (plan_.samplingTimeKnown) record.stages["trace"] = record.seconds;
        } else {
            double trace = 0, write = 0, rays = 0, samples = 0, pixels = 0;
            for (const Json& report : reportsOf(run, record.command)) {
                trace += report.at("traceSeconds").get<double>();
                write += report.at("writeCpuSeconds").get<double>();
                rays += report.at("traceCpuSeconds").get<double>();
                samples += report.at("samples").get<double>();
                pixels += report.at("width").get<double>() * report.at("height").get<double>();
            }
            record.samplesPerPixel = samples / pixels;
            take(run, record);
            record.values = {{"trace_cpu_seconds", rays}, {"write_cpu_seconds", write}};
            // Writing goes on beside tracing: of the wall time it gets its share of the processor's.
            const double written = trace * write / std::max(write + rays, 1e-9);
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
        const std::string image = scratch() + "/" + plan_.imageName(record.key + ".image");
        if (record.command.find("{sigma}") != std::string::npos) {
            const std::size_t middle = plan_.frames.size() / 2;
            const double sigma = bestSigma(readColour(plan_.files(dump)[middle]).colour,
                                           plan_.references[middle].colour, plan_.options.input);
            record.values["sigma"] = sigma;
            record.command = filled(record.command, {{"sigma", numberText(sigma)}});
        }
        record.load = loadAverage();
        remove(image);
        const ProcessRun run = runMethod(record.command, dump, image);
        record.command = filled(
            record.command, {{"input", plan_.imageName("samples")}, {"output", plan_.imageName("image")}});
        take(run, record);
        if (run.exitCode != 0)
            record.failure = failureOf(run);
        else
            judge(record, run, image, dump, task);
        if (record.failure.empty() && !record.file.empty()) {
            const std::vector<std::string> made = plan_.files(image);
            const std::vector<std::string> kept = plan_.files(plan_.options.folder + "/" + record.file);
            for (std::size_t i = 0; i < made.size(); ++i) moveTo(kept[i], made[i]);
        } else {
            remove(image);
        }
        results_->add(record);
        return record;
    }

    /// Once, or for each frame until one fails.
    ProcessRun runMethod(const std::string& command, const std::string& dump,
                         const std::string& image) const {
        const auto runOn = [&](const std::string& input, const std::string& output) {
            return runCommand(plan_.executable(
                filled(command, {{"input", shellQuoted(input)}, {"output", shellQuoted(output)}})));
        };
        if (firstWord(command) == "vlx-krige") return runOn(dump, image);
        const std::vector<std::string> inputs = plan_.files(dump), outputs = plan_.files(image);
        ProcessRun all;
        for (std::size_t i = 0; i < inputs.size() && all.exitCode == 0; ++i) {
            const ProcessRun run = runOn(inputs[i], outputs[i]);
            all.exitCode = run.exitCode;
            all.seconds += run.seconds;
            all.userSeconds += run.userSeconds;
            all.systemSeconds += run.systemSeconds;
            all.peakBytes = std::max(all.peakBytes, run.peakBytes);
            all.out += run.out;
            all.err = run.err;
        }
        return all;
    }

    void judge(SweepRecord& record, const ProcessRun& run, const std::string& image, const std::string& dump,
               const Task& task) const {
        try {
            judgeImages(plan_, plan_.methodCommand(*task.method, record.sampling, record.seed), dump, image,
                        scratch() + "/" + record.key, record);
        } catch (const Error& error) {
            record.failure = error.what();
            return;
        }
        if (const auto halves = record.values.find("assessed_by_halves");
            halves != record.values.end() && halves->second < 1)
            say(record.method + ", " + samplingText(record.sampling) +
                ": its images of half the samples failed or do not fit; its error is less well known");
        record.stages = stagesOf(run);
    }

    // --- regions

    bool inspects(const Task& task) const {
        return task.method->inspectable && plan_.options.inspectedRegions > 0 && task.record.seed == 1 &&
               !task.record.sampling.hierarchical && task.record.sampling.setting == plan_.options.detailSpp;
    }

    std::string inspectionKey(const SweepRecord& record) const {
        return Fingerprint()
            .add("image", record.key)
            .add("inspect", std::to_string(plan_.options.inspectedRegions))
            .text();
    }

    const SweepRecord* doneInspection(const SweepRecord& record) const {
        const SweepRecord* found = results_->find(inspectionKey(record));
        return found && fs::exists(plan_.options.folder + "/" + found->file) ? found : nullptr;
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
            const std::string path = plan_.options.folder + "/" + image.file;
            const ColourImage made = readColour(path, {}, true);
            const ReferenceImage* reference = plan_.references.empty() ? nullptr : &plan_.references.front();
            std::string command =
                plan_.methodCommand(*task.method, image.sampling, image.seed) + " --diagnostics";
            for (const auto& [x, y] : inspectedPixels(errorImage(made.colour, made.stddev, reference),
                                                      plan_.options.inspectedRegions))
                command += " --inspect " + std::to_string(x) + "," + std::to_string(y);
            const std::string output = scratch() + "/" + record.key + ".exr";
            const ProcessRun run = runCommand(plan_.executable(
                filled(command, {{"input", shellQuoted(dump)}, {"output", shellQuoted(output)}})));
            record.command = filled(command, {{"input", "samples.exr"}, {"output", "image.exr"}});
            take(run, record);
            if (run.exitCode != 0)
                record.failure = failureOf(run);
            else
                moveTo(plan_.options.folder + "/" + record.file, output + ".json");
            std::error_code ignored;
            fs::remove(output, ignored);
            results_->add(record);
        }
        sweep_.records.push_back(record);
    }

    void writeCsv() const { writeFile(plan_.options.folder + "/results.csv", toCsv(sweep_.records)); }

    SweepPlan plan_;
    std::function<void(const std::string&)> log_;
    Sweep sweep_;
    ResultsFile* results_ = nullptr;
    int step_ = 0, total_ = 0;
};

}  // namespace

Sweep runSweep(SweepOptions options, const std::function<void(const std::string&)>& log) {
    return Runner(planSweep(std::move(options), log), log).run();
}

}  // namespace vlx
