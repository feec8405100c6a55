// vlx-pack: tells what a sample dump holds, and makes dumps of other renderers' images.

#include <cstdio>
#include <iostream>

#include "progress_bar.h"
#include "tool_main.h"
#include "variolux/dump/info.h"
#include "variolux/dump/points.h"
#include "variolux/dump/stack.h"
#include "variolux/dump/subset.h"

namespace {

struct InfoCommand {
    std::string file;
    bool json = false;

    void bind(CLI::App& app) {
        app.description(
            "Print what a dump holds: channels, samples a pixel, size, renderer, and what it lacks and what "
            "that\n"
            "costs the reconstruction. Reads the whole file.");
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

struct StackCommand {
    std::vector<std::string> images;
    std::string dump;
    std::vector<std::string> mappings;
    vlx::StackOptions options;

    void bind(CLI::App& app) {
        app.description(
            "Join images of the same view, rendered with different seeds, into a dump of one sample an image "
            "a "
            "pixel.\nRender each image with one sample a pixel, and features (albedo, normal, depth) if the "
            "renderer has them.");
        app.footer(
            "Examples:\n"
            "  vlx-pack stack cycles_*.exr -o room.exr\n"
            "  vlx-pack stack a.exr b.exr -o ab.exr --map R=diffuse.r --map G=diffuse.g --map B=diffuse.b");
        app.add_option("IMAGE", images, "Flat images of equal size")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
        using enum vlx::StackPreset;
        vlx::addChoice(app, "--preset", options.preset,
                       {{"auto", Auto}, {"cycles", Cycles}, {"plain", Plain}},
                       "How channels are named. cycles: Blender's multilayer files with denoising data;\n"
                       "plain: R, G, B and a dump's own names; auto: cycles when there is a Combined pass");
        app.add_option(
               "--map", mappings,
               "Take a dump's channel from an image's, for example R=Combined.R; goes before the preset")
            ->type_name("NAME=SOURCE")
            ->expected(1)
            ->take_all();
        app.add_option("--renderer", options.renderer, "Name of the renderer, if the images do not tell");
        using enum vlx::DumpCompression;
        vlx::addChoice(app, "--compression", options.compression,
                       {{"none", None}, {"rle", Rle}, {"zips", Zips}},
                       "Of the dump. zips: small; rle: faster to write; none: fastest to read");
    }

    int run() {
        for (const auto& mapping : mappings) {
            const std::size_t sign = mapping.find('=');
            if (sign == 0 || sign == std::string::npos || sign + 1 == mapping.size())
                throw CLI::ValidationError("--map", "expected NAME=SOURCE, found '" + mapping + "'");
            options.map[mapping.substr(0, sign)] = mapping.substr(sign + 1);
        }
        vlx::checkOutputName(dump, images);
        vlx::ImportReport report;
        {
            vlx::ProgressBar bar("stacking");
            report = vlx::stackImages(images, dump, options, bar);
        }
        std::cout << dump << ": " << images.size() << " images\n";
        for (const auto& [channel, source] : report.mapped)
            std::cout << "  " << channel << " from " << source << "\n";
        for (const auto& name : report.ignored) std::cout << "  left out: " << name << "\n";
        for (const auto& note : report.notes) std::cout << note << "\n";
        return vlx::kDone;
    }
};

struct SampleCommand {
    std::string image;
    std::string dump;
    vlx::PointOptions options;

    void bind(CLI::App& app) {
        app.description(
            "Sample an image at a few Sobol points, to see what kriging makes of them: the paper's figure "
            "1.");
        app.footer(
            "Example:\n"
            "  vlx-pack sample picture.png -o points.exr --points 64\n"
            "  vlx-krige points.exr -o kriged.exr --whole-image --no-colour-distance");
        app.add_option("IMAGE", image, "A flat image with R, G, B")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
        app.add_option("--points", options.points, "How many")
            ->check(CLI::Range(1, 1 << 20))
            ->capture_default_str();
        app.add_flag("--scramble", options.scramble, "Randomise the points (Owen scrambling)");
        app.add_option("--seed", options.seed, "Of the scrambling")
            ->needs("--scramble")
            ->capture_default_str();
    }

    int run() const {
        vlx::checkOutputName(dump, {image});
        vlx::sampleAtPoints(image, dump, options);
        return vlx::kDone;
    }
};

struct SubsetCommand {
    std::string input;
    std::string dump;
    vlx::SubsetOptions options;

    void bind(CLI::App& app) {
        app.description(
            "Write a dump of fewer samples a pixel, as if the renderer had stopped earlier. Where samples "
            "belong\nto replicates (sample.replicate), whole replicates are kept.");
        app.footer(
            "Example: two independent dumps of 4 samples a pixel\n"
            "  vlx-pack subset room.exr -o room_4a.exr --samples 4\n"
            "  vlx-pack subset room.exr -o room_4b.exr --samples 4 --part 1");
        app.add_option("DUMP", input, "The dump to take samples from")->required();
        app.add_option("-o,--output", dump, "The dump to write (.exr)")->required();
        app.add_option("--samples", options.samples, "Samples a pixel to keep")
            ->check(CLI::Range(1u, 1u << 24))
            ->required();
        app.add_option("--part", options.part,
                       "Which of the sub-sets of this size; those of one seed share no samples")
            ->check(CLI::Range(0u, 1u << 24))
            ->capture_default_str();
        app.add_option("--seed", options.seed, "Another seed, another division into sub-sets")
            ->capture_default_str();
        using enum vlx::DumpCompression;
        vlx::addChoice(app, "--compression", options.compression,
                       {{"none", None}, {"rle", Rle}, {"zips", Zips}}, "Of the dump");
    }

    int run() const {
        vlx::checkOutputName(dump, {input});
        vlx::ProgressBar bar("dividing");
        vlx::subsetDump(input, dump, options, bar);
        return vlx::kDone;
    }
};

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Sample dumps: what they hold, and how to make them of other renderers' images.",
                 "vlx-pack");
    app.require_subcommand(1);
    InfoCommand info;
    StackCommand stack;
    SampleCommand sample;
    SubsetCommand subset;
    CLI::App* infoApp = app.add_subcommand("info");
    CLI::App* stackApp = app.add_subcommand("stack");
    CLI::App* sampleApp = app.add_subcommand("sample");
    CLI::App* subsetApp = app.add_subcommand("subset");
    info.bind(*infoApp);
    stack.bind(*stackApp);
    sample.bind(*sampleApp);
    subset.bind(*subsetApp);
    return vlx::runTool(argc, argv, app, [&] {
        if (infoApp->parsed()) return info.run();
        if (subsetApp->parsed()) return subset.run();
        return stackApp->parsed() ? stack.run() : sample.run();
    });
}
