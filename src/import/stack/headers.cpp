#include "import/stack/headers.h"

#include <charconv>

namespace vlx {

namespace {

std::string samplesAttribute(const std::string& layer) { return "cycles." + layer + "samples"; }

}  // namespace

std::vector<double> samplesOfImages(const FlatImages& images, const std::string& layer) {
    std::vector<double> samples;
    for (std::size_t i = 0; i < images.size(); ++i) {
        const std::string text = images.text(i, samplesAttribute(layer));
        double found = 0;
        const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), found);
        if (text.empty() || status != std::errc() || end != text.data() + text.size())
            found = images.number(i, "samplesPerPixel").value_or(0);
        samples.push_back(found >= 1 && found < 1e9 ? found : 0);
    }
    return samples;
}

std::string rendererOf(const FlatImages& images, const std::string& layer) {
    const std::string software = images.text(0, "Software");
    if (!software.empty()) return software;
    return images.text(0, samplesAttribute(layer)).empty() ? "" : "Blender Cycles";
}

}  // namespace vlx
