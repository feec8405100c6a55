#include "sequence/sequence_page.h"

#include <algorithm>
#include <cmath>

#include "page/page.h"

namespace vlx {

extern const PageSources kSequencePage;

namespace {

using Json = nlohmann::ordered_json;

// Values of all images in a page, of which each takes some three bytes in the file and four to eight in the
// browser.
constexpr double kMostValues = 24e6;

}  // namespace

SequencePage::SequencePage(const Window& window, std::size_t frames, std::size_t images)
    : factor_(pageImageFactor(window)), images_(images, Json::array()) {
    const double values = 3.0 * static_cast<double>(frames * images) * static_cast<double>(window.pixels());
    const double fitting = std::ceil(std::sqrt(values / kMostValues));
    const int most = std::min(window.width, window.height);  // a pixel must be left
    factor_ = static_cast<int>(
        std::clamp(fitting, static_cast<double>(std::min(factor_, most)), static_cast<double>(most)));
}

void SequencePage::add(const std::vector<Image>& images) {
    for (std::size_t i = 0; i < images.size(); ++i) images_[i].push_back(pageImage(images[i], factor_));
}

std::string SequencePage::html(const SequenceReport& report) const {
    Json data = {{"reference", report.reference},
                 {"motion", !report.motion.empty()},
                 {"width", report.window.width},
                 {"height", report.window.height},
                 {"tile", kSequenceTile},
                 {"frames", report.frames},
                 {"referenceImages", images_.front()},
                 {"sequences", Json::array()}};
    for (std::size_t i = 0; i < report.sequences.size(); ++i) {
        const SequenceErrors& errors = report.sequences[i].errors;
        Json series = Json::object();
        for (const char* name : {"relMse", "flicker", "flickerAlongMotion"}) series[name] = Json::array();
        for (const SequenceFrame& frame : errors.frames) {
            series["relMse"].push_back(numberJson(frame.comparison[Metric::RelMse]));
            series["flicker"].push_back(numberJson(frame.flicker));
            series["flickerAlongMotion"].push_back(numberJson(frame.flickerAlongMotion));
        }
        data["sequences"].push_back({{"name", report.sequences[i].name},
                                     {"path", report.sequences[i].path},
                                     {"relMse", intervalJson(errors.relMse)},
                                     {"flicker", intervalJson(errors.flicker)},
                                     {"flickerAlongMotion", intervalJson(errors.flickerAlongMotion)},
                                     {"series", std::move(series)},
                                     {"images", images_[i + 1]}});
    }
    const std::size_t slash = report.reference.find_last_of('/');
    return pageOf(kSequencePage, report.reference.substr(slash == std::string::npos ? 0 : slash + 1), data);
}

}  // namespace vlx
