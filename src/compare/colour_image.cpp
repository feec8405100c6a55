#include "variolux/compare/colour_image.h"

#include <algorithm>

#include "variolux/base/error.h"
#include "variolux/base/image_io.h"

namespace vlx {

namespace {

Image threeOf(const Image& image, const ChannelTriple& channels) {
    Image three = image.select({channels.begin(), channels.end()});
    three.channels = {"R", "G", "B"};
    return three;
}

}  // namespace

ColourImage readColour(const std::string& path, const std::string& layer, bool withStddev) {
    ColourImage read;
    std::optional<ChannelTriple> error;
    const Image image = readImage(path, [&](const std::vector<std::string>& names) {
        std::optional<ChannelTriple> colour = findColour(names, layer);
        read.layerFound = !layer.empty() && colour;
        if (!colour) colour = findColour(names);
        if (!colour && names.size() == 1) colour = ChannelTriple{names[0], names[0], names[0]};
        if (!colour)
            throw Error(path,
                        "expected channels R, G, B, a layer that renderers keep their picture in, or a "
                        "grey image" +
                            (layer.empty() ? std::string() : ", or a layer " + layer) +
                            " (--layer NAME names one), found the layers " + listedLayers(names));
        read.channels = *colour;
        read.present = names;
        if (withStddev) error = findError(names, colour->front());
        std::vector<std::string> wanted(colour->begin(), colour->end());
        if (error) wanted.insert(wanted.end(), error->begin(), error->end());
        std::ranges::sort(wanted);
        wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
        return wanted;
    });
    read.colour = threeOf(image, read.channels);
    if (error) read.stddev = threeOf(image, *error);
    return read;
}

void LayerSearch::add(const ColourImage& image) {
    found_ = found_ || image.layerFound;
    if (!layer_.empty() && !found_)
        present_.insert(present_.end(), image.present.begin(), image.present.end());
}

void LayerSearch::check() const {
    if (!layer_.empty() && !found_)
        throw Error(layer_, "expected a layer of this name in at least one file, found the layers " +
                                listedLayers(present_));
}

}  // namespace vlx
