#include "variolux/base/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "variolux/base/error.h"
#include "variolux/base/output_file.h"

namespace vlx {

namespace {

std::string oiioError(const std::string& own) {
    std::string text = own.empty() ? OIIO::geterror() : own;
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text.empty() ? "unknown reason" : text;
}

}  // namespace

Image readImage(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    const auto input = OIIO::ImageInput::open(path);
    if (!input) throw Error(path, "expected an image: " + oiioError({}));
    int part = 0;
    while (input->spec().deep)
        if (!input->seek_subimage(++part, 0))
            throw Error(path, "expected a flat image, found only deep samples");

    const OIIO::ImageSpec spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1)
        throw Error(path, "expected a flat image with pixels and channels, found " +
                              std::to_string(spec.width) + " x " + std::to_string(spec.height) + " x " +
                              std::to_string(spec.depth) + ", " + std::to_string(spec.nchannels) +
                              " channels");
    const auto values = static_cast<std::int64_t>(spec.image_pixels()) * spec.nchannels;
    if (values > std::numeric_limits<std::int32_t>::max())
        throw Error(path, "expected at most 2^31 values, found " + std::to_string(values));

    Image image(Window{spec.x, spec.y, spec.width, spec.height}, spec.channelnames);
    image.display = Window{spec.full_x, spec.full_y, spec.full_width, spec.full_height};
    if (!input->read_image(part, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data()))
        throw Error(
            path, "expected " + std::to_string(spec.height) + " whole rows: " + oiioError(input->geterror()));
    return image;
}

void writeImage(const std::string& path, const Image& image, const ImageWriteOptions& options) {
    OutputFile file(path);
    const auto output = OIIO::ImageOutput::create(file.temporaryPath());
    if (!output) throw Error(path, "expected an image format that can be written: " + oiioError({}));

    OIIO::ImageSpec spec(image.data.width, image.data.height, image.channelCount(), OIIO::TypeDesc::FLOAT);
    if (std::string_view(output->format_name()) == "png") spec.format = OIIO::TypeDesc::UINT8;
    if (options.half) spec.format = OIIO::TypeDesc::HALF;
    spec.x = image.data.x;
    spec.y = image.data.y;
    spec.full_x = image.display.x;
    spec.full_y = image.display.y;
    spec.full_width = image.display.width;
    spec.full_height = image.display.height;
    spec.channelnames = image.channels;
    const bool exr = std::string_view(output->format_name()) == "openexr";
    if (exr) spec.attribute("compression", options.compression);
    // Pixels arrive as they must be stored: no library-side colour conversion of 8-bit formats.
    spec.attribute("oiio:ColorSpace", spec.format == OIIO::TypeDesc::UINT8 ? "sRGB" : "Linear");
    for (const auto& [name, value] : options.attributes) spec.attribute(name, value);

    // OpenEXR notices a full disk. The libraries behind other formats do not: libpng's output is cut short
    // without a word, libjpeg ends the program. They write to memory, and the bytes are written here.
    OIIO::Filesystem::IOVecOutput memory;
    if (!exr && !output->set_ioproxy(&memory))
        throw Error(path, std::string("expected an image format that can be written, found ") +
                              output->format_name());
    if (!output->open(file.temporaryPath(), spec) ||
        !output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) || !output->close())
        throw Error(path, "writing failed: " + oiioError(output->geterror()));
    if (!exr) {
        std::ofstream bytes(file.temporaryPath(), std::ios::binary);
        bytes.write(reinterpret_cast<const char*>(memory.buffer().data()),
                    static_cast<std::streamsize>(memory.buffer().size()));
        bytes.close();
        if (!bytes) throw Error(path, "writing to disk failed");
    }
    file.commit();
}

float linearToSrgb(float linear) {
    if (!(linear > 0.0f)) return 0.0f;
    if (linear >= 1.0f) return 1.0f;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

}  // namespace vlx
