#include "krige/krige_options.h"

#include <cstdio>
#include <map>

#include "finished.h"
#include "tool_main.h"

namespace vlx {

namespace {

const std::vector<OptionUse>& usesByMethod() {
    static const std::vector<OptionUse> uses = {
        {{"--quality", "--fireflies", "--strength", "--feature", "--radiance", "--scale", "--filter",
          "--band", "--temporal", "--no-features", "--without", "--max-memory", "--denoised",
          "--denoised-halves", "--denoiser", "--assess", "--assess-halves"},
         {"--method krige"}},
        {{"--clamp"}, {"--fireflies clamp"}},
        {{"--sampling-map"}, {"--method krige", "--method paper", "--method mean"}},
        {{"--sigma"}, {"--method gaussian"}},
        {{"--region", "--whole-image", "--no-colour-distance"}, {"--method paper"}},
        {{"--diagnostics"}, {"--method krige", "--method paper"}},
        {{"--inspect"}, {"--diagnostics"}},
        {{"--positions"},
         {"--method paper", "--scale 2 to 4", "--filter gaussian", "--filter blackman-harris"}}};
    return uses;
}

const std::vector<OptionUse>& usesByInput() {
    static const std::vector<OptionUse> uses = {
        {{"--preset", "--variance-is", "--variance-of", "--variance", "--albedo", "--normal", "--depth",
          "--samples", "--drop-layers"},
         {"a flat image"}},
        {{"--map", "--layer"}, {"a flat image", "--template"}},
        {{"--layers-are-samples", "--positions"}, {"a dump"}}};
    return uses;
}

/// Steps that can be left out.
void addSteps(CLI::App& app, DriftSteps& steps) {
    static const std::map<std::string, bool DriftSteps::*> names = {
        {"prefilter", &DriftSteps::prefilter}, {"unseen", &DriftSteps::unseen},
        {"stacking", &DriftSteps::stacking},   {"half-resolution", &DriftSteps::halfResolution},
        {"outliers", &DriftSteps::outliers},   {"light", &DriftSteps::light}};
    app.add_option_function<std::vector<std::string>>(
           "--without",
           [&steps](const std::vector<std::string>& left) {
               for (const std::string& name : left) steps.*names.at(name) = false;
           },
           "krige: leave out steps, to show what it does (METHOD.md, 7): prefilter of noisy features, "
           "unseen (what no "
           "sample met, in error variances), stacking of models, half-resolution, outliers, light (given "
           "back); "
           "repeatable")
        ->option_text("STEP,...")
        ->delimiter(',')
        ->check(CLI::IsMember(names))
        ->take_all()
        ->expected(1);
}

}  // namespace

void bindOptions(CLI::App& app, KrigeOptions& o) {
    o.commandLine = &app;
    app.add_option(
           "INPUT", o.input,
           "Sample dump (deep OpenEXR) of any renderer, or a flat image with the variance of its pixels")
        ->required();
    app.add_option(
           "-o,--output", o.image,
           "OpenEXR image to write: R, G, B, A when the dump has it, and layer stddev (the estimated "
           "standard "
           "deviation of the error of R, G, B). Of a flat OpenEXR image: a copy with all its layers and "
           "parts, R, G, B, A and named radiance denoised, stddev added beside them (ViewLayer.stddev "
           "beside ViewLayer.Combined)")
        ->required();
    app.add_option(
           "--template", o.layersOf,
           "Put the result into a copy of this flat OpenEXR file of the same size, as of a flat input")
        ->option_text("IMAGE");
    app.add_flag("--drop-layers", o.dropLayers, "Of a flat image: write only what is denoised, and stddev")
        ->excludes("--template");
    addChoice(
        app, "--method", o.method,
        {{"krige", KrigeMethod::Krige},
         {"paper", KrigeMethod::Paper},
         {"mean", KrigeMethod::Mean},
         {"gaussian", KrigeMethod::Gaussian}},
        "krige: kriging with the features as external drift, in overlapping neighbourhoods; paper: "
        "kriging by region (Yue and Nishita); mean: plain average of each pixel's samples, its stddev the "
        "plain standard error, 0 where they agree; "
        "gaussian: the average, Gaussian filtered (no layer stddev)");
    addChoice(app, "--quality", o.krige.quality,
              {{"draft", Quality::Draft}, {"standard", Quality::Standard}, {"high", Quality::High}},
              "krige: draft: one model, sparse neighbourhoods, an image without compression; standard: three "
              "models; high: neighbourhoods "
              "twice as dense along each axis");
    addChoice(
        app, "--fireflies", o.krige.fireflies,
        {{"keep", Fireflies::Keep}, {"robust", Fireflies::Robust}, {"clamp", Fireflies::Clamp}},
        "krige: samples far brighter than all around. keep: all count as they are, which is noisy, and "
        "still not unbiased: the estimate smooths; robust: the brightest sample of 5 x 5 pixels counts "
        "as bright as the second, and what light that costs is given back around it; clamp: luminance is "
        "cut at --clamp, which darkens. What was removed is reported");
    app.add_option("--clamp", o.krige.clamp, "krige: greatest luminance of a sample with --fireflies clamp")
        ->check(finitePositive())
        ->capture_default_str();
    app.add_option("--strength", o.krige.strength,
                   "krige: 0 keeps the plain average (of what --fireflies leaves), 1 takes the estimate")
        ->check(finiteWithin(0, 1))
        ->capture_default_str();
    app.add_option(
        "--feature", o.krige.features,
        "krige: a further channel of the dump to use as drift, besides albedo, N and Z; repeatable");
    app.add_option(
        "--radiance", o.krige.radiance,
        "krige: a further channel or layer to estimate with the same weights as R, G, B (a light group): "
        "parts of R, G, B still add up to them, but for rounding; repeatable");
    app.add_option("--scale", o.krige.scale,
                   "krige: pixels of the image along each axis for one of the dump; needs sample positions")
        ->check(CLI::Range(1, 4))
        ->capture_default_str();
    addChoice(app, "--filter", o.filter,
              {{"box", PixelFilter::Box},
               {"gaussian", PixelFilter::Gaussian},
               {"blackman-harris", PixelFilter::BlackmanHarris}},
              "krige: pixel filter of the result. box: averages over pixels; gaussian: standard deviation "
              "0.5, radius 1.5; blackman-harris: radius 1.5 pixels");
    std::vector<std::pair<std::string, PositionConvention>> conventions;
    for (const auto& known : positionConventions()) conventions.emplace_back(known.name, known.convention);
    addChoice(app, "--positions", o.positions, conventions,
              "What sample.x and sample.y of the dump are, where they are used (--scale, --filter, paper). "
              "raster: pixels, downwards; others are recognised and told");
    app.add_flag(
        "--layers-are-samples", o.layersAreSamples,
        "Average the samples of a dump that looks like a deep image of layers, which is else refused");
    app.add_option(
           "--band", o.band,
           "krige: only band I of N, cut by rows from the top: the same pixels, bit for bit, that the "
           "whole image has there, with its display window (not with --filter or --diagnostics, which need "
           "it whole)")
        ->option_text("I/N");
    app.add_option("--sampling-map", o.samplingMap,
                   "Also write where more samples would lower the error most: an EXR image with channel "
                   "sampling.density, for vlx-trace --append --sample-map (not with --method gaussian)")
        ->option_text("IMAGE");
    o.opinion.bind(app);
    app.add_flag("--no-features", o.noFeatures, "krige: use neither albedo nor N nor Z");
    addSteps(app, o.krige.steps);
    app.add_option("--sigma", o.gaussian.sigma, "gaussian: standard deviation in pixels")
        ->check(finitePositive())
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
        "krige, paper: also write layers diagnostics.* and OUTPUT.json: of each region the variogram's "
        "nugget, "
        "sill, range, exponent and what was made of it; with krige, of what the estimate lacks, region by "
        "region, and whether that has any structure");
    app.add_option("--inspect", o.inspect,
                   "With --diagnostics: put the classes and the fitted curve of the variogram of the region "
                   "of this pixel "
                   "into OUTPUT.json, with paper its cloud and cross-validation, too; repeatable")
        ->option_text("X,Y")
        ->take_all()
        ->expected(1);
    app.add_flag("--json", o.json, "Print the report as JSON on standard output");
    app.add_option(
           "--frames", o.frames,
           "Krige these frames, for example 1-100x2,150: #### in the names of files stands for the frame's "
           "number. When a frame fails the others go on")
        ->option_text("LIST");
    app.add_option(
           "--temporal", o.krige.temporal,
           "krige: with --frames: data of N frames before and N after add to each frame (near the ends "
           "of a shot more on the other side), as far as there are such files, within --frames or "
           "not; N is at most 8. They are moved by the dumps' motion vectors, or used as they lie where "
           "there are "
           "none. What was hidden or has changed loses its weight. Memory: 2 N + 1 whole frames. "
           "Pixels do not depend on how frames are shared out to processes")
        ->check(CLI::Range(0, kMostTemporal))
        ->option_text("N")
        ->capture_default_str();
    addOverwrite(app, o.overwrite);
    app.add_option(
           "--max-memory", o.maxMemory,
           "krige: memory of the process at most, for example 2G or 500M (10^9, 10^6 bytes): fewer rows "
           "are read at a time, and less than a picture of that width needs is refused, with what would do. "
           "The "
           "result does not depend on it (not with --filter, --sampling-map or --diagnostics)")
        ->option_text("SIZE");
    app.add_option("--threads", o.threads, "0: all processors. The result does not depend on it")
        ->check(CLI::Range(0, 1024))
        ->capture_default_str();
    o.moments.bind(app, "Flat images (--layer and --map also say where --template has R, G, B)");
    app.footer(
        "Examples:\n"
        "  vlx-krige samples.exr -o image.exr\n"
        "  vlx-krige beauty.exr -o denoised.exr --radiance key --radiance fill\n"
        "  vlx-krige samples.exr -o denoised.exr --template beauty.exr\n"
        "  vlx-krige samples.exr -o blurred.exr --method gaussian --sigma 1.5\n"
        "  vlx-krige room_####.exr -o kriged_####.exr --frames 1-100 --temporal 2\n"
        "Samples that are not finite are left out and counted. Regions that cannot be kriged\n"
        "get their mean and are counted.");
}

Method methodOf(const KrigeOptions& o) {
    switch (o.method) {
        case KrigeMethod::Krige:
            return o.krige;
        case KrigeMethod::Paper:
            return o.paper;
        case KrigeMethod::Mean:
            return Mean{};
        case KrigeMethod::Gaussian:
            break;
    }
    return o.gaussian;
}

void checkMethodOptions(const KrigeOptions& o) {
    std::vector<std::string> atHand;
    for (const char* option : {"--method", "--fireflies", "--filter"})
        atHand.push_back(std::string(option) + " " + o.commandLine->get_option(option)->as<std::string>());
    if (o.krige.scale > 1) atHand.emplace_back("--scale 2 to 4");
    if (o.diagnostics) atHand.emplace_back("--diagnostics");
    checkOptionUse(*o.commandLine, usesByMethod(), atHand);
}

void checkOpinion(const KrigeOptions& o) {
    if (!o.opinion.any()) return;
    if (o.krige.scale != 1 || !o.krige.radiance.empty() || o.krige.strength != 1)
        throw CLI::ValidationError(
            "--denoised, --denoiser and --assess go without --scale, --radiance and --strength: the other "
            "image has no such pixels, no such parts, and is no plain average");
    if (o.opinion.assesses() && (!o.layersOf.empty() || !o.band.empty() || !o.maxMemory.empty() ||
                                 !o.samplingMap.empty() || o.diagnostics || o.filter != PixelFilter::Box))
        throw CLI::ValidationError(
            "--assess goes without --template, --band, --max-memory, --sampling-map, --diagnostics and "
            "--filter: it writes an error map of the whole picture");
    o.opinion.check();
}

void checkInputOptions(const KrigeOptions& o, const std::vector<std::string>& atHand) {
    checkOptionUse(*o.commandLine, usesByInput(), atHand);
}

std::pair<int, int> parsePixel(const std::string& text) {
    int x = 0, y = 0, end = 0;
    if (std::sscanf(text.c_str(), "%d,%d%n", &x, &y, &end) != 2 ||
        static_cast<std::size_t>(end) != text.size())
        throw CLI::ValidationError("--inspect", "expected X,Y in pixels, found '" + text + "'");
    return {x, y};
}

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

}  // namespace vlx
