#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "exr/flat_header.h"
#include "exr/flat_images.h"
#include "finished.h"
#include "frames.h"
#include "import/bcd.h"
#include "import/image_layers.h"
#include "import_options.h"
#include "krige/krige_options.h"
#include "progress_bar.h"
#include "tool_main.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/layers.h"
#include "variolux/dump/positions.h"
#include "variolux/dump/reader.h"
#include "variolux/reconstruct/assessment.h"
#include "variolux/reconstruct/pixel_filter.h"
#include "variolux/reconstruct/reconstruct.h"
#include "variolux/reconstruct/sampling_map.h"
#include "variolux/reconstruct/sequence.h"

namespace {

// The samples of a dump, or those that the moments of a flat image stand for.
std::unique_ptr<vlx::SampleSource> openInput(const vlx::KrigeOptions& o, bool flat) {
    if (!flat) {
        auto dump = std::make_unique<vlx::DumpReader>(o.input);
        vlx::checkInputOptions(o, {"a dump", o.layersOf.empty() ? "" : "--template"});
        if (const std::string by = o.layersAreSamples ? "" : vlx::layersFoundBy(*dump); !by.empty())
            throw vlx::Error(o.input, "expected samples of the camera, found layers to be composited (" + by +
                                          "), whose average is no image: flatten it where it was made, or "
                                          "average them all the same with --layers-are-samples");
        return dump;
    }
    vlx::checkInputOptions(o, {"a flat image"});
    vlx::MomentOptions options = o.moments.options();
    options.radiance = o.krige.radiance;
    for (const std::string& feature : o.krige.features) options.map.try_emplace(feature, feature);
    return vlx::openMoments(o.input, options);
}

// A file without A gets none.
vlx::Image withoutNewAlpha(const vlx::Image& image, const vlx::ChannelMap& replaced) {
    std::vector<std::string> channels = image.channels;
    if (!replaced.contains("A")) std::erase(channels, "A");
    return image.select(channels);
}

// Which layers of the file to be copied the image replaces: of a flat input those that it was made of.
vlx::ChannelMap replacedLayers(const vlx::KrigeOptions& o, const std::string& original,
                               const vlx::SampleSource& source) {
    vlx::ChannelMap map;
    if (const auto* moments = dynamic_cast<const vlx::ImportedSamples*>(&source);
        original == o.input && moments)
        map = moments->report().mapped;
    else
        map = vlx::findRadiance(original, o.moments.options().map, o.moments.options().layer);
    std::erase_if(map, [](const auto& entry) {
        return entry.first != "R" && entry.first != "G" && entry.first != "B" && entry.first != "A";
    });
    for (const auto& [channel, from] : map)
        if (vlx::parseScaled(from) && o.moments.options().map.contains(channel))
            throw CLI::ValidationError("--map", "expected " + channel +
                                                    " without a factor, as it is put back into its channel "
                                                    "(--drop-layers puts nothing back), found '" +
                                                    from + "'");
    return map;
}

std::string inWords(const vlx::Window& w) {
    return "columns " + std::to_string(w.x) + " to " + std::to_string(w.x + (w.width - 1)) + " and rows " +
           std::to_string(w.y) + " to " + std::to_string(w.y + (w.height - 1));
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

constexpr const char* kAssessment = "variolux:assessment";
constexpr const char* kAssessmentJson = "variolux:assessmentJson";

// What was asked for, as the map keeps it.
void printAssessment(const vlx::KrigeOptions& o) {
    if (o.json)
        std::printf("%s\n", vlx::readTextAttribute(o.image, kAssessmentJson).c_str());
    else
        std::printf("%s: %s", o.opinion.assessed.c_str(),
                    vlx::readTextAttribute(o.image, kAssessment).c_str());
}

void assessed(const vlx::KrigeOptions& o, const vlx::SampleSource& samples, const vlx::Drift& method,
              const vlx::Fingerprint& made, const vlx::ImageWriteOptions& write,
              const vlx::Progress& progress) {
    const vlx::Assessment of = vlx::assess(samples, method, progress);
    made.checkUnchanged();
    vlx::ImageWriteOptions said = write;  // for runs that find it finished
    said.attributes[kAssessment] = vlx::toText(of.report);
    said.attributes[kAssessmentJson] = vlx::toJson(of.report);
    vlx::writeImage(o.image, of.map, said);
    printAssessment(o);
}

// A sequence whose frames add to each other.
class Shot {
  public:
    explicit Shot(const vlx::KrigeOptions& o)
        : options_(o), sequence_([this](int frame) { return open(frame); }, o.krige) {}

    // The options of one frame.
    vlx::KrigeOptions frame(int number) const {
        vlx::KrigeOptions one = options_;
        std::vector<std::string*> names = one.moments.fileNames();
        names.insert(names.end(), {&one.input, &one.image, &one.samplingMap, &one.layersOf});
        for (std::string* name : names) *name = vlx::frameName(*name, number);
        one.opinion = options_.opinion.ofFrame(number);
        return one;
    }
    // What the result depends on besides the frame's own files. Frames that have become others are forgotten.
    std::vector<std::string> filesAround(int number) {
        std::vector<std::string> files;
        const vlx::FramesAround around = vlx::framesAround(
            number, options_.krige.temporal, [&](int i) { return std::filesystem::exists(frame(i).input); });
        for (int i = number - around.before; i <= number + around.after; ++i) {
            if (i == number) continue;
            const vlx::KrigeOptions one = frame(i);
            files.push_back(one.input);
            for (const std::string& file : one.moments.files()) files.push_back(file);
        }
        for (auto at = read_.begin(); at != read_.end();)
            if (at->second != identity(at->first)) {
                sequence_.forget(at->first);
                at = read_.erase(at);
            } else {
                ++at;
            }
        return files;
    }
    vlx::Sequence& sequence() { return sequence_; }

  private:
    struct Opened : vlx::PositionedSamples {
        Opened(std::unique_ptr<vlx::SampleSource> samples, vlx::PositionConvention convention, bool used)
            : vlx::PositionedSamples(*samples, convention, used), source(std::move(samples)) {}
        std::unique_ptr<vlx::SampleSource> source;
    };

    std::unique_ptr<vlx::SampleSource> open(int number) {
        const vlx::KrigeOptions one = frame(number);
        if (!std::filesystem::exists(one.input)) return nullptr;
        read_[number] = identity(number);
        return std::make_unique<Opened>(openInput(one, vlx::isFlatImage(one.input)), one.positions,
                                        one.krige.scale > 1);
    }
    std::pair<std::uintmax_t, std::filesystem::file_time_type> identity(int number) const {
        std::error_code none;
        const std::string name = frame(number).input;
        return {std::filesystem::file_size(name, none), std::filesystem::last_write_time(name, none)};
    }

    const vlx::KrigeOptions& options_;
    std::map<int, std::pair<std::uintmax_t, std::filesystem::file_time_type>> read_;
    vlx::Sequence sequence_;
};

// `shot`: where `number` is a frame of one; else null.
void kriged(const vlx::KrigeOptions& o, const vlx::Progress& progress, Shot* shot = nullptr, int number = 0) {
    std::vector<std::string> files = o.moments.files();
    files.insert(files.end(), {o.input, o.layersOf});
    const std::vector<std::string> opinions = o.opinion.files();
    files.insert(files.end(), opinions.begin(), opinions.end());
    if (shot) {
        const std::vector<std::string> around = shot->filesAround(number);
        files.insert(files.end(), around.begin(), around.end());
    }
    vlx::checkOutputName(o.image, files);
    const std::string diagnosticsName = o.diagnostics ? o.image + ".json" : "";
    vlx::checkOutputs(
        {{"--output", o.image}, {"--diagnostics", diagnosticsName}, {"--sampling-map", o.samplingMap}},
        files);
    const bool flat = vlx::isFlatImage(o.input);
    // What the result becomes a part of.
    std::string original = o.layersOf;
    if (original.empty() && flat && !o.dropLayers && !o.opinion.assesses() && vlx::isOpenExr(o.input))
        original = o.input;
    if (!original.empty() && (!o.band.empty() || o.krige.scale != 1 || !o.maxMemory.empty()))
        throw CLI::ValidationError(
            "--band, --scale and --max-memory go with --drop-layers or a dump, without --template");
    vlx::ImageWriteOptions write;
    write.attributes["Software"] = "vlx-krige";
    // Noise-free floats hardly compress: by a fifth, for a tenth of a draft's time.
    if (o.method == vlx::KrigeMethod::Krige && o.krige.quality == vlx::Quality::Draft)
        write.compression = "none";
    if (!o.samplingMap.empty() && !o.samplingMap.ends_with(".exr"))
        throw CLI::ValidationError("--sampling-map",
                                   "expected a name that ends with .exr, found '" + o.samplingMap + "'");
    const vlx::Fingerprint made = vlx::fingerprintOf(
        *o.commandLine, {"INPUT", "--template", "--variance", "--albedo", "--normal", "--depth"}, files);
    const std::string inputs = write.attributes[vlx::kInputsAttribute] = made.text(o.krige.band);
    std::vector<std::string> outputs = {o.image};
    if (!o.samplingMap.empty()) outputs.push_back(o.samplingMap);
    if (o.diagnostics) outputs.push_back(diagnosticsName);
    if (!o.overwrite && vlx::isFinished(outputs, inputs)) {
        if (o.opinion.assesses())
            printAssessment(o);
        else if (o.json)
            std::printf("{\"skipped\": true}\n");
        return;
    }
    for (const std::string& output : outputs)
        const vlx::OutputFile writable(output);  // found out now, not after the work
    const std::unique_ptr<vlx::SampleSource> source = openInput(o, flat);
    const bool usesPositions =
        o.method == vlx::KrigeMethod::Paper || o.krige.scale > 1 || o.filter != vlx::PixelFilter::Box;
    const vlx::PositionedSamples dump(*source, o.positions, usesPositions);
    vlx::Window picture = dump.header().data;
    picture = {picture.x * o.krige.scale, picture.y * o.krige.scale, picture.width * o.krige.scale,
               picture.height * o.krige.scale};
    for (const auto& [x, y] : o.paper.inspect)
        if (!picture.contains(x, y))
            throw CLI::ValidationError("--inspect", "expected a pixel of the picture, " + inWords(picture) +
                                                        ", found " + std::to_string(x) + "," +
                                                        std::to_string(y));
    const vlx::ChannelMap replaced =
        original.empty() ? vlx::ChannelMap() : replacedLayers(o, original, *source);
    vlx::LayerCopy copied;
    vlx::ReconstructionReport report;
    vlx::KrigeOptions withOpinion = o;
    withOpinion.krige.secondOpinion = o.opinion.read(o.input, flat, dump.header().data, o.threads);
    if (o.opinion.assesses()) return assessed(o, dump, withOpinion.krige, made, write, progress);
    const vlx::Method method = vlx::methodOf(withOpinion);
    if (original.empty() && !o.diagnostics && o.filter == vlx::PixelFilter::Box && o.samplingMap.empty()) {
        const vlx::Image outline = vlx::outline(dump, method);
        vlx::ImageWriter writer(o.image, outline.data, outline.display, outline.channels, write);
        const auto sink = [&](const float* rows, int count) { writer.write(rows, count); };
        report = shot ? shot->sequence().reconstruct(number, sink, progress)
                      : vlx::reconstruct(dump, method, sink, progress);
        made.checkUnchanged();
        writer.close();
    } else {
        vlx::Reconstruction result =
            shot ? shot->sequence().reconstruct(number, progress) : vlx::reconstruct(dump, method, progress);
        result.image = vlx::applyPixelFilter(result.image, o.filter);
        made.checkUnchanged();
        const vlx::Image map = o.samplingMap.empty() ? vlx::Image() : vlx::samplingMap(result.image);
        if (o.diagnostics) vlx::addDiagnosticLayers(result);
        // Both files or none: the image gets its name only when the JSON is complete.
        std::optional<vlx::OutputFile> diagnostics;
        if (o.diagnostics) diagnostics.emplace(diagnosticsName).write(vlx::toJson(result));
        if (original.empty())
            vlx::writeImage(o.image, result.image, write);
        else
            copied = vlx::copyWithLayers(original, o.image, withoutNewAlpha(result.image, replaced), replaced,
                                         {{vlx::kInputsAttribute, inputs}});
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

int run(vlx::KrigeOptions& o) {
    vlx::checkMethodOptions(o);
    vlx::checkOpinion(o);
    o.paper.colourDistance = !o.noColourDistance;
    if (o.wholeImage) o.paper.regionSize = 0;
    o.krige.standardFeatures = !o.noFeatures;
    if (!o.band.empty()) {
        o.krige.band = vlx::parseBand(o.band);
        if (o.filter != vlx::PixelFilter::Box)  // it reaches into the bands beside
            throw CLI::ValidationError("--band goes with --filter box");
        if (!o.samplingMap.empty())
            throw CLI::ValidationError(
                "--band goes without --sampling-map, whose mean is that of the picture");
        if (o.diagnostics)
            throw CLI::ValidationError("--band goes without --diagnostics, whose regions it would cut");
    }
    for (const std::string& text : o.inspect) o.paper.inspect.push_back(vlx::parsePixel(text));
    o.krige.inspect = o.paper.inspect;
    o.krige.diagnostics = o.diagnostics;
    if (!o.maxMemory.empty()) {
        if (o.filter != vlx::PixelFilter::Box || !o.samplingMap.empty() || o.diagnostics)
            throw CLI::ValidationError(
                "--max-memory goes with --filter box, without --sampling-map and --diagnostics");
        o.krige.maxMemory = vlx::parseMemory(o.maxMemory);
#ifdef __GLIBC__
        mallopt(M_MMAP_THRESHOLD, 1 << 20);  // what is done with is given back
#endif
    }
    const vlx::ThreadLimit limit(o.threads);
    vlx::ProgressBar bar("kriging");
    if (o.krige.temporal > 0 && o.frames.empty())
        throw CLI::ValidationError("--temporal goes with --frames: frames add to each other");
    if (o.krige.temporal > 0 && (o.opinion.any() || o.diagnostics))
        throw CLI::ValidationError(
            "--temporal goes without --denoised, --denoiser, --assess and --diagnostics");
    if (o.frames.empty()) {
        kriged(o, bar);
        return vlx::kDone;
    }
    vlx::requireFramePlace("INPUT", o.input);
    vlx::requireFramePlace("--output", o.image);
    if (!o.samplingMap.empty()) vlx::requireFramePlace("--sampling-map", o.samplingMap);
    Shot shot(o);
    vlx::forEachFrame(vlx::parseFrames(o.frames), bar, [&](int frame, const vlx::Progress& progress) {
        kriged(shot.frame(frame), progress, o.krige.temporal > 0 ? &shot : nullptr, frame);
    });
    return vlx::kDone;
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app(
        "Removes the noise of a path-traced image by kriging its samples, and says how accurate the result "
        "is.",
        "vlx-krige");
    vlx::KrigeOptions options;
    vlx::bindOptions(app, options);
    return vlx::runTool(argc, argv, app, [&] { return run(options); });
}
