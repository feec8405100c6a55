// The commands of vlx-pack that make dumps of other renderers' files.

#include <iostream>
#include <memory>
#include <set>
#include <vector>

#include "finished.h"
#include "import/bcd.h"
#include "import/moments.h"
#include "import/sbmc.h"
#include "import_options.h"
#include "pack/import_command.h"
#include "pack/pack_commands.h"
#include "progress_bar.h"
#include "tool_main.h"

namespace vlx {

namespace {

struct BuffersCommand : ImportCommand {
    std::vector<std::string> mappings;
    std::string a, b;
    BufferOptions options;

    void bind(CLI::App& app) {
        app.description(
            "Join two half-buffers, each the mean of half of a pixel's samples, into a dump of two samples a "
            "pixel.");
        app.footer(
            "Example, of Tungsten's files:\n"
            "  vlx-pack buffers colorA.exr colorB.exr -o room.exr --variance colorVariance.exr\n"
            "      --albedo albedo.exr --normal normal.exr --depth depth.exr");
        app.add_option("A", a, "Image of the first half")->required();
        app.add_option("B", b, "Image of the second half")->required();
        app.add_option("--variance", options.with.variance,
                       "Image of the variance of the mean of both halves (Tungsten's, RenderMan's mse)");
        bindCompanions(app, options.with);
        bindMap(app, mappings);
        bindOutput(app);
    }

    int run() {
        options.map = parseMappings(mappings);
        options.renderer = renderer;
        options.compression = compression;
        const CompanionImages& with = options.with;
        if (finished({"A", "B", "--variance", "--albedo", "--normal", "--depth"},
                     {a, b, with.variance, with.albedo, with.normal, with.depth}))
            return kDone;
        options.inputs = inputs;
        ImportReport report;
        {
            ProgressBar bar("joining");
            report = importBuffers(a, b, dump, options, bar);
        }
        return print(report, "two half-buffers");
    }
};

// Options of sources that have no samples but moments.
void bindHalves(CLI::App& app, bool& single, std::uint64_t& seed) {
    app.add_flag("--single", single,
                 "One sample a pixel; else two artificial halves whose noise has nothing in common");
    app.add_option("--seed", seed, "Of the halves")->capture_default_str();
}

struct MomentsCommand : ImportCommand {
    std::string image;
    MomentFlags flags;
    bool single = false;
    std::uint64_t seed = 0;
    std::vector<std::string> radiance;

    void bind(CLI::App& app) {
        app.description("Make a dump of an image that has a variance for each pixel.");
        app.footer(
            "Examples:\n"
            "  vlx-pack moments pbrt_gbuffer.exr -o room.exr\n"
            "  vlx-pack moments mitsuba.exr -o room.exr --samples 64\n"
            "  vlx-pack moments color.exr -o room.exr --preset tungsten --variance colorVariance.exr\n"
            "vlx-krige reads such images itself.");
        app.add_option("IMAGE", image, "Flat image")->required();
        flags.bind(app);
        bindHalves(app, single, seed);
        bindRadiance(app, radiance);
        bindOutput(app);
    }

    int run() {
        checkOptionUse(*commandLine, {{{"--seed"}, {"artificial halves, without --single"}}},
                       {single ? "" : "artificial halves, without --single"});
        MomentOptions options = flags.options();
        options.radiance = radiance;
        options.renderer = renderer;
        options.compression = compression;
        options.halves = !single;
        options.seed = seed;
        std::vector<std::string> files = flags.files();
        files.push_back(image);
        if (finished({"IMAGE", "--variance", "--albedo", "--normal", "--depth"}, files)) return kDone;
        options.inputs = inputs;
        ImportReport report;
        {
            ProgressBar bar("reading");
            report = importMoments(image, dump, options, bar);
        }
        return print(report, "means and variances");
    }
};

struct BcdCommand : ImportCommand {
    std::vector<std::string> files;
    bool single = false;
    BcdOptions options;

    void bind(CLI::App& app) {
        app.description(
            "Make a dump of files for the denoiser BCD: its raw samples, or the image, covariances and "
            "histogram.");
        app.footer(
            "Examples:\n"
            "  vlx-pack bcd samples.raw -o room.exr\n"
            "  vlx-pack bcd room.exr room_cov.exr room_hist.exr -o dump.exr\n"
            "  vlx-pack bcd room.exr room_cov.exr -o dump.exr --samples 16");
        app.add_option("FILE", files, "A raw file; or image, covariances and histogram, in this order")
            ->required()
            ->expected(1, 3);
        bindSamples(app, options.samples);
        bindHalves(app, single, options.seed);
        bindOutput(app);
    }

    int run() {
        options.renderer = renderer;
        options.compression = compression;
        options.halves = !single;
        const bool raw = !isOpenExr(files.front());
        if (raw != (files.size() == 1))
            throw CLI::ValidationError("FILE",
                                       raw ? "expected one raw file or images, found several files that "
                                             "start with a raw one"
                                           : "expected an image and its covariances, found one image");
        const char* const halves = "statistics in artificial halves, without --single";
        checkOptionUse(*commandLine,
                       {{{"--samples"}, {"statistics without a histogram"}},
                        {{"--single"}, {"statistics"}},
                        {{"--seed"}, {halves}}},
                       {raw ? "" : "statistics", files.size() == 2 ? "statistics without a histogram" : "",
                        raw || single ? "" : halves});
        if (finished({"FILE"}, files)) return kDone;
        options.inputs = inputs;
        ImportReport report;
        {
            ProgressBar bar("reading");
            report = raw ? importBcdRaw(files[0], dump, options, bar)
                         : importBcdStatistics(files[0], files[1], files.size() > 2 ? files[2] : "", dump,
                                               options, bar);
        }
        return print(report, raw ? "raw samples of BCD" : "statistics of BCD");
    }
};

struct SbmcCommand : ImportCommand {
    std::vector<std::string> tiles;

    void bind(CLI::App& app) {
        app.description("Make a dump of the sample files of SBMC, one tile a file.");
        app.footer(
            "Example:\n"
            "  vlx-pack sbmc room/*.bin -o room.exr");
        app.add_option("TILE", tiles, "All tiles of a picture, or some that fill a rectangle")->required();
        bindOutput(app);
    }

    int run() {
        SbmcOptions options;
        if (!renderer.empty()) options.renderer = renderer;
        options.compression = compression;
        if (finished({"TILE"}, tiles)) return kDone;
        options.inputs = inputs;
        ImportReport report;
        {
            ProgressBar bar("reading");
            report = importSbmc(tiles, dump, options, bar);
        }
        return print(report, std::to_string(tiles.size()) + " tiles of SBMC");
    }
};

template <class Command>
void add(CLI::App& app, const std::string& name, std::vector<PackCommand>& commands) {
    const auto command = std::make_shared<Command>();
    CLI::App* const sub = app.add_subcommand(name);
    command->bind(*sub);
    commands.push_back({sub, [command] { return command->run(); }});
}

}  // namespace

void ImportCommand::bindOutput(CLI::App& app) {
    commandLine = &app;
    app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
    app.add_option("--renderer", renderer, "Name of the renderer, if the files do not tell");
    addCompression(app, compression);
    addOverwrite(app, overwrite);
}

bool ImportCommand::finished(const std::set<std::string>& fileOptions,
                             const std::vector<std::string>& files) {
    checkOutputName(dump, files);
    inputs = fingerprintOf(*commandLine, fileOptions, files).text();
    return !overwrite && isFinished({dump}, inputs);
}

int ImportCommand::print(const ImportReport& report, const std::string& what) const {
    if (isQuiet()) return kDone;
    std::cout << dump << ": " << what << "\n";
    std::cout << toText(report);
    return kDone;
}

void bindRadiance(CLI::App& app, std::vector<std::string>& radiance) {
    app.add_option("--radiance", radiance,
                   "A further channel or layer of radiance to keep under its name, for vlx-krige --radiance; "
                   "repeatable")
        ->type_name("NAME")
        ->expected(1)
        ->take_all();
}

void addCompression(CLI::App& app, DumpCompression& compression) {
    using enum DumpCompression;
    addChoice(app, "--compression", compression, {{"none", None}, {"rle", Rle}, {"zips", Zips}},
              "Of the dump. zips: small; rle: faster to write; none: fastest to read");
}

void addImportCommands(CLI::App& app, std::vector<PackCommand>& commands) {
    addStackCommand(app, commands);
    add<BuffersCommand>(app, "buffers", commands);
    add<MomentsCommand>(app, "moments", commands);
    add<BcdCommand>(app, "bcd", commands);
    add<SbmcCommand>(app, "sbmc", commands);
}

}  // namespace vlx
