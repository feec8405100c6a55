#include <malloc.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "exr/flat_header.h"
#include "finished.h"
#include "frames.h"
#include "import/bcd.h"
#include "import/image_layers.h"
#include "import_options.h"
#include "progress_bar.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/gaussian.h"
#include "variolux/dump/layers.h"
#include "variolux/dump/positions.h"
#include "variolux/dump/reader.h"
#include "variolux/reconstruct/drift_kriging.h"
#include "variolux/reconstruct/mean.h"
#include "variolux/reconstruct/paper.h"
#include "variolux/reconstruct/pixel_filter.h"
#include "variolux/reconstruct/sampling_map.h"

namespace {

enum class Method { Krige, Paper, Mean, Gaussian };

struct Options {
    std::string input;
    vlx::MomentFlags moments;
    std::string layersOf;
    bool dropLayers = false;
    std::string image;
    Method method = Method::Krige;
    vlx::DriftKrigingOptions krige;
    vlx::PixelFilter filter = vlx::PixelFilter::Box;
    std::string band;
    std::string samplingMap;
    bool noFeatures = false;
    vlx::PositionConvention positions = vlx::PositionConvention::Raster;
    bool layersAreSamples = false;
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
    app.add_option(
           "INPUT", o.input,
           "Sample dump (deep OpenEXR) of any renderer, or a flat image with the variance of its pixels")
        ->required();
    app.add_option(
           "-o,--output", o.image,
           "OpenEXR image to write: R, G, B, A when the dump has it, and layer stddev (the standard "
           "deviation of the error of R, G, B). Of a flat OpenEXR image: a copy with all its layers and "
           "parts, R, G, B, A and named radiance denoised, stddev added")
        ->required();
    app.add_option(
           "--template", o.layersOf,
           "Put the result into a copy of this flat OpenEXR file of the same size, as of a flat input")
        ->option_text("IMAGE");
    app.add_flag("--drop-layers", o.dropLayers, "Of a flat image: write only what is denoised, and stddev")
        ->excludes("--template");
    vlx::addChoice(
        app, "--method", o.method,
        {{"krige", Method::Krige},
         {"paper", Method::Paper},
         {"mean", Method::Mean},
         {"gaussian", Method::Gaussian}},
        "krige: kriging with the features as external drift, in overlapping neighbourhoods; paper: "
        "kriging by region (Yue and Nishita); mean: plain average of each pixel's samples, its stddev the "
        "plain standard error, 0 where they agree; "
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
        ->check(vlx::finitePositive())
        ->capture_default_str();
    app.add_option("--strength", o.krige.strength,
                   "krige: 0 keeps the plain average (of what --fireflies leaves), 1 takes the estimate")
        ->check(vlx::finiteWithin(0, 1))
        ->capture_default_str();
    app.add_option(
        "--feature", o.krige.features,
        "krige: a further channel of the dump to use as drift, besides albedo, N and Z; repeatable");
    app.add_option(
        "--radiance", o.krige.radiance,
        "krige: a further channel or layer to estimate with the same weights as R, G, B (a light group): "
        "parts still add up; repeatable");
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
    std::vector<std::pair<std::string, vlx::PositionConvention>> conventions;
    for (const auto& known : vlx::positionConventions())
        conventions.emplace_back(known.name, known.convention);
    vlx::addChoice(
        app, "--positions", o.positions, conventions,
        "What sample.x and sample.y of the dump are, where they are used (--scale, --filter, paper). "
        "raster: pixels, downwards; others are recognised and told");
    app.add_flag(
        "--layers-are-samples", o.layersAreSamples,
        "Average the samples of a dump that looks like a deep image of layers, which is else refused");
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
        ->check(vlx::finitePositive())
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
           "are read at a time, and less than a picture of that width needs (170M or more) is refused. The "
           "result does not depend on it")
        ->option_text("SIZE");
    app.add_option("--threads", o.threads, "0: all processors. The result does not depend on it")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    o.moments.bind(app, "Flat images (--map also says where --template has R, G, B)");
    app.footer(
        "Examples:\n"
        "  vlx-krige samples.exr -o image.exr\n"
        "  vlx-krige beauty.exr -o denoised.exr --radiance key --radiance fill\n"
        "  vlx-krige samples.exr -o denoised.exr --template beauty.exr\n"
        "  vlx-krige samples.exr -o blurred.exr --method gaussian --sigma 1.5\n"
        "  vlx-krige room_####.exr -o kriged_####.exr --frames 1-100\n"
        "Samples that are not finite are left out and counted. Regions that cannot be kriged\n"
        "get their mean and are counted.");
}

const std::vector<vlx::OptionUse>& usesByMethod() {
    static const std::vector<vlx::OptionUse> uses = {
        {{"--quality", "--fireflies", "--strength", "--feature", "--radiance", "--scale", "--filter",
          "--band", "--no-features", "--max-memory"},
         {"--method krige"}},
        {{"--clamp"}, {"--fireflies clamp"}},
        {{"--sampling-map"}, {"--method krige", "--method paper", "--method mean"}},
        {{"--sigma"}, {"--method gaussian"}},
        {{"--region", "--whole-image", "--no-colour-distance", "--diagnostics"}, {"--method paper"}},
        {{"--inspect"}, {"--diagnostics"}},
        {{"--positions"},
         {"--method paper", "--scale 2 to 4", "--filter gaussian", "--filter blackman-harris"}}};
    return uses;
}

const std::vector<vlx::OptionUse>& usesByInput() {
    static const std::vector<vlx::OptionUse> uses = {
        {{"--preset", "--variance-is", "--variance-of", "--variance", "--albedo", "--normal", "--depth",
          "--samples", "--drop-layers"},
         {"a flat image"}},
        {{"--map"}, {"a flat image", "--template"}},
        {{"--layers-are-samples", "--positions"}, {"a dump"}}};
    return uses;
}

void checkMethodOptions(const Options& o) {
    std::vector<std::string> atHand;
    for (const char* option : {"--method", "--fireflies", "--filter"})
        atHand.push_back(std::string(option) + " " + o.commandLine->get_option(option)->as<std::string>());
    if (o.krige.scale > 1) atHand.emplace_back("--scale 2 to 4");
    if (o.diagnostics) atHand.emplace_back("--diagnostics");
    vlx::checkOptionUse(*o.commandLine, usesByMethod(), atHand);
}

// The samples of a dump, or those that the moments of a flat image stand for.
std::unique_ptr<vlx::SampleSource> openInput(const Options& o, bool flat) {
    if (!flat) {
        auto dump = std::make_unique<vlx::DumpReader>(o.input);
        vlx::checkOptionUse(*o.commandLine, usesByInput(),
                            {"a dump", o.layersOf.empty() ? "" : "--template"});
        if (const std::string by = o.layersAreSamples ? "" : vlx::layersFoundBy(*dump); !by.empty())
            throw vlx::Error(o.input, "expected samples of the camera, found layers to be composited (" + by +
                                          "), whose average is no image: flatten it where it was made, or "
                                          "average them all the same with --layers-are-samples");
        return dump;
    }
    vlx::checkOptionUse(*o.commandLine, usesByInput(), {"a flat image"});
    vlx::MomentOptions options = o.moments.options();
    options.radiance = o.krige.radiance;
    for (const std::string& feature : o.krige.features) options.map.try_emplace(feature, feature);
    return vlx::openMoments(o.input, options);
}

// The channels of an image that a predicate holds for.
vlx::Image channelsOf(const vlx::Image& image, const std::function<bool(const std::string&)>& wanted) {
    std::vector<int> taken;
    std::vector<std::string> names;
    for (int c = 0; c < image.channelCount(); ++c)
        if (const std::string& name = image.channels[static_cast<std::size_t>(c)]; wanted(name)) {
            taken.push_back(c);
            names.push_back(name);
        }
    vlx::Image result(image.data, names);
    result.display = image.display;
    for (int row = 0; row < image.data.height; ++row)
        for (int col = 0; col < image.data.width; ++col) {
            const float* from = image.at(col, row);
            std::transform(taken.begin(), taken.end(), result.at(col, row), [&](int c) { return from[c]; });
        }
    return result;
}

// Which layers of the file to be copied the image replaces: of a flat input those that it was made of.
vlx::ChannelMap replacedLayers(const Options& o, const std::string& original,
                               const vlx::SampleSource& source) {
    vlx::ChannelMap map;
    if (const auto* moments = dynamic_cast<const vlx::ImportedSamples*>(&source);
        original == o.input && moments)
        map = moments->report().mapped;
    else
        map = vlx::findRadiance(original, o.moments.options().map);
    std::erase_if(map, [](const auto& entry) {
        return entry.first != "R" && entry.first != "G" && entry.first != "B" && entry.first != "A";
    });
    return map;
}

/// By the methods that hold the image whole.
vlx::Reconstruction reconstruct(const Options& o, const vlx::SampleSource& dump,
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
    // A pixel without samples has no part in its neighbours.
    vlx::Reconstruction result =
        vlx::reconstructMean(dump, progress, std::numeric_limits<float>::quiet_NaN());
    // The error of a filtered pixel is mostly bias, which this filter cannot know: no stddev layer.
    const vlx::Image radiance = channelsOf(
        result.image, [](const std::string& name) { return name == "R" || name == "G" || name == "B"; });
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

std::string inWords(const vlx::Window& w) {
    return "columns " + std::to_string(w.x) + " to " + std::to_string(w.x + (w.width - 1)) + " and rows " +
           std::to_string(w.y) + " to " + std::to_string(w.y + (w.height - 1));
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

// On standard error: what became of the layers; warnings also where the report is JSON.
void tell(const vlx::SampleSource& source, const std::string& original, const vlx::LayerCopy& copied,
          bool warningsOnly) {
    std::string text;
    if (const auto* imported = dynamic_cast<const vlx::ImportedSamples*>(&source);
        imported && !warningsOnly) {
        vlx::ImportReport report = imported->report();
        report.ignored.clear();
        text += vlx::toText(report);
    }
    if (!warningsOnly && !original.empty()) {
        text += "a copy of " + original + " with";
        for (const auto& [channel, from] : copied.replaced) text += " " + channel;
        text += " denoised";
        for (const auto& name : copied.added) text += ", " + name + " added";
        text += "\n";
    }
    if (!copied.recompressed.empty())
        text += "WARNING: " + copied.recompressed +
                " would lose bits of untouched layers once more: their part is ZIP now.\n";
    if (copied.overflows > 0)
        text += "WARNING: " + std::to_string(copied.overflows) +
                " values beyond 65504, the range of half channels, are stored as 65504.\n";
    if (text.empty()) return;
    text.pop_back();
    vlx::say(text);
}

void kriged(const Options& o, const vlx::Progress& progress) {
    std::vector<std::string> files = o.moments.files();
    files.insert(files.end(), {o.input, o.layersOf});
    vlx::checkOutputName(o.image, files);
    const std::string diagnosticsName = o.diagnostics ? o.image + ".json" : "";
    vlx::checkOutputs(
        {{"--output", o.image}, {"--diagnostics", diagnosticsName}, {"--sampling-map", o.samplingMap}},
        files);
    const bool flat = vlx::isFlatImage(o.input);
    // What the result becomes a part of.
    std::string original = o.layersOf;
    if (original.empty() && flat && !o.dropLayers && vlx::isOpenExr(o.input)) original = o.input;
    if (!original.empty() && (!o.band.empty() || o.krige.scale != 1 || !o.maxMemory.empty()))
        throw CLI::ValidationError(
            "--band, --scale and --max-memory go with --drop-layers or a dump, without --template");
    vlx::ImageWriteOptions write;
    write.attributes["Software"] = "vlx-krige";
    if (!o.samplingMap.empty() && !o.samplingMap.ends_with(".exr"))
        throw CLI::ValidationError("--sampling-map",
                                   "expected a name that ends with .exr, found '" + o.samplingMap + "'");
    vlx::InputsHash hash(*o.commandLine,
                         {"INPUT", "--template", "--variance", "--albedo", "--normal", "--depth"});
    for (const std::string& file : files) {
        hash.add("file", file.empty() ? "none" : "given");  // which of them
        hash.addFile(file);
    }
    const std::string inputs = write.attributes[vlx::kInputsAttribute] = hash.text(o.krige.band);
    std::vector<std::string> outputs = {o.image};
    if (!o.samplingMap.empty()) outputs.push_back(o.samplingMap);
    if (o.diagnostics) outputs.push_back(diagnosticsName);
    if (!o.overwrite && vlx::isFinished(outputs, inputs)) {
        if (o.json) std::printf("{\"skipped\": true}\n");
        return;
    }
    { const vlx::OutputFile writable(o.image); }  // found out now, not after the work
    const std::unique_ptr<vlx::SampleSource> source = openInput(o, flat);
    const bool usesPositions =
        o.method == Method::Paper || o.krige.scale > 1 || o.filter != vlx::PixelFilter::Box;
    const vlx::PositionedSamples dump(*source, o.positions, usesPositions);
    for (const auto& [x, y] : o.paper.inspect)
        if (!dump.header().data.contains(x, y))
            throw CLI::ValidationError("--inspect", "expected a pixel of the picture, " +
                                                        inWords(dump.header().data) + ", found " +
                                                        std::to_string(x) + "," + std::to_string(y));
    const vlx::ChannelMap replaced =
        original.empty() ? vlx::ChannelMap() : replacedLayers(o, original, *source);
    vlx::LayerCopy copied;
    vlx::ReconstructionReport report;
    if (original.empty() && o.method == Method::Krige && o.filter == vlx::PixelFilter::Box &&
        o.samplingMap.empty()) {
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
        if (o.diagnostics) writeText(diagnostics.emplace(diagnosticsName), vlx::toJson(result));
        if (original.empty())
            vlx::writeImage(o.image, result.image, write);
        else
            copied = vlx::copyWithLayers(
                original, o.image,
                channelsOf(result.image,
                           [&](const std::string& name) { return name != "A" || replaced.contains("A"); }),
                replaced, {{vlx::kInputsAttribute, inputs}});
        if (diagnostics) diagnostics->commit();
        if (!o.samplingMap.empty()) vlx::writeImage(o.samplingMap, map, write);
        report = std::move(result.report);
    }
    tell(*source, original, copied, o.json);
    if (const std::string text = vlx::toText(dump.report()); !text.empty()) {
        std::string advice;
        for (const auto& known : vlx::positionConventions())
            if (dump.report().likely == known.convention)
                advice = " (--positions " + known.name + " reads them so)";
        vlx::say(o.input + ": WARNING: " + text + advice);
    }
    if (o.json) {
        std::printf("%s\n", vlx::toJson(report).c_str());
    } else if (std::string text = vlx::toText(report); !text.empty()) {
        text.pop_back();
        vlx::say(o.image + ": " + text);
    }
}

int run(Options& o) {
    checkMethodOptions(o);
    o.paper.colourDistance = !o.noColourDistance;
    if (o.wholeImage) o.paper.regionSize = 0;
    o.krige.standardFeatures = !o.noFeatures;
    if (!o.band.empty()) {
        o.krige.band = vlx::parseBand(o.band);
        if (o.filter != vlx::PixelFilter::Box)  // it reaches into the bands beside
            throw CLI::ValidationError("--band goes with --filter box");
    }
    for (const std::string& text : o.inspect) o.paper.inspect.push_back(parsePixel(text));
    if (!o.maxMemory.empty()) {
        if (o.filter != vlx::PixelFilter::Box || !o.samplingMap.empty())
            throw CLI::ValidationError("--max-memory goes with --filter box and no --sampling-map");
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
    vlx::requireFramePlace("INPUT", o.input);
    vlx::requireFramePlace("--output", o.image);
    if (!o.samplingMap.empty()) vlx::requireFramePlace("--sampling-map", o.samplingMap);
    vlx::forEachFrame(vlx::parseFrames(o.frames), bar, [&](int frame, const vlx::Progress& progress) {
        Options one = o;
        std::vector<std::string*> names = one.moments.fileNames();
        names.insert(names.end(), {&one.input, &one.image, &one.samplingMap, &one.layersOf});
        for (std::string* name : names) *name = vlx::frameName(*name, frame);
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
