#include "opinion/opinion_options.h"

#include <filesystem>

#include "frames.h"
#include "opinion/denoiser.h"
#include "variolux/base/channel_names.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"

namespace vlx {

namespace {

struct FileLayer {
    std::string file, layer;
};

/// FILE, or FILE:LAYER where there is no file of the whole name.
FileLayer splitLayer(const std::string& name) {
    const std::size_t colon = name.rfind(':');
    if (colon == std::string::npos || std::filesystem::exists(name)) return {name, ""};
    return {name.substr(0, colon), name.substr(colon + 1)};
}

/// EVEN,ODD, at the comma that leaves names of files on both sides, else at the first.
std::vector<std::string> halvesOf(const char* option, const std::string& both) {
    std::vector<std::string> halves;
    for (std::size_t comma = both.find(','); comma != std::string::npos; comma = both.find(',', comma + 1)) {
        const std::string even = both.substr(0, comma), odd = both.substr(comma + 1);
        if (even.empty() || odd.empty()) continue;
        const bool found =
            std::filesystem::exists(splitLayer(even).file) && std::filesystem::exists(splitLayer(odd).file);
        if (found || halves.empty()) halves = {even, odd};
        if (found) return halves;
    }
    if (halves.empty() || halves[1].find(',') != std::string::npos)
        throw CLI::ValidationError(option, "expected two images, EVEN,ODD, found '" + both + "'");
    return halves;
}

/// What is given: images to be combined or to be judged.
struct GivenImages {
    std::string whole;
    std::vector<std::string> halves;
};

GivenImages givenImages(const OpinionOptions& o) {
    GivenImages given{o.assesses() ? o.assessed : o.denoised, {}};
    if (o.assesses() ? !o.assessedHalves.empty() : !o.halves.empty())
        given.halves = o.assesses() ? halvesOf("--assess-halves", o.assessedHalves)
                                    : halvesOf("--denoised-halves", o.halves);
    return given;
}

Image imageOf(const std::string& name, const Window& window) {
    const FileLayer of = splitLayer(name);
    Image image = readImage(of.file, [&](const std::vector<std::string>& names) {
        const auto colour = findColour(names, of.layer);
        if (!colour || colour->front() == colour->back())
            throw Error(of.file,
                        (of.layer.empty() ? std::string("expected channels R, G and B of another denoiser "
                                                        "(FILE:LAYER names a layer)")
                                          : "expected a layer '" + of.layer + "' of R, G and B") +
                            ", found the layers " + listedLayers(names));
        return std::vector<std::string>(colour->begin(), colour->end());
    });
    image.channels = {"R", "G", "B"};
    return checkedOpinion(std::move(image), of.file, window);
}

}  // namespace

void OpinionOptions::bind(CLI::App& app) {
    const CLI::Validator filled(
        [](std::string& text) {
            return text.empty() ? "expected a value, found an empty one" : std::string();
        },
        "");
    auto* given =
        app.add_option("--denoised", denoised,
                       "krige: combine the estimate with this image, which another denoiser made of the "
                       "same samples: R, G, B of a file (of Blender's, Combined), or a layer of it. What "
                       "samples show to be "
                       "wrong in it does not count")
            ->option_text("IMAGE[:LAYER]")
            ->check(filled);
    app.add_option("--denoised-halves", halves,
                   "Its images of the samples of even and of odd number (of even and odd replicates) alone, "
                   "as vlx-pack halves writes them: how much either image weighs is then found on samples "
                   "that it has not seen")
        ->option_text("EVEN,ODD")
        ->check(filled)
        ->needs(given);
    app.add_option("--denoiser", denoiser,
                   "krige: have a program make the three images: a command, run without a shell, in which "
                   "{color}, {albedo}, {normal} stand for PFM files to read and {output} for the one to "
                   "write, {threads} for --threads; oidn is Open Image Denoise's own oidnDenoise, features "
                   "cleaned first")
        ->option_text("COMMAND")
        ->check(filled)
        ->excludes(given);
    auto* judged =
        app.add_option("--assess", assessed,
                       "krige: judge this image, which another denoiser made of the same samples, without a "
                       "reference: its relMSE is printed with a 95 % interval, and OUTPUT gets its error map "
                       "instead of an image (layers stddev; bias, what it is too bright by within 7 to 15 "
                       "pixels, where that is significant; confidence, the chance that what samples around "
                       "show is noise: below 0.001 they refute it). Without --assess-halves none is found "
                       "better than the kriging")
            ->option_text("IMAGE[:LAYER]")
            ->check(filled)
            ->excludes(given)
            ->excludes("--denoiser");
    app.add_option("--assess-halves", assessedHalves,
                   "Its images of the samples of even and of odd number alone, as for --denoised-halves: how "
                   "far it is better than the kriging, and a narrower interval")
        ->option_text("EVEN,ODD")
        ->check(filled)
        ->needs(judged);
}

std::vector<std::string> OpinionOptions::files() const {
    std::vector<std::string> result;
    const GivenImages given = givenImages(*this);
    if (!given.whole.empty()) result.push_back(splitLayer(given.whole).file);
    for (const std::string& half : given.halves) result.push_back(splitLayer(half).file);
    if (!denoiser.empty()) {
        const std::vector<std::string> programs = denoiserFiles(denoiser);
        result.insert(result.end(), programs.begin(), programs.end());
    }
    return result;
}

void OpinionOptions::check() const {
    givenImages(*this);
    try {
        if (!denoiser.empty()) checkDenoiser(denoiser);
    } catch (const Error& e) {
        throw CLI::ValidationError("--denoiser", e.what());
    }
}

OpinionOptions OpinionOptions::ofFrame(int frame) const {
    OpinionOptions one = *this;
    for (std::string* names : {&one.denoised, &one.halves, &one.assessed, &one.assessedHalves})
        *names = frameName(*names, frame);
    return one;
}

std::shared_ptr<const SecondOpinion> OpinionOptions::read(const std::string& input, bool flat,
                                                          const Window& window, int threads) const {
    if (!any()) return nullptr;
    const GivenImages given = givenImages(*this);
    if (flat && (!given.halves.empty() || !denoiser.empty()))
        throw CLI::ValidationError(
            "--denoised-halves, --assess-halves and --denoiser go with a dump: a flat image has no samples "
            "to halve");
    if (!denoiser.empty()) return std::make_shared<SecondOpinion>(denoise(denoiser, input, window, threads));
    SecondOpinion opinion{imageOf(given.whole, window), {}};
    if (!given.halves.empty())
        opinion.halves = {imageOf(given.halves[0], window), imageOf(given.halves[1], window)};
    return std::make_shared<SecondOpinion>(std::move(opinion));
}

}  // namespace vlx
