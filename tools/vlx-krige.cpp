#include <malloc.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>

#include "finished.h"
#include "frames.h"
#include "progress_bar.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/gaussian.h"
#include "variolux/reconstruct/drift_kriging.h"
#include "variolux/reconstruct/mean.h"
#include "variolux/reconstruct/paper.h"
#include "variolux/reconstruct/pixel_filter.h"
#include "variolux/reconstruct/sampling_map.h"

namespace {

enum class Method { Krige, Paper, Mean, Gaussian };

struct Options {
    std::string dump;
    std::string image;
    Method method = Method::Krige;
    vlx::DriftKrigingOptions krige;
    vlx::PixelFilter filter = vlx::PixelFilter::Box;
    std::string band;
    std::string samplingMap;
    bool noFeatures = false;
    double sigma = 1;
    vlx::PaperOptions paper;
    bool noColourDistance = false;
    bool wholeImage = false;
    bool diagnostics = false;
    std::vector<std::string> inspect;
    bool json = false;
    int threads = 0;
    std::string maxMemory;
    std::string frames;
    bool overwrite = false;
    const CLI::App* commandLine = nullptr;
};

void bind(CLI::App& app, Options& o) {
    o.commandLine = &app;
    app.add_option("DUMP", o.dump, "Sample dump (deep OpenEXR) of any renderer")->required();
    app.add_option("-o,--output", o.image,
                   "OpenEXR image to write: R, G, B, A when the dump has it, and layer stddev (the standard "
                   "deviation of the error of R, G, B)")
        ->required();
    vlx::addChoice(
        app, "--method", o.method,
        {{"krige", Method::Krige},
         {"paper", Method::Paper},
         {"mean", Method::Mean},
         {"gaussian", Method::Gaussian}},
        "krige: kriging with the features as external drift, in overlapping neighbourhoods; paper: "
        "kriging by region (Yue and Nishita); mean: plain average of each pixel's samples; "
        "gaussian: the average, Gaussian filtered (no layer stddev)");
    vlx::addChoice(
        app, "--quality", o.krige.quality,
        {{"draft", vlx::Quality::Draft}, {"standard", vlx::Quality::Standard}, {"high", vlx::Quality::High}},
        "krige: draft: one model, sparse neighbourhoods; standard: three models; high: neighbourhoods "
        "twice as dense along each axis");
    vlx::addChoice(
        app, "--fireflies", o.krige.fireflies,
        {{"keep", vlx::Fireflies::Keep},
         {"robust", vlx::Fireflies::Robust},
         {"clamp", vlx::Fireflies::Clamp}},
        "krige: samples far brighter than all around. keep: unbiased and noisy; robust: the brightest "
        "sample of 5 x 5 pixels counts as bright as the second; clamp: luminance is cut at --clamp. "
        "What was removed is reported");
    app.add_option("--clamp", o.krige.clamp, "krige: greatest luminance of a sample with --fireflies clamp")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--strength", o.krige.strength, "krige: 0 keeps the plain average, 1 takes the estimate")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
    app.add_option(
        "--feature", o.krige.features,
        "krige: a further channel of the dump to use as drift, besides albedo, N and Z; repeatable");
    app.add_option(
        "--radiance", o.krige.radiance,
        "krige: a further channel to estimate with the same weights as R, G, B (a light group): parts "
        "still add up; repeatable");
    app.add_option("--scale", o.krige.scale,
                   "krige: pixels of the image along each axis for one of the dump; needs sample positions")
        ->check(CLI::Range(1, 4))
        ->capture_default_str();
    vlx::addChoice(
        app, "--filter", o.filter,
        {{"box", vlx::PixelFilter::Box},
         {"gaussian", vlx::PixelFilter::Gaussian},
         {"blackman-harris", vlx::PixelFilter::BlackmanHarris}},
        "krige: pixel filter of the result. box: averages over pixels; gaussian: standard deviation "
        "0.5, radius 1.5; blackman-harris: radius 1.5 pixels");
    app.add_option(
           "--band", o.band,
           "krige: only band I of N, cut by rows from the top: the same pixels, bit for bit, that the "
           "whole image has there, with its display window")
        ->option_text("I/N");
    app.add_option("--sampling-map", o.samplingMap,
                   "Also write where more samples would lower the error most: an EXR image with channel "
                   "sampling.density, for vlx-trace --append --sample-map (not with --method gaussian)")
        ->option_text("IMAGE");
    app.add_flag("--no-features", o.noFeatures, "krige: use neither albedo nor N nor Z");
    app.add_option("--sigma", o.sigma, "gaussian: standard deviation in pixels")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    auto* region = app.add_option("--region", o.paper.regionSize, "paper: side of a region in pixels")
                       ->check(CLI::Range(1, 64))
                       ->capture_default_str();
    app.add_flag("--whole-image", o.wholeImage,
                 "paper: the whole image is one region (for a few samples scattered over an image)")
        ->excludes(region);
    app.add_flag("--no-colour-distance", o.noColourDistance,
                 "paper: distance on the image plane only, to show what the colour distance does");
    app.add_flag(
        "--diagnostics", o.diagnostics,
        "paper: also write layers diagnostics.* (nugget, sill, range, exponent, errorVariance, outcome) "
        "and OUTPUT.json with everything about each region");
    app.add_option(
           "--inspect", o.inspect,
           "With --diagnostics: put the variogram cloud, its classes and cross-validation of the region "
           "of this pixel into OUTPUT.json; repeatable")
        ->option_text("X,Y")
        ->take_all()
        ->expected(1);
    app.add_flag("--json", o.json, "Print the report as JSON on standard output");
    app.add_option(
           "--frames", o.frames,
           "Krige these frames, for example 1-100x2,150: #### in the names of files stands for the frame's "
           "number. When a frame fails the others go on")
        ->option_text("LIST");
    vlx::addOverwrite(app, o.overwrite);
    app.add_option(
           "--max-memory", o.maxMemory,
           "krige: memory of the process at most, for example 2G or 500M (10^9, 10^6 bytes): fewer rows "
           "are read at a time. The result does not depend on it")
        ->option_text("SIZE");
    app.add_option("--threads", o.threads, "0: all processors. The result does not depend on it")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    app.footer(
        "Examples:\n"
        "  vlx-krige samples.exr -o image.exr\n"
        "  vlx-krige samples.exr -o blurred.exr --method gaussian --sigma 1.5\n"
        "  vlx-krige room_####.exr -o kriged_####.exr --frames 1-100\n"
        "Samples that are not finite are left out and counted. Regions that cannot be kriged\n"
        "get their mean and are counted.");
}

/// By the methods that hold the image whole.
vlx::Reconstruction reconstruct(const Options& o, const vlx::DumpReader& dump,
                                const vlx::Progress& progress) {
    switch (o.method) {
        case Method::Krige: {
            vlx::Reconstruction result = vlx::reconstructDriftKriging(dump, o.krige, progress);
            result.image = vlx::applyPixelFilter(result.image, o.filter);
            return result;
        }
        case Method::Paper:
            return vlx::reconstructPaper(dump, o.paper, progress);
        case Method::Mean:
            return vlx::reconstructMean(dump, progress);
        case Method::Gaussian:
            break;
    }
    vlx::Reconstruction result = vlx::reconstructMean(dump, progress);
    // The error of a filtered pixel is mostly bias, which this filter cannot know: no stddev layer.
    vlx::Image radiance(result.image.data, {"R", "G", "B"});
    radiance.display = result.image.display;
    for (int row = 0; row < radiance.data.height; ++row)
        for (int col = 0; col < radiance.data.width; ++col)
            std::copy_n(result.image.at(col, row), 3, radiance.at(col, row));
    result.image = vlx::gaussianFilter(radiance, o.sigma).image;
    return result;
}

void writeText(const vlx::OutputFile& file, const std::string& text) {
    std::ofstream stream(file.temporaryPath(), std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw vlx::Error(file.path(), "writing failed");
}

std::pair<int, int> parsePixel(const std::string& text) {
    int x = 0, y = 0, end = 0;
    if (std::sscanf(text.c_str(), "%d,%d%n", &x, &y, &end) != 2 ||
        static_cast<std::size_t>(end) != text.size())
        throw CLI::ValidationError("--inspect", "expected X,Y in pixels, found '" + text + "'");
    return {x, y};
}

/// "2G", "500M".
std::uint64_t parseMemory(const std::string& text) {
    double value = 0;
    char unit = 0;
    int end = 0;
    if (std::sscanf(text.c_str(), "%lf%c%n", &value, &unit, &end) != 2 ||
        static_cast<std::size_t>(end) != text.size() || (unit != 'G' && unit != 'M') || !(value > 0) ||
        value > 1e9)
        throw CLI::ValidationError("--max-memory",
                                   "expected a size such as 2G or 500M, found '" + text + "'");
    return static_cast<std::uint64_t>(value * (unit == 'G' ? 1e9 : 1e6));
}

void kriged(const Options& o, const vlx::Progress& progress) {
    if (!o.samplingMap.empty()) {
        vlx::checkOutputName(o.samplingMap, {o.dump, o.image});
        if (o.samplingMap == o.image)
            throw CLI::ValidationError("--sampling-map", "expected another name than the output's");
    }
    vlx::checkOutputName(o.image, {o.dump});
    vlx::ImageWriteOptions write;
    write.attributes["Software"] = "vlx-krige";
    vlx::InputsHash hash(*o.commandLine, {"DUMP"});
    hash.addFile(o.dump);
    const std::string inputs = write.attributes[vlx::kInputsAttribute] = hash.text(o.krige.band);
    std::vector<std::string> outputs = {o.image};
    if (!o.samplingMap.empty()) outputs.push_back(o.samplingMap);
    if (o.diagnostics) outputs.push_back(o.image + ".json");
    if (!o.overwrite && vlx::isFinished(outputs, inputs)) {
        if (o.json) std::printf("{\"skipped\": true}\n");
        return;
    }
    { const vlx::OutputFile writable(o.image); }  // found out now, not after the work
    const vlx::DumpReader dump(o.dump);
    vlx::ReconstructionReport report;
    if (o.method == Method::Krige && o.filter == vlx::PixelFilter::Box && o.samplingMap.empty()) {
        const vlx::Image outline = vlx::driftKrigingOutline(dump, o.krige);
        vlx::ImageWriter writer(o.image, outline.data, outline.display, outline.channels, write);
        report = vlx::reconstructDriftKriging(
            dump, o.krige, [&](const float* rows, int count) { writer.write(rows, count); }, progress);
        hash.checkUnchanged();
        writer.close();
    } else {
        vlx::Reconstruction result = reconstruct(o, dump, progress);
        hash.checkUnchanged();
        const vlx::Image map = o.samplingMap.empty() ? vlx::Image() : vlx::samplingMap(result.image);
        if (o.diagnostics) vlx::addDiagnosticLayers(result);
        // Both files or none: the image gets its name only when the JSON is complete.
        std::optional<vlx::OutputFile> diagnostics;
        if (o.diagnostics) writeText(diagnostics.emplace(o.image + ".json"), vlx::toJson(result));
        vlx::writeImage(o.image, result.image, write);
        if (diagnostics) diagnostics->commit();
        if (!o.samplingMap.empty()) vlx::writeImage(o.samplingMap, map, write);
        report = std::move(result.report);
    }
    if (o.json) {
        std::printf("%s\n", vlx::toJson(report).c_str());
    } else if (std::string text = vlx::toText(report); !text.empty()) {
        text.pop_back();
        vlx::say(o.image + ": " + text);
    }
}

int run(Options& o) {
    o.paper.colourDistance = !o.noColourDistance;
    if (o.wholeImage) o.paper.regionSize = 0;
    o.krige.standardFeatures = !o.noFeatures;
    if (!o.band.empty()) {
        if (o.method != Method::Krige) throw CLI::ValidationError("--band goes with --method krige");
        o.krige.band = vlx::parseBand(o.band);
        if (o.filter != vlx::PixelFilter::Box)  // it reaches into the bands beside
            throw CLI::ValidationError("--band goes with --filter box");
    }
    if (o.method != Method::Krige && (o.filter != vlx::PixelFilter::Box || o.krige.scale != 1))
        throw CLI::ValidationError("--filter and --scale go with --method krige");
    if (!o.inspect.empty() && !o.diagnostics) throw CLI::ValidationError("--inspect goes with --diagnostics");
    for (const std::string& text : o.inspect) o.paper.inspect.push_back(parsePixel(text));
    if (o.method != Method::Paper && (o.diagnostics || o.noColourDistance || o.wholeImage))
        throw CLI::ValidationError(
            "--diagnostics, --no-colour-distance and --whole-image go with --method paper");

    if (!o.samplingMap.empty() && o.method == Method::Gaussian)
        throw CLI::ValidationError("--sampling-map does not go with --method gaussian");
    if (!o.maxMemory.empty()) {
        if (o.method != Method::Krige || o.filter != vlx::PixelFilter::Box || !o.samplingMap.empty())
            throw CLI::ValidationError(
                "--max-memory goes with --method krige, --filter box and no --sampling-map");
        o.krige.maxMemory = parseMemory(o.maxMemory);
#ifdef __GLIBC__
        mallopt(M_MMAP_THRESHOLD, 1 << 20);  // what is done with is given back
#endif
    }
    const vlx::ThreadLimit limit(o.threads);
    vlx::ProgressBar bar("kriging");
    if (o.frames.empty()) {
        kriged(o, bar);
        return vlx::kDone;
    }
    vlx::requireFramePlace("DUMP", o.dump);
    vlx::requireFramePlace("--output", o.image);
    if (!o.samplingMap.empty()) vlx::requireFramePlace("--sampling-map", o.samplingMap);
    vlx::forEachFrame(vlx::parseFrames(o.frames), bar, [&](int frame, const vlx::Progress& progress) {
        Options one = o;
        for (std::string* name : {&one.dump, &one.image, &one.samplingMap})
            *name = vlx::frameName(*name, frame);
        kriged(one, progress);
    });
    return vlx::kDone;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app(
        "Removes the noise of a path-traced image by kriging its samples, and says how accurate the result "
        "is.",
        "vlx-krige");
    Options options;
    bind(app, options);
    return vlx::runTool(argc, argv, app, [&] { return run(options); });
}
