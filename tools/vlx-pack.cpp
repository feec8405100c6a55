// vlx-pack: tells what a sample dump holds, and makes dumps of other renderers' images.

#include <algorithm>
#include <iostream>

#include "edit/halves.h"
#include "edit/info.h"
#include "edit/merge.h"
#include "edit/subset.h"
#include "finished.h"
#include "import/import.h"
#include "import/points.h"
#include "pack/pack_commands.h"
#include "progress_bar.h"
#include "tool_main.h"

namespace {

struct InfoCommand {
    std::string file;
    bool json = false;

    void bind(CLI::App& app) {
        app.description(
            "Print what a dump holds: channels, samples a pixel, size, renderer, motion, and what it lacks "
            "and "
            "what\n"
            "that costs the reconstruction. Reads the whole file.");
        app.add_option("FILE", file, "The dump: a deep scanline OpenEXR file, of any renderer")->required();
        app.add_flag("--json", json, "Print JSON instead of text");
    }

    int run() const {
        vlx::DumpInfo info;
        {
            vlx::ProgressBar bar("reading");
            info = vlx::inspectDump(file, bar);
        }
        std::cout << (json ? vlx::toJson(info) : vlx::toText(info));
        return vlx::kDone;
    }
};

struct SampleCommand {
    std::string image;
    std::string dump;
    bool overwrite = false;
    vlx::PointOptions options;
    const CLI::App* commandLine = nullptr;

    void bind(CLI::App& app) {
        commandLine = &app;
        app.description(
            "Sample an image at a few Sobol points, to see what kriging makes of them: the paper's figure "
            "1.");
        app.footer(
            "Example:\n"
            "  vlx-pack sample picture.png -o points.exr --points 64\n"
            "  vlx-krige points.exr -o kriged.exr --method paper --whole-image --no-colour-distance");
        app.add_option("IMAGE", image, "A flat image with R, G, B")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
        app.add_option("--points", options.points, "How many")
            ->check(CLI::Range(1, 1 << 20))
            ->capture_default_str();
        app.add_flag("--scramble", options.scramble, "Randomise the points (Owen scrambling)");
        app.add_option("--seed", options.seed, "Of the scrambling")
            ->needs("--scramble")
            ->capture_default_str();
        vlx::addOverwrite(app, overwrite);
    }

    int run() {
        vlx::checkOutputName(dump, {image});
        options.inputs = vlx::fingerprintOf(*commandLine, {}, {image}).text();
        if (!overwrite && vlx::isFinished({dump}, options.inputs)) return vlx::kDone;
        vlx::sampleAtPoints(image, dump, options);
        return vlx::kDone;
    }
};

struct SubsetCommand {
    std::string input;
    std::string dump;
    std::string half;
    bool overwrite = false;
    vlx::SubsetOptions options;
    const CLI::App* commandLine = nullptr;

    void bind(CLI::App& app) {
        commandLine = &app;
        app.description(
            "Write a dump of fewer samples a pixel, as if the renderer had stopped earlier. Where samples "
            "belong\nto replicates (sample.replicate), whole replicates are kept.");
        app.footer(
            "Example: two independent dumps of 4 samples a pixel\n"
            "  vlx-pack subset room.exr -o room_4a.exr --samples 4\n"
            "  vlx-pack subset room.exr -o room_4b.exr --samples 4 --part 1");
        app.add_option("DUMP", input, "The dump to take samples from")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
        auto* samples = app.add_option("--samples", options.samples, "Samples a pixel to keep")
                            ->check(CLI::Range(1u, 1u << 24));
        app.add_option("--part", options.part,
                       "Which of the sub-sets of this size; those of one seed share no samples")
            ->check(CLI::Range(0u, 1u << 24))
            ->needs(samples)
            ->capture_default_str();
        app.add_option("--seed", options.seed, "Another seed, another division into sub-sets")
            ->needs(samples)
            ->capture_default_str();
        app.add_option(
               "--half", half,
               "Keep the samples of even or odd number instead (of even or odd replicates), as vlx-pack "
               "halves: for a denoiser that reads dumps, whose images vlx-krige is to judge")
            ->check(CLI::IsMember({"even", "odd"}))
            ->option_text("even|odd")
            ->excludes(samples);
        vlx::addCompression(app, options.compression);
        vlx::addOverwrite(app, overwrite);
    }

    int run() {
        vlx::checkOutputName(dump, {input});
        if (commandLine->count("--samples") + commandLine->count("--half") == 0)
            throw CLI::RequiredError("--samples or --half");
        options.inputs = vlx::fingerprintOf(*commandLine, {"DUMP"}, {input}).text();
        if (!overwrite && vlx::isFinished({dump}, options.inputs)) return vlx::kDone;
        vlx::ProgressBar bar("dividing");
        if (half.empty())
            vlx::subsetDump(input, dump, options, bar);
        else
            vlx::writeHalfDump(input, dump, half == "odd", options.compression, options.inputs, bar);
        return vlx::kDone;
    }
};

struct HalvesCommand {
    std::string input;
    std::string prefix;

    void bind(CLI::App& app) {
        app.description(
            "Write what other denoisers start from as PFM: the mean of all samples of each pixel, of those "
            "of even\n"
            "number and of those of odd number (of even and odd replicates, where there are two or more), "
            "with albedo\n"
            "and normal where the dump has them: PREFIX_color.pfm, PREFIX_albedo.pfm, PREFIX_normal.pfm,\n"
            "PREFIX_even_color.pfm, PREFIX_odd_color.pfm and so on. A denoiser's images of the two halves "
            "can be judged\n"
            "by what the other half shows.");
        app.footer(
            "Example:\n"
            "  vlx-pack halves room.exr -o room\n"
            "  for part in _ _even_ _odd_; do\n"
            "      oidnDenoise --hdr room${part}color.pfm -o room${part}denoised.pfm; done\n"
            "  vlx-krige room.exr -o best.exr --denoised room_denoised.pfm \\\n"
            "      --denoised-halves room_even_denoised.pfm,room_odd_denoised.pfm");
        app.add_option("DUMP", input, "The dump: a deep scanline OpenEXR file, of any renderer")->required();
        app.add_option("-o,--output", prefix, "What the names of the pictures begin with")
            ->required()
            ->option_text("PREFIX");
    }

    int run() const {
        vlx::HalvesReport report;
        {
            vlx::ProgressBar bar("averaging");
            report = vlx::writeHalves(input, prefix, bar);
        }
        if (report.droppedSamples > 0)
            vlx::say(std::to_string(report.droppedSamples) + " samples are not finite: left out");
        if (report.emptyPixels > 0)
            vlx::say(std::to_string(report.emptyPixels) + " pixels have no samples: they are 0");
        if (report.missingInHalves > 0)
            vlx::say(std::to_string(report.missingInHalves) +
                     " pixels have samples of one half only: both halves show these");
        return vlx::kDone;
    }
};

struct MergeCommand {
    std::vector<std::string> parts;
    std::string output;
    bool overwrite = false;
    vlx::MergeOptions options;
    const CLI::App* commandLine = nullptr;

    void bind(CLI::App& app) {
        commandLine = &app;
        app.description(
            "Join the parts of one picture, bands of rows or tiles, into one dump, or into one image when "
            "the "
            "parts\nare flat images. Values, types and attributes stay as they are.");
        app.footer(
            "Example:\n"
            "  vlx-pack merge band_*.exr -o room.exr");
        app.add_option("PART", parts,
                       "All parts, in any order; #### in a name: all files with a number there")
            ->required();
        app.add_option("-o,--output", output, "The dump or image to write (.exr)")->required();
        app.add_flag("--crop", options.crop, "The parts need only fill a rectangle of the picture");
        vlx::addOverwrite(app, overwrite);
    }

    int run() {
        parts = vlx::expandSequences(parts);
        vlx::checkOutputName(output, parts);
        options.inputs = inputs();
        if (!overwrite && vlx::isFinished({output}, options.inputs)) return vlx::kDone;
        vlx::ProgressBar bar("merging");
        vlx::mergeParts(parts, output, options, bar);
        return vlx::kDone;
    }

  private:
    /// What variolux:inputs is to say: of all bands of a run what the run of the whole says.
    std::string inputs() const {
        const std::string whole = options.crop ? std::string() : vlx::wholeInputs(parts);
        if (!whole.empty()) return whole;
        return vlx::fingerprintOf(*commandLine, {"PART"}, parts).text();
    }
};

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Sample dumps: what they hold, and how to make them of other renderers' images.",
                 "vlx-pack");
    app.require_subcommand(1);
    std::vector<vlx::PackCommand> commands;
    InfoCommand info;
    SampleCommand sample;
    SubsetCommand subset;
    HalvesCommand halves;
    MergeCommand merge;
    commands.push_back({app.add_subcommand("info"), [&] { return info.run(); }});
    info.bind(*commands.back().app);
    vlx::addImportCommands(app, commands);
    commands.push_back({app.add_subcommand("sample"), [&] { return sample.run(); }});
    sample.bind(*commands.back().app);
    commands.push_back({app.add_subcommand("subset"), [&] { return subset.run(); }});
    subset.bind(*commands.back().app);
    commands.push_back({app.add_subcommand("halves"), [&] { return halves.run(); }});
    halves.bind(*commands.back().app);
    commands.push_back({app.add_subcommand("merge"), [&] { return merge.run(); }});
    merge.bind(*commands.back().app);
    return vlx::runTool(argc, argv, app, [&] {
        const auto asked =
            std::find_if(commands.begin(), commands.end(),
                         [](const vlx::PackCommand& command) { return command.app->parsed(); });
        return asked->run();  // one is required
    });
}
