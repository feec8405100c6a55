#include "sequence/compare_sequence.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "frames.h"
#include "import/import.h"
#include "progress_bar.h"
#include "sequence/motion_image.h"
#include "sequence/sequence_page.h"
#include "sequence/sequence_report.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/report.h"

namespace vlx {

namespace {

void requireFrameNumber(const std::string& option, const std::string& name) {
    if (frameName(name, 0) == name)
        throw CLI::ValidationError(
            option, "expected #### in the file's name for the frame's number, found '" + name + "'");
}

// The numbers of the frames that are there, ascending.
std::vector<int> framesOf(const std::string& pattern) {
    std::vector<int> frames;
    const std::string name = std::filesystem::path(pattern).filename().string();
    for (const std::string& file : expandSequences({pattern})) {
        const std::string found = std::filesystem::path(file).filename().string();
        int number = 0;
        std::from_chars(found.data() + name.find('#'), found.data() + found.size(), number);
        if (frameName(name, number) != found)
            throw Error(file, "expected the number of a frame below 2^31 in place of # in " + pattern);
        frames.push_back(number);
    }
    return frames;
}

// All at once and before any work: one frame that is missing would be found after hours.
void requireFrames(const std::string& pattern, const std::vector<int>& frames) {
    std::string first;
    std::size_t missing = 0;
    for (const int frame : frames) {
        const std::string file = frameName(pattern, frame);
        std::error_code status;
        if (!std::filesystem::exists(file, status) && missing++ == 0) first = file;
    }
    if (missing > 0)
        throw Error(pattern, "expected all of the " + std::to_string(frames.size()) +
                                 " frames that are compared (--frames says which), found " +
                                 std::to_string(missing) + " missing, the first " + first);
}

struct SequenceCommand {
    std::string reference;
    std::vector<std::string> images;
    std::string frameList;
    std::string layer;
    std::string motion;
    std::string page;
    bool json = false;
    int threads = 0;

    void bind(CLI::App& app) {
        app.add_option("REFERENCE", reference, "The frames to measure against: #### stands for their number")
            ->required();
        app.add_option(
               "IMAGE", images,
               "Sequences to measure, named likewise; of dumps their averages count. Windows must equal "
               "the reference's")
            ->required();
        app.add_option("--frames", frameList,
                       "Frames to compare, for example 1-100 or 1-3,7,10-20x5 (default: those of REFERENCE)")
            ->option_text("LIST");
        app.add_option(
               "--layer", layer,
               "Compare the layer of this name (ViewLayer.Combined_key), or Combined of the view layer of "
               "this "
               "name (ViewLayer2), of every file that has it, and of the others what is compared without: R, "
               "G, B, or the layer where renderers keep their picture")
            ->option_text("NAME");
        app.add_option(
               "--motion", motion,
               "Images or dumps of the frames, named likewise, that say where points were in the frame "
               "before: channels motion.x, motion.y, in pixels to the right and down. Flicker is "
               "measured along it, too")
            ->option_text("FILE");
        app.add_option(
               "--report", page,
               "Write a page to look at: numbers, error against frame, and the sequences side by side, "
               "played")
            ->option_text("FILE.html");
        app.add_flag("--json", json, "Print JSON instead of the table, with all metrics of each frame");
        app.add_option("--threads", threads, "Threads to use; 0: all processors. Results do not depend on it")
            ->check(CLI::Range(0, 4096))
            ->option_text("N");
        app.footer(R"(Measures, for frames x and references r with errors e = x - r, over all
pixels, R, G, B and frames:
  relMSE   mean e^2 / (r^2 + 0.01)
  flicker  mean (e_f - e_g)^2 / (r_g^2 + 0.01), g the frame before f: how much
           errors change in the same pixel
  flicker along motion
           the same with e_g and r_g where the point that is seen in the pixel
           was in the frame before (nearest pixel; not where it was outside the
           picture, or where motion is not known): errors that move along with
           things do not flicker

95 % intervals are from the scatter of squares of 16 x 16 pixels, each with all
its frames, about the mean, by Student's t of its logarithm: what other parts of
such a picture, with other noise, would say. They are the same in every run.

Pixels that are not finite are left out. A frame that one of them lacks is an error.

Examples:
  vlx-compare sequence ref_####.exr mean_####.exr kriged_####.exr
  vlx-compare sequence ref_####.exr kriged_####.exr --frames 1-24 \
      --motion samples_####.exr --report flicker.html)");
    }

    int run() const {
        std::vector<std::string> patterns = {reference};
        requireFrameNumber("REFERENCE", reference);
        for (const std::string& image : images) {
            requireFrameNumber("IMAGE", image);
            patterns.push_back(image);
        }
        if (!motion.empty()) requireFrameNumber("--motion", motion);
        const ThreadLimit limit(threads);

        SequenceReport report{reference, motion, {}, {}, {}};
        report.frames = frameList.empty() ? framesOf(reference) : parseFrames(frameList);
        std::sort(report.frames.begin(), report.frames.end());
        for (const std::string& pattern : patterns) requireFrames(pattern, report.frames);
        const std::vector<int> moved = framesAfterOthers(report.frames);
        if (!motion.empty()) {
            if (moved.empty())
                throw CLI::ValidationError("--motion", "expected frames that follow each other, found none");
            requireFrames(motion, moved);
        }
        if (!page.empty()) checkOutputs({{"--report", page}}, filesOf(patterns, report.frames, moved));
        const std::vector<std::string> names = shortNames(images);
        for (std::size_t i = 0; i < images.size(); ++i) report.sequences.push_back({images[i], names[i], {}});

        const std::string html = compare(report);
        if (!page.empty()) writeFile(page, html);
        if (json || !isQuiet()) std::fputs((json ? toJson(report) : toText(report)).c_str(), stdout);
        return kDone;
    }

  private:
    static std::vector<int> framesAfterOthers(const std::vector<int>& frames) {
        std::vector<int> result;
        for (std::size_t i = 1; i < frames.size(); ++i)
            if (frames[i] == frames[i - 1] + 1) result.push_back(frames[i]);
        return result;
    }

    std::vector<std::string> filesOf(const std::vector<std::string>& patterns, const std::vector<int>& frames,
                                     const std::vector<int>& moved) const {
        std::vector<std::string> files;
        for (const std::string& pattern : patterns)
            for (const int frame : frames) files.push_back(frameName(pattern, frame));
        for (const int frame : moved) files.push_back(frameName(motion, frame));
        return files;
    }

    // Fills in the report's window and errors. Returns the page, if there is to be one.
    std::string compare(SequenceReport& report) const {
        ProgressBar bar("comparing");
        const Progress progress = bar;
        std::vector<SequenceComparison> comparisons(images.size());
        std::optional<SequencePage> shown;
        LayerSearch search(layer);
        const auto read = [&](const std::string& path) {
            ColourImage image = readColour(path, layer);
            search.add(image);
            return std::move(image.colour);
        };
        for (std::size_t i = 0; i < report.frames.size(); ++i) {
            const int frame = report.frames[i];
            std::vector<Image> all = {read(frameName(reference, frame))};  // the reference first
            report.window = all.front().data;
            std::optional<Image> moved;
            if (!motion.empty() && i > 0 && frame == report.frames[i - 1] + 1)
                moved = readMotion(frameName(motion, frame), report.window);
            for (std::size_t k = 0; k < images.size(); ++k) {
                const std::string path = frameName(images[k], frame);
                all.push_back(read(path));
                comparisons[k].add(frame, all.front(), all.back(), moved ? &*moved : nullptr, path);
            }
            if (!page.empty()) {
                if (!shown) shown.emplace(report.window, report.frames.size(), all.size());
                shown->add(all);
            }
            if (progress)
                progress(static_cast<std::int64_t>(i) + 1, static_cast<std::int64_t>(report.frames.size()));
        }
        search.check();
        for (std::size_t k = 0; k < images.size(); ++k) report.sequences[k].errors = comparisons[k].errors();
        return shown ? shown->html(report) : "";
    }
};

}  // namespace

int sequenceMain(int argc, char** argv) {
    CLI::App app(
        "Measures the frames of sequences against references: their errors, and how much these flicker; "
        "writes "
        "a page that plays them side by side.",
        "vlx-compare sequence");
    SequenceCommand command;
    command.bind(app);
    return runTool(argc, argv, app, [&] { return command.run(); });
}

}  // namespace vlx
