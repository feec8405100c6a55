#include "sweep/compare_sweep.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "frames.h"
#include "process/child_process.h"
#include "sweep/sweep.h"
#include "sweep/sweep_page.h"
#include "sweep/sweep_summary.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/picture.h"

namespace vlx {

namespace {

struct SweepCommand {
    SweepOptions options;
    std::vector<std::string> methods;
    std::vector<std::string> externals;
    std::vector<std::string> variations;
    std::vector<std::string> targets;
    std::vector<std::string> crops;
    bool noVariations = false;
    bool json = false;

    void bind(CLI::App& app) {
        SweepOptions& o = options;
        app.add_option("INPUT", o.input,
                       "A scene (.glb, .gltf), which vlx-trace samples, or a dump with many samples a pixel "
                       "(.exr), of which sub-sets are taken")
            ->required();
        app.add_option("-o,--output", o.folder,
                       "Folder for report.html, results.csv, results.jsonl and images; what is in it already "
                       "is not run again")
            ->option_text("FOLDER")
            ->required();
        app.add_option("--reference", o.reference,
                       "Image to measure errors against; without one the errors are those that the error "
                       "maps predict, and of images without a map those that vlx-krige --assess tells "
                       "(for which their command is run twice more)")
            ->option_text("IMAGE");
        auto* frames =
            app.add_option("--frames", o.frames,
                           "Of a scene: trace and judge these frames, for example 1-8; errors are means over "
                           "them, times sums. #### in the reference's name stands for a frame's number. "
                           "vlx-krige gets all at once, other programs one by one. Adds the methods that "
                           "need frames, and flicker")
                ->option_text("LIST");
        app.add_option("--seeds", o.seeds, "Repetitions with independent samples, for the intervals")
            ->check(CLI::Range(1, 1000))
            ->capture_default_str();
        app.add_option("--threads", o.threads, "Threads of the programs; 0: all processors")
            ->check(CLI::Range(0, 1024))
            ->option_text("N");

        app.add_flag("--overwrite", o.overwrite,
                     "Run again what is in FOLDER already and was made by these very programs from the same "
                     "inputs with the same parameters, which is else skipped");

        const char* const sampling = "Sampling";
        app.add_option("--spp", o.spp,
                       "Samples a pixel (default: 4,16,64,256; of a dump all it holds, halved up to four "
                       "times)")
            ->delimiter(',')
            ->check(CLI::Range(1, 1 << 24))
            ->option_text("N,N,...")
            ->group(sampling);
        app.add_option("--hierarchical", o.tolerances,
                       "Also sample the scene hierarchically, to these tolerances")
            ->delimiter(',')
            ->check(finiteNonNegative())
            ->option_text("T,T,...")
            ->group(sampling);
        app.add_option("--width", o.width,
                       "Of the scene's picture (default: the reference's, or vlx-trace's)")
            ->check(CLI::Range(1, 1 << 16))
            ->option_text("N")
            ->group(sampling);
        app.add_option("--height", o.height, "Of the scene's picture")
            ->check(CLI::Range(1, 1 << 16))
            ->option_text("N")
            ->group(sampling);
        app.add_option("--trace-options", o.traceArguments, "More options for vlx-trace, as one text")
            ->option_text("'...'")
            ->group(sampling);
        app.add_option("--trace-seconds", o.traceSeconds,
                       "Seconds that the renderer took for the whole dump, if the dump does not say")
            ->check(finitePositive())
            ->option_text("S")
            ->group(sampling);
        app.add_flag("--keep-dumps", o.keepDumps, "Keep the dumps in FOLDER/scratch")->group(sampling);

        const char* const how = "Methods";
        std::string names;
        for (const SweepMethod& method : builtInMethods())
            names += (names.empty() ? "" : ",") + method.name + (method.ofSequences ? " with --frames" : "");
        app.add_option("--methods", methods,
                       "Built-in methods (default: " + names +
                           "); none: only those of --external, or only sampling if there are none")
            ->delimiter(',')
            ->option_text("NAME,...")
            ->group(how);
        app.add_option("--external", externals,
                       "Another program as a method: a shell command with {input} for the dump (its first "
                       "part is a flat image) and {output} for the EXR to write; also {spp}, {seed}, "
                       "{threads}. Repeatable")
            ->option_text("NAME='...'")
            ->take_all()
            ->expected(1)
            ->group(how);
        std::string builtIn;
        for (const std::string& text : builtInVariations()) builtIn += " '" + text + "'";
        auto* vary = app.add_option("--vary", variations,
                                    "Also run a method with other options, at one sampling. Repeatable "
                                    "(default:" +
                                        builtIn + ")")
                         ->option_text("'METHOD --option V,V,...'")
                         ->take_all()
                         ->expected(1)
                         ->group(how);
        app.add_flag("--no-vary", noVariations, "No such variations")->excludes(vary)->group(how);
        app.add_option("--detail-spp", o.detailSpp,
                       "The samples a pixel for variations and for inspected regions (default: the lower "
                       "middle of the ladder)")
            ->check(CLI::Range(1, 1 << 24))
            ->option_text("N")
            ->group(how);
        app.add_option("--inspect", o.inspectedRegions,
                       "Regions whose variogram the report shows; a quarter as many of the largest errors "
                       "are added")
            ->check(CLI::Range(0, 1000))
            ->excludes(frames)
            ->capture_default_str()
            ->group(how);

        const char* const answers = "Answers";
        app.add_flag("--json", json,
                     "Print the records of this sweep, a line each as in results.jsonl, instead of the table")
            ->group(answers);
        app.add_option("--target", targets,
                       "Print the fastest commands of the sweep that reach this error, for example "
                       "relmse=0.01. Repeatable")
            ->option_text("MEASURE=VALUE")
            ->take_all()
            ->expected(1)
            ->group(answers);
        app.add_option("--crop", crops,
                       "A part to show enlarged in the report, in raster coordinates. Repeatable")
            ->option_text("X,Y,W,H")
            ->take_all()
            ->expected(1)
            ->group(answers);
        std::string measures;
        for (const SweepMeasure& m : sweepMeasures()) measures += "  " + m.name + ": " + m.title + "\n";
        app.footer("Measures for --target:\n" + measures +
                   "\nAn interrupted sweep goes on where it was when the same command is run again. Times\n"
                   "are wall times; other work on the machine falsifies them.\n\n"
                   "Exit codes: 0 done; 1 a run failed, or a file cannot be read or written; 2 bad usage;\n"
                   "3 no setting reaches the target.\n\n"
                   "Examples:\n"
                   "  vlx-compare sweep room.glb --reference room_reference.exr -o sweep \\\n"
                   "      --hierarchical 0.1,0.05 --target relmse=0.01\n"
                   "  vlx-compare sweep shot.glb --frames 1-8 --reference reference_####.exr -o sweep\n"
                   "  vlx-compare sweep dump.exr -o sweep --reference reference.exr \\\n"
                   "      --external other='denoise {input} {output}'");
    }

    void chooseMethods() {
        const std::vector<SweepMethod>& known = builtInMethods();
        if (methods.empty())
            std::copy_if(known.begin(), known.end(), std::back_inserter(options.methods),
                         [&](const SweepMethod& m) { return !m.ofSequences || !options.frames.empty(); });
        if (methods == std::vector<std::string>{"none"}) methods.clear();
        for (const std::string& name : methods) {
            const auto found = std::find_if(known.begin(), known.end(),
                                            [&](const SweepMethod& m) { return m.name == name; });
            if (found == known.end())
                throw CLI::ValidationError("--methods", "no method is called '" + name + "'; see --help");
            if (found->ofSequences && options.frames.empty())
                throw CLI::ValidationError("--methods", "'" + name + "' goes with --frames");
            if (std::any_of(options.methods.begin(), options.methods.end(),
                            [&](const SweepMethod& m) { return m.name == name; }))
                throw CLI::ValidationError("--methods", "'" + name + "' is there twice");
            options.methods.push_back(*found);
        }
        const auto bad = [](const char* option, const auto& parse) {
            try {
                return parse();
            } catch (const Error& error) {
                throw CLI::ValidationError(option, error.what());
            }
        };
        for (const std::string& text : externals) {
            const SweepMethod method = bad("--external", [&] { return parseExternal(text); });
            for (const SweepMethod& other : options.methods)
                if (other.name == method.name)
                    throw CLI::ValidationError("--external", "two methods are called '" + method.name + "'");
            options.methods.push_back(method);
        }
        const bool given = !variations.empty();
        if (noVariations) return;
        for (const std::string& text : given ? variations : builtInVariations()) {
            const std::string method = text.substr(0, text.find(' '));
            const bool there = std::any_of(options.methods.begin(), options.methods.end(),
                                           [&](const SweepMethod& m) { return m.name == method; });
            if (!given && !there) continue;  // a default for a method that is not asked for
            for (const SweepMethod& m : bad("--vary", [&] { return expandVariation(options.methods, text); }))
                options.variations.push_back(m);
        }
    }

    int run() {
        std::vector<SweepTarget> wanted;
        for (const std::string& text : targets) try {
                wanted.push_back(parseTarget(text));
            } catch (const Error& error) {
                throw CLI::ValidationError("--target", error.what());
            }
        SweepPageOptions page;
        for (const std::string& text : crops) try {
                page.crops.push_back(parseCrop(text));
            } catch (const Error& error) {
                throw CLI::ValidationError("--crop", error.what());
            }
        for (std::size_t i = 0; i < wanted.size(); ++i)
            if (options.reference.empty() && !wanted[i].measure.starts_with("predicted_"))
                throw CLI::ValidationError("--target", "'" + wanted[i].measure +
                                                           "' needs a --reference; without one there are "
                                                           "predicted_relmse and predicted_rmse");
        const bool dump = std::filesystem::path(options.input).extension() == ".exr";
        if (dump && (!options.tolerances.empty() || options.width > 0 || options.height > 0 ||
                     !options.traceArguments.empty()))
            throw CLI::ValidationError(
                "--hierarchical, --width, --height and --trace-options go with a scene");
        if (dump && !options.frames.empty()) throw CLI::ValidationError("--frames goes with a scene");
        if (!options.frames.empty()) {
            parseFrames(options.frames);
            if (!options.reference.empty()) requireFramePlace("--reference", options.reference);
            options.inspectedRegions = 0;
        }
        if (!dump && options.traceSeconds > 0) throw CLI::ValidationError("--trace-seconds goes with a dump");
        chooseMethods();
        options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
        const ThreadLimit limit(options.threads);

        const Sweep sweep = runSweep(options, [&](const std::string& text) {
            if (!isQuiet()) std::fprintf(stderr, "%s\n", text.c_str());
        });
        const SweepSummary summary = summarize(sweep);
        page.targets = wanted;
        if (!summary.settings.empty()) writePage(sweep, summary, page);
        if (json)
            for (const SweepRecord& record : sweep.records) std::puts(toJsonLine(record).c_str());
        else if (!isQuiet())
            std::printf("%s%d of %zu results were there already\nReport: %s/report.html\n",
                        toText(summary, sweep).c_str(), sweep.reused, sweep.records.size(),
                        options.folder.c_str());
        return answer(sweep, summary, wanted);
    }

    static int answer(const Sweep& sweep, const SweepSummary& summary,
                      const std::vector<SweepTarget>& wanted) {
        int code = kDone;
        for (const SweepTarget& target : wanted) {
            const auto best = cheapestSetting(summary, target);
            if (!best) {
                std::fprintf(stderr, "vlx-compare: no setting of this sweep reaches %s = %g\n",
                             target.measure.c_str(), target.value);
                code = kPassed;
                continue;
            }
            const SweepSetting& s = summary.settings[*best];
            std::printf("# %s <= %g: %.4g in %.3g s\n%s\n%s\n", target.measure.c_str(), target.value,
                        s.values.at(target.measure).value, s.seconds.value, s.samplingCommand.c_str(),
                        s.command.c_str());
        }
        for (const SweepRecord& record : sweep.records)
            if (!record.failure.empty()) {
                if (isQuiet()) warn(record.command + ": " + record.failure);  // else told as it happened
                code = kFailed;
            }
        return code;
    }

    void writePage(const Sweep& sweep, const SweepSummary& summary, const SweepPageOptions& page) const {
        writeFile(options.folder + "/report.html", toHtml(sweep, summary, page));
    }
};

}  // namespace

int sweepMain(int argc, char** argv) {
    CLI::App app(
        "Measures what accuracy costs in time: a ladder of samples a pixel times methods times seeds, each "
        "run timed and compared; writes a report.",
        "vlx-compare sweep");
    SweepCommand command;
    command.bind(app);
    onEndingSignal(endRunningCommand);
    return runTool(argc, argv, app, [&] { return command.run(); });
}

}  // namespace vlx
