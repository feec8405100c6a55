#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "variolux/compare/reliability.h"

/// What accuracy costs in time, measured: samplings of one scene (or of one dump with many samples) times
/// methods times seeds, each run as a program of its own and timed by the kernel.
namespace vlx {

/// A way to make an image of a dump: a shell command with places to fill in.
///   {input}    the dump (an EXR file; its first part is the plain average, for programs that read flat
///              images)
///   {output}   the EXR image to write: R, G, B and, where the method knows its error, stddev.R, .G, .B
///   {spp}      samples a pixel, {seed} the number of the repetition from 1, {threads} 0 or the limit
///   {sigma}    of the sigmas from 0.2 to 4 pixels that of the Gaussian filter which brings the plain average
///              of this dump nearest to the reference (least relMSE): only with a reference
/// A first word vlx-krige, vlx-trace or vlx-pack means this build's program. Of frames (SweepOptions::frames)
/// vlx-krige is run once, with --frames and files named by patterns, other programs once for each. If the
/// command prints a JSON object on standard output, its "seconds" (an object: stage -> seconds), or else its
/// readSeconds and solveSeconds, are the stages of its time.
struct SweepMethod {
    std::string name = {};
    std::string command = {};
    bool hierarchical = false;  ///< run on hierarchically sampled dumps as well
    /// The image is what the tracer has anyway, and costs no time after tracing.
    bool tracersOwn = false;
    /// Options to make it write DUMP-side diagnostics of chosen regions (see diagnosticsJson.h); empty:
    /// cannot.
    bool inspectable = false;
    bool ofSequences = false;  ///< frames add to each other: only with SweepOptions::frames
    /// Not empty: a variation of a method's option, run at one sampling only, for example "paper --region".
    std::string knob = {};
};

/// The built-in methods, by name.
const std::vector<SweepMethod>& builtInMethods();

/// Variations of built-in methods that show what accuracy costs inside kriging, as expandVariation() reads
/// them.
const std::vector<std::string>& builtInVariations();

/// The methods that a variation stands for: text "METHOD --option V1,V2,..." or "METHOD --flag", METHOD one
/// of `methods`. Throws Error on anything else.
std::vector<SweepMethod> expandVariation(const std::vector<SweepMethod>& methods, const std::string& text);

/// A user's method from text "NAME=COMMAND". Throws Error unless COMMAND contains {input} and {output}.
SweepMethod parseExternal(const std::string& text);

struct SweepOptions {
    std::string input;                 ///< a scene (.glb, .gltf) or a dump (.exr)
    std::string frames;                ///< of a scene, as vlx-trace --frames takes them; empty: one picture
    std::string reference;             ///< with frames a pattern, with #### for their numbers; may be empty
    std::string folder;                ///< made if need be
    std::string programs;              ///< folder of vlx-trace, vlx-krige, vlx-pack
    std::vector<SweepMethod> methods;  ///< none: only samplings
    std::vector<SweepMethod> variations;
    std::vector<int> spp;  ///< the ladder; empty: 4, 16, 64, 256 of a scene; of a dump all it holds, and up
                           ///< to four times the half of that
    std::vector<double> tolerances;  ///< of hierarchical sampling; scenes only
    int seeds = 3;                   ///< repetitions; of a dump at most as many as it has disjoint sub-sets
    int detailSpp = 0;  ///< the rung for variations and inspected regions; 0: the lower middle of the ladder
    int width = 0;      ///< of a scene's picture; 0: the reference's, or vlx-trace's default
    int height = 0;
    std::string traceArguments;  ///< further options of vlx-trace, for a scene
    double traceSeconds = 0;     ///< what the renderer took for the whole dump, if the dump does not say
    int threads = 0;
    int inspectedRegions = 64;  ///< spread evenly; a quarter as many with the largest errors are added
    bool keepDumps = false;
    bool overwrite = false;  ///< run again what is in the folder already
};

/// How a dump came about.
struct SweepSampling {
    bool hierarchical = false;
    double setting = 0;  ///< samples a pixel, or the tolerance
    bool operator==(const SweepSampling&) const = default;
};

/// "16 spp", "tolerance 0.1".
std::string samplingText(const SweepSampling& sampling);

/// The file of the frame that stands for all where one is shown, the middle one. Without frames: the name.
std::string shownFrame(const SweepOptions& options, const std::string& pattern);

enum class SweepKind {
    Sampling,    ///< a dump was traced, or taken from the input
    Image,       ///< an image was made of it
    Inspection,  ///< regions were looked at
};

/// One command that was run, and what came out: one line of results.jsonl. With frames it is of all of them:
/// seconds and bytes are sums, errors means.
struct SweepRecord {
    std::string key;  ///< hash of all that the result depends on
    SweepKind kind = SweepKind::Image;
    std::string method;  ///< of Image and Inspection
    std::string knob;    ///< its SweepMethod::knob
    SweepSampling sampling;
    int seed = 0;         ///< repetition, from 1
    std::string command;  ///< for people: samples.exr and image.exr stand for the files
    std::string failure;  ///< why it failed, empty if it did not. Failed commands are run again next time
    double samplesPerPixel = 0;  ///< of Sampling: the mean
    std::int64_t dumpBytes = 0;  ///< of Sampling
    double seconds = 0;  ///< wall time of the command; of a dump's sub-set: its share of the renderer's
                         ///< time, NaN when that is not known
    double cpuSeconds = 0;
    std::int64_t peakBytes = 0;
    double load = 0;                       ///< running processes a minute ago (load average): other work
    std::map<std::string, double> stages;  ///< wall seconds of its parts, as the command reports them
    /// Of Image: metrics by metricInfos' names when there is a reference; predicted_rmse and predicted_relmse
    /// where the image has a stddev layer, or where there is no reference (assess_image.h), with a reference
    /// also exact_pixels, those without error that know it; floor, the relMSE that a reference with a stddev
    /// layer adds by its own noise, on average; sigma where the command has one. Of Sampling by vlx-trace:
    /// trace_cpu_seconds, write_cpu_seconds. With frames and a reference also flicker (sequence.h), as the
    /// picture lies.
    std::map<std::string, double> values;
    std::optional<Reliability> reliability;  ///< with a reference and a stddev layer
    /// Kept image, with frames a pattern, or regions' JSON, relative to the folder; may be empty.
    std::string file;
};

std::string toJsonLine(const SweepRecord& record);

/// Throws Error, `path` naming the file, when the line is no record.
SweepRecord parseRecord(const std::string& line, const std::string& path);

/// One row a record, all fields but the reliability.
std::string toCsv(const std::vector<SweepRecord>& records);

struct Machine {
    std::string processor;
    int processors = 0;
    double memoryGigabytes = 0;
    std::string system;
};

/// What /proc and uname say of this computer.
Machine thisMachine();

/// All that a sweep found: the records that belong to its options, in the order of the plan.
struct Sweep {
    SweepOptions options;  ///< with the defaults filled in
    bool fromDump = false;
    bool samplingTimeKnown = true;
    Machine machine;
    std::string date;
    std::vector<SweepRecord> records;
    int reused = 0;  ///< records that were there already
};

/// Runs what is not yet in FOLDER/results.jsonl, adding a line for each command as it ends; then writes
/// results.csv. Images of the first repetition stay in FOLDER/images. An interrupted sweep goes on where it
/// was: only the command that was running is repeated, and the dump that it was reading traced again if it is
/// gone.
///
/// A record is taken as done when input, reference, command and programs are what they were, by content
/// (what a .gltf refers to is not looked at).
///
/// A method that fails is recorded so and the rest goes on. Throws Error when input or reference cannot be
/// read, their sizes differ, a program is missing (before anything is run), sampling fails, or another sweep
/// works in the folder. `log` is told each step.
Sweep runSweep(SweepOptions options, const std::function<void(const std::string&)>& log = {});

}  // namespace vlx
