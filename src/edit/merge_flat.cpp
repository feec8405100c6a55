#include "edit/merge_flat.h"

#include <algorithm>
#include <map>
#include <memory>

#include "base/image_library.h"
#include "edit/band_rows.h"
#include "exr/flat_images.h"
#include "exr/part_layout.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/output_file.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

// Bytes of a band of rows.
constexpr std::uint64_t kMaxBandBytes = std::uint64_t{1} << 31;

std::unique_ptr<ImageInput> open(const std::string& path) {
    auto input = openFlat(path);
    if (input->info().tileWidth > 0) throw Error(path, "expected an image of scanlines");
    return input;
}

void checkSamePicture(const std::string& firstPath, const ImageInfo& first, const std::string& path,
                      const ImageInfo& info) {
    const auto check = [&](const char* what, const std::string& expected, const std::string& found) {
        if (expected != found)
            throw Error(path, std::string("expected ") + what + " " + expected + " as in " + firstPath +
                                  ", found " + found + ": not parts of one picture");
    };
    check("a picture of", windowText(first.display), windowText(info.display));
    check("channels", listed(first.channels), listed(info.channels));
    check("channels of types", listed(first.types), listed(info.types));
}

}  // namespace

std::string flatInputs(const std::string& path) { return open(path)->info().text(kInputsAttribute); }

MergeReport mergeFlat(const std::vector<std::string>& paths, const std::string& output,
                      const MergeOptions& options, const Progress& progress) {
    const std::unique_ptr<ImageInput> first = open(paths.front());
    const ImageInfo& info = first->info();
    std::vector<PicturePart> parts;
    for (const auto& path : paths) {
        const std::unique_ptr<ImageInput> part = open(path);
        checkSamePicture(paths.front(), info, path, part->info());
        parts.push_back({path, part->info().data});
    }
    const Window whole = options.crop ? boundsOf(parts) : info.display;
    arrangeParts(parts, whole, output);
    const std::uint64_t pixelBytes = info.pixelBytes;
    const std::uint64_t rowBytes = pixelBytes * static_cast<std::uint64_t>(whole.width);
    if (rowBytes * kBandRows > kMaxBandBytes)
        throw Error(output, "expected rows of at most 2^27 bytes, found " + std::to_string(rowBytes));

    OutputFile file(output);
    std::string fault;
    const auto out = imageLibrary().create(file.temporaryPath(), fault);
    if (!out || !out->openLike(file.temporaryPath(), *first, whole, options.inputs))
        throw Error(output, "writing failed: " + (out ? out->error() : fault));
    std::map<std::string, std::unique_ptr<ImageInput>> inputs;  // only the files of the rows at work
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
            if (input->info().data != part.data || input->info().pixelBytes != pixelBytes)
                throw Error(part.path, "changed while it was read");
            const std::uint64_t bytes = pixelBytes * static_cast<std::uint64_t>(part.data.width);
            piece.resize(bytes * static_cast<std::uint64_t>(end - begin));
            if (!input->readStored(begin, end, piece.data()))
                throw Error(part.path, "rows " + std::to_string(begin) + " to " + std::to_string(end - 1) +
                                           ": " + input->error());
            for (int r = begin; r < end; ++r)
                std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(bytes) * (r - begin), bytes,
                            band.begin() + static_cast<std::ptrdiff_t>(rowBytes) * (r - y) +
                                static_cast<std::ptrdiff_t>(pixelBytes) * (part.data.x - whole.x));
        }
        if (!out->writeStored(y, y + rows, band.data()))
            throw Error(output, "writing failed: " + out->error());
        row += rows;
        if (progress) progress(row, whole.height);
    }
    if (!out->close()) throw Error(output, "writing failed: " + out->error());
    file.commit();
    return {whole, false};
}

}  // namespace vlx
