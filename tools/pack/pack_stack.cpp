// vlx-pack stack: images of one view become a dump.

#include <iostream>
#include <memory>

#include "finished.h"
#include "frames.h"
#include "import/stack.h"
#include "import_options.h"
#include "pack/import_command.h"
#include "pack/pack_commands.h"
#include "progress_bar.h"
#include "tool_main.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

enum class Groups { None, Auto };

struct StackCommand : ImportCommand {
    std::vector<std::string> mappings, radiance;
    std::vector<std::string> images;
    std::string append, passes, frames, layer;
    StackPreset preset = StackPreset::Auto;
    Groups groups = Groups::None;
    bool keepEmpty = false;

    void bind(CLI::App& app) {
        app.description(
            "Join images of the same view, rendered with different seeds, into a dump of one sample an image "
            "a "
            "pixel.\nRender each image with one or a few samples a pixel, and features (albedo, normal, "
            "depth) "
            "if the\nrenderer has them. Cycles: image i (from 0) with the sample offset 1 + i * samples and "
            "the "
            "same seed.");
        app.footer(
            "Frames of a sequence may have motion, in pixels, y downwards: motion.x, motion.y\n"
            "from where a point is to where it was in the frame before, motionNext.x, .y to\n"
            "where it will be in the next. cycles takes all four from the Vector pass.\n\n"
            "Examples:\n"
            "  vlx-pack stack cycles_*.exr -o room.exr\n"
            "  vlx-pack stack 'seed_####.exr' -o room.exr --preset mitsuba\n"
            "  vlx-pack stack 'more_*.exr' -o room_8.exr --append room.exr\n"
            "  vlx-pack stack 'frame_####_seed?.exr' -o samples_####.exr --frames 1-100\n"
            "  vlx-pack stack 'seed_####.exr' -o room.exr --groups auto --passes room_passes.exr\n"
            "  vlx-pack stack a.exr b.exr -o ab.exr --map R=diffuse.r --map G=diffuse.g --map B=diffuse.b\n"
            "  vlx-pack stack 'f7_s####.exr' -o f7.exr --map motion.x=-1*flow.x --map motion.y=-1*flow.y");
        app.add_option(
               "IMAGE", images,
               "Flat images of equal size. #### in a name: all files with a number there (with --frames: "
               "the frame's); * and ?: all files that fit")
            ->required();
        using enum StackPreset;
        addChoice(
            app, "--preset", preset,
            {{"auto", Auto}, {"cycles", Cycles}, {"mitsuba", Mitsuba}, {"pbrt", Pbrt}, {"plain", Plain}},
            "How channels are named. cycles: Blender's multilayer files with denoising data, and vectors;\n"
            "mitsuba: the aov integrator's; pbrt: the gbuffer film's; plain: R, G, B and a dump's own\n"
            "names; auto: what the names look like");
        bindLayer(app, layer);
        bindRadiance(app, radiance);
        addChoice(app, "--groups", groups, {{"none", Groups::None}, {"auto", Groups::Auto}},
                  "Of Blender's files, auto: keep all light groups as radiance, and say whether they add up");
        app.add_option("--passes", passes,
                       "Of Blender's files: keep what adds up to the picture as radiance (Diffuse, Glossy, "
                       "Transmission: (Direct + Indirect) * Colour; Volume, Emit, Env), and write all other "
                       "passes, averaged, cryptomattes merged, into this file, for vlx-krige --template")
            ->option_text("FILE");
        app.add_option("--append", append,
                       "Keep the samples of this earlier dump of the same view, and add those of the images")
            ->option_text("DUMP");
        app.add_option(
               "--frames", frames,
               "Several frames, such as 1-100x2 or 1,3,7-9: #### in all names is the frame's number. One "
               "that fails is told, the others go on; finished ones are skipped")
            ->option_text("LIST");
        app.add_flag("--keep-empty", keepEmpty,
                     "Pixels that were not rendered (a render border) are samples of 0, not pixels without "
                     "samples");
        bindMap(app, mappings);
        bindOutput(app);
    }

    int run() {
        ProgressBar bar("stacking");
        if (frames.empty()) return stack(bar);
        for (const std::string& image : images) requireFramePlace("IMAGE", image);
        requireFramePlace("--output", dump);
        if (!append.empty()) requireFramePlace("--append", append);
        if (!passes.empty()) requireFramePlace("--passes", passes);
        forEachFrame(parseFrames(frames), bar, [this](int frame, const Progress& progress) {
            StackCommand one = *this;
            for (std::string& image : one.images) image = frameName(image, frame);
            for (std::string* name : {&one.dump, &one.append, &one.passes}) *name = frameName(*name, frame);
            one.stack(progress);
        });
        return kDone;
    }

  private:
    int stack(const Progress& progress) {
        images = expandSequences(images);
        std::vector<std::string> files = images;
        if (!append.empty()) files.push_back(append);
        checkOutputName(dump, files);
        checkOutputs({{"--output", dump}, {"--passes", passes}}, files);
        Fingerprint made = fingerprintOf(*commandLine, {"IMAGE", "--append"}, files);
        made.add("append", append.empty() ? "none" : "given");
        made.add("passes", passes.empty() ? "none" : "given");
        inputs = made.text();
        std::vector<std::string> outputs = {dump};
        if (!passes.empty()) outputs.push_back(passes);
        if (!overwrite && isFinished(outputs, inputs)) return kDone;
        StackOptions options{preset, parseMappings(mappings), radiance};
        options.groups = groups == Groups::Auto;
        options.passes = passes;
        options.append = append;
        options.layer = layer;
        options.keepEmpty = keepEmpty;
        options.renderer = renderer;
        options.compression = compression;
        options.inputs = inputs;
        const ImportReport report = stackImages(images, dump, options, progress);
        const std::string stacked =
            std::to_string(images.size()) + (images.size() == 1 ? " image" : " images");
        return print(report, stacked + (append.empty() ? "" : " added to " + append));
    }
};

}  // namespace

void addStackCommand(CLI::App& app, std::vector<PackCommand>& commands) {
    const auto command = std::make_shared<StackCommand>();
    CLI::App* const sub = app.add_subcommand("stack");
    command->bind(*sub);
    commands.push_back({sub, [command] { return command->run(); }});
}

}  // namespace vlx
