#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "finished.h"
#include "sequence/compare_sequence.h"
#include "sweep/compare_sweep.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/metrics.h"
#include "variolux/compare/picture.h"
#include "variolux/compare/report.h"

namespace {

using namespace vlx;

struct Options {
    std::string reference;
    std::vector<std::string> images;
    std::string layer;
    bool json = false;
    std::vector<std::string> failAbove;
    std::vector<std::string> failBelow;
    bool stddev = false;
    bool referenceStddev = false;
    std::string pictures;
    std::vector<std::string> crops;
    double exposure = 0;
    int threads = 0;
    bool overwrite = false;
    const CLI::App* commandLine = nullptr;
};

void bind(CLI::App& app, Options& options) {
    options.commandLine = &app;
    app.add_option("REFERENCE", options.reference, "The image to measure against")->required();
    app.add_option("IMAGE", options.images, "Images to measure; data windows must equal the reference's")
        ->required();
    app.add_option(
           "--layer", options.layer,
           "Compare the layer of this name (ViewLayer.Combined_key), or Combined of the view layer of this "
           "name (ViewLayer2), of every file that has it, and of the others what is compared without: R, "
           "G, B, or the layer where renderers keep their picture")
        ->option_text("NAME");

    const char* const output = "Output";
    app.add_flag("--json", options.json, "Print JSON instead of the table")->group(output);
    app.add_option("--pictures", options.pictures,
                   "Write PNG pictures into this folder, made if need be: side_by_side, signed_error, "
                   "relative_error and, with --crop, crops")
        ->option_text("FOLDER")
        ->group(output);
    app.add_option("--crop", options.crops,
                   "A part to outline and to show enlarged, in raster coordinates; repeatable")
        ->option_text("X,Y,W,H")
        ->take_all()
        ->expected(1)
        ->needs("--pictures")
        ->group(output);
    app.add_option("--exposure", options.exposure,
                   "Stops by which pictures are brightened (-32 to 32); metrics are not affected")
        ->check(finiteWithin(-32, 32))
        ->option_text("EV")
        ->needs("--pictures")
        ->group(output);
    addOverwrite(app, options.overwrite);
    app.get_option("--overwrite")
        ->description(
            "Write the pictures even if they are there and were made by this very program from the same "
            "images "
            "with the same parameters, which is else left out")
        ->needs("--pictures")
        ->group(output);

    const char* const checks = "Checks";
    app.add_option("--fail-above", options.failAbove,
                   "Exit with code 3 if an image's metric is above the value, or not a number; repeatable")
        ->option_text("METRIC=VALUE")
        ->take_all()
        ->expected(1)
        ->group(checks);
    app.add_option("--fail-below", options.failBelow,
                   "The same for metrics that are better when higher: psnr, ssim; repeatable")
        ->option_text("METRIC=VALUE")
        ->take_all()
        ->expected(1)
        ->group(checks);
    app.add_flag("--stddev", options.stddev,
                 "Check the error maps: the share of values of an image within 1 and 2 of its own standard "
                 "deviations (layer stddev, as vlx-krige writes it) of the reference")
        ->group(checks);
    app.add_flag("--reference-stddev", options.referenceStddev,
                 "Add the variance of the reference's own stddev layer to the image's")
        ->needs("--stddev")
        ->group(checks);
    app.add_option("--threads", options.threads,
                   "Threads to use; 0: all processors. Results do not depend on it")
        ->check(CLI::Range(0, 4096))
        ->option_text("N");
    app.footer(
        R"(Metrics, for image x and reference r, over all pixels and R, G, B:
  mse             mean (x - r)^2
  rmse            its root
  relmse          mean (x - r)^2 / (r^2 + 0.01)
  relmse_trimmed  the same without the worst 0.1 % of pixels (rounded up)
  mape            mean |x - r| / (|r| + 0.01)
  rmse_tm         root of the mean (t(x) - t(r))^2, where t tone-maps:
                  max(x, 0)^(1/2.2), at most 1
  psnr            -20 log10(rmse_tm), in dB
  ssim            structural similarity of t(x) and t(r) (Wang et al. 2004:
                  Gaussian window 11 x 11, sigma 1.5), mean over R, G, B
  bias            (mean x - mean r) / mean |r|; limits judge its magnitude
  gross           share of pixels wrong by a factor of two: by the mean of
                  R, G, B, x < r / 2 where r > 0.03, or x > 2 r + 0.03
  nonfinite       pixels of x with a NaN or infinite channel
  negative        pixels of x with a channel below zero

Pixels that are not finite in x or r are left out of all but the counts, and
reported. Values are compared as stored: PNG and JPEG hold display values, not
radiance. Of a sample dump, its flat beauty part is read. In a file of layers
the picture is Combined of Blender's first view layer (its compositor's picture
only where that is all there is), else R, G, B, else RGBA, rgba, beauty or Ci;
its stddev is that of the same view layer. --layer chooses another.

Exit codes: 0 done; 1 a file cannot be read, compared or written; 2 bad usage;
3 a limit was passed.

vlx-compare sequence compares sequences frame by frame and measures how much
they flicker: see vlx-compare sequence --help.
vlx-compare sweep measures what accuracy costs in time and writes a report: see
vlx-compare sweep --help.

Examples:
  vlx-compare reference.exr mean.exr kriged.exr
  vlx-compare reference.exr kriged.exr --fail-above relmse=0.002 \
      --fail-above nonfinite=0
  vlx-compare reference.exr mean.exr kriged.exr --pictures out \
      --crop 40,60,32,32 --exposure 1)");
}

/// What a library parser throws becomes bad usage of the option.
template <typename Parse>
auto parsed(const char* option, const Parse& parse) {
    try {
        return parse();
    } catch (const Error& error) {
        throw CLI::ValidationError(option, error.what());
    }
}

struct Input : ColourImage {
    std::string path;
};

Input readInput(const std::string& path, const Options& options, bool wantStddev) {
    return {readColour(path, options.layer, wantStddev), path};
}

std::vector<std::string> pictureFiles(const Options& options) {
    std::vector<std::string> files;
    for (const char* name : {"side_by_side", "signed_error", "relative_error", "crops"})
        if (std::string_view(name) != "crops" || !options.crops.empty())
            files.push_back((std::filesystem::path(options.pictures) / name).string() + ".png");
    return files;
}

/// Of all that the pictures are made of: images, and how they are called.
Fingerprint pictureInputs(const Options& options, const std::vector<std::string>& names) {
    Fingerprint made = fingerprintOf(*options.commandLine, {"REFERENCE", "IMAGE"});
    made.addFile(options.reference);
    for (std::size_t i = 0; i < names.size(); ++i) made.add("name", names[i]).addFile(options.images[i]);
    return made;
}

void writePictures(const Options& options, const PictureOptions& picture, const Input& reference,
                   const std::vector<Input>& inputs, const Report& report, const Fingerprint& made) {
    std::vector<CaptionedImage> images;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        std::array<char, 48> note{};
        std::snprintf(note.data(), note.size(), "relMSE %.3g", report.images[i].comparison[Metric::RelMse]);
        images.push_back({report.images[i].name, note.data(), inputs[i].colour});
    }
    std::vector<CaptionedImage> all = images;
    all.insert(all.begin(), CaptionedImage{"reference", "", reference.colour});

    // All are drawn before the first is written: what fails here leaves nothing behind.
    std::vector<Image> pictures = {sideBySide(all, picture), signedErrors(reference.colour, images, picture),
                                   relativeErrors(reference.colour, images)};
    if (!picture.crops.empty()) pictures.push_back(enlargedCrops(all, picture));

    made.checkUnchanged();
    std::error_code status;
    std::filesystem::create_directories(options.pictures, status);
    if (status) throw Error(options.pictures, "expected to make this folder: " + status.message());
    const std::vector<std::string> files = pictureFiles(options);
    ImageWriteOptions write;
    write.attributes[kInputsAttribute] = made.text();
    for (std::size_t i = 0; i < files.size(); ++i) writeImage(files[i], pictures[i], write);
}

int run(const Options& options) {
    std::vector<Limit> limits;
    for (const std::string& text : options.failAbove)
        limits.push_back(parsed("--fail-above", [&] { return parseLimit(text, false); }));
    for (const std::string& text : options.failBelow)
        limits.push_back(parsed("--fail-below", [&] { return parseLimit(text, true); }));
    PictureOptions picture;
    picture.exposure = options.exposure;
    for (const std::string& text : options.crops)
        picture.crops.push_back(parsed("--crop", [&] { return parseCrop(text); }));
    if (!options.pictures.empty()) {
        std::vector<NamedFile> pictures;
        for (const std::string& file : pictureFiles(options)) pictures.push_back({"--pictures", file});
        std::vector<std::string> inputs = options.images;
        inputs.push_back(options.reference);
        checkOutputs(pictures, inputs);
    }
    const ThreadLimit threads(options.threads);

    const std::vector<std::string> names = shortNames(options.images);
    std::optional<Fingerprint> made;  // of the pictures that are to be made
    if (!options.pictures.empty()) {
        made = pictureInputs(options, names);
        if (!options.overwrite && isFinished(pictureFiles(options), made->text())) made.reset();
    }

    const Input reference = readInput(options.reference, options, options.referenceStddev);
    if (options.referenceStddev && !reference.stddev)
        throw Error(options.reference, "expected channels stddev.R, stddev.G, stddev.B, found none");
    LayerSearch layer(options.layer);
    layer.add(reference);
    bool stddevFound = false;
    Report report{options.reference, reference.channels, reference.colour.data, {}, {}};
    std::vector<Input> inputs;
    for (std::size_t i = 0; i < options.images.size(); ++i) {
        Input input = readInput(options.images[i], options, options.stddev);
        ReportEntry entry{input.path,
                          names[i],
                          input.channels,
                          compareColour(reference.colour, input.colour, input.path),
                          {}};
        if (input.stddev)
            entry.calibration =
                checkCalibration(reference.colour, input.colour, *input.stddev, reference.stddev, input.path);
        report.images.push_back(std::move(entry));
        layer.add(input);
        stddevFound = stddevFound || input.stddev;
        if (made) inputs.push_back(std::move(input));
    }
    layer.check();
    if (options.stddev && !stddevFound)
        throw Error("--stddev", "expected an image with channels stddev.R, stddev.G, stddev.B, found none");
    report.violations = checkLimits(report, limits);

    if (made) writePictures(options, picture, reference, inputs, report, *made);
    if (options.json || !isQuiet())
        std::fputs((options.json ? toJson(report) : toText(report)).c_str(), stdout);
    if (report.violations.empty()) return kDone;
    for (const Violation& violation : report.violations)
        std::fprintf(stderr, "vlx-compare: limit passed: %s\n", describe(violation).c_str());
    return kPassed;
}

}  // namespace

int main(int argc, char** argv) {
    const std::string command = argc > 1 ? argv[1] : "";
    if (command == "sequence") return vlx::sequenceMain(argc - 1, argv + 1);
    if (command == "sweep") return vlx::sweepMain(argc - 1, argv + 1);
    CLI::App app("Measures images against a reference: error metrics, error maps, pictures side by side.",
                 "vlx-compare");
    Options options;
    bind(app, options);
    return runTool(argc, argv, app, [&] { return run(options); });
}
