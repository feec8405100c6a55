#include "edit/merge_flat.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "exr/flat_header.h"
#include "exr/flat_images.h"
#include "exr/part_layout.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/output_file.h"

namespace vlx {

namespace {

constexpr int kBandRows = 16;
// Bytes of a band of rows.
constexpr std::uint64_t kMaxBandBytes = std::uint64_t{1} << 31;

std::string reason(std::string own) {
    if (own.empty()) own = OIIO::geterror();
    while (!own.empty() && own.back() == '\n') own.pop_back();
    return own.empty() ? "unknown reason" : own;
}

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    checkFlatHeader(path);
    auto input = OIIO::ImageInput::open(path);
    if (!input) throw Error(path, "expected an image: " + reason({}));
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1 || spec.tile_width > 0)
        throw Error(path, "expected an image of scanlines");
    return input;
}

Window dataWindow(const OIIO::ImageSpec& spec) { return {spec.x, spec.y, spec.width, spec.height}; }
Window displayWindow(const OIIO::ImageSpec& spec) {
    return {spec.full_x, spec.full_y, spec.full_width, spec.full_height};
}

void checkSamePicture(const std::string& firstPath, const OIIO::ImageSpec& first, const std::string& path,
                      const OIIO::ImageSpec& spec) {
    const auto check = [&](const char* what, const std::string& expected, const std::string& found) {
        if (expected != found)
            throw Error(path, std::string("expected ") + what + " " + expected + " as in " + firstPath +
                                  ", found " + found + ": not parts of one picture");
    };
    check("a picture of", windowText(displayWindow(first)), windowText(displayWindow(spec)));
    check("channels", listed(first.channelnames), listed(spec.channelnames));
    const auto types = [](const OIIO::ImageSpec& s) {
        std::string all;
        for (int c = 0; c < s.nchannels; ++c)
            all += (c > 0 ? ", " : "") + std::string(s.channelformat(c).c_str());
        return all;
    };
    check("channels of types", types(first), types(spec));
}

}  // namespace

std::string flatInputs(const std::string& path) {
    return std::string(open(path)->spec().get_string_attribute(kInputsAttribute));
}

MergeReport mergeFlat(const std::vector<std::string>& paths, const std::string& output,
                      const MergeOptions& options, const Progress& progress) {
    OIIO::ImageSpec spec = open(paths.front())->spec();
    std::vector<PicturePart> parts;
    for (const auto& path : paths) {
        const OIIO::ImageSpec part = open(path)->spec();
        checkSamePicture(paths.front(), spec, path, part);
        parts.push_back({path, dataWindow(part)});
    }
    const Window whole = options.crop ? boundsOf(parts) : displayWindow(spec);
    arrangeParts(parts, whole, output);
    spec.x = whole.x;
    spec.y = whole.y;
    spec.width = whole.width;
    spec.height = whole.height;
    spec.erase_attribute(kInputsAttribute);
    if (!options.inputs.empty()) spec.attribute(kInputsAttribute, options.inputs);
    const std::uint64_t pixelBytes = spec.pixel_bytes(true);
    const std::uint64_t rowBytes = pixelBytes * static_cast<std::uint64_t>(whole.width);
    if (rowBytes * kBandRows > kMaxBandBytes)
        throw Error(output, "expected rows of at most 2^27 bytes, found " + std::to_string(rowBytes));

    OutputFile file(output);
    const auto out = OIIO::ImageOutput::create(file.temporaryPath());
    if (!out || !out->open(file.temporaryPath(), spec))
        throw Error(output, "writing failed: " + reason(out ? out->geterror() : std::string()));
    std::map<std::string, std::unique_ptr<OIIO::ImageInput>> inputs;  // only the files of the rows at work
    std::vector<unsigned char> band, piece;
    for (int row = 0; row < whole.height;) {
        const int y = whole.y + row;
        const int rows = std::min(kBandRows, whole.height - row);
        band.assign(rowBytes * static_cast<std::uint64_t>(rows), 0);
        for (const PicturePart& part : parts) {
            const int begin = std::max(y, part.data.y);
            const int end = std::min(y + rows, part.data.y + part.data.height);
            if (begin >= end) {
                inputs.erase(part.path);
                continue;
            }
            auto& input = inputs[part.path];
            if (!input) input = open(part.path);
            if (dataWindow(input->spec()) != part.data || input->spec().pixel_bytes(true) != pixelBytes)
                throw Error(part.path, "changed while it was read");
            const std::uint64_t bytes = pixelBytes * static_cast<std::uint64_t>(part.data.width);
            piece.resize(bytes * static_cast<std::uint64_t>(end - begin));
            if (!input->read_native_scanlines(0, 0, begin, end, 0, piece.data()))
                throw Error(part.path, "rows " + std::to_string(begin) + " to " + std::to_string(end - 1) +
                                           ": " + reason(input->geterror()));
            for (int r = begin; r < end; ++r)
                std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(bytes) * (r - begin), bytes,
                            band.begin() + static_cast<std::ptrdiff_t>(rowBytes) * (r - y) +
                                static_cast<std::ptrdiff_t>(pixelBytes) * (part.data.x - whole.x));
        }
        if (!out->write_scanlines(y, y + rows, 0, OIIO::TypeDesc::UNKNOWN, band.data()))
            throw Error(output, "writing failed: " + reason(out->geterror()));
        row += rows;
        if (progress) progress(row, whole.height);
    }
    if (!out->close()) throw Error(output, "writing failed: " + reason(out->geterror()));
    file.commit();
    return {whole, false};
}

}  // namespace vlx
