#include "variolux/base/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "variolux/base/error.h"
#include "variolux/base/memory.h"
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

    // A small file cannot hold a huge image, whatever its header says. zlib makes at most 1032 bytes of one,
    // of an area of one colour lossy compressions many more.
    const bool exr = std::string_view(input->format_name()) == "openexr";
    const bool lossy = !exr || std::string(spec.get_string_attribute("compression")).starts_with("dwa");
    const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(path, status));
    const std::int64_t most = bytes * (lossy ? 1 << 16 : 1 << 11) + (1 << 20);
    if (values > most)
        throw Error(path, "truncated or damaged: its header claims " + std::to_string(values) +
                              " values, more than the file's " + std::to_string(bytes) + " bytes can hold");
    requireMemory(path, static_cast<std::uint64_t>(values) * sizeof(float), "an image held whole");

    Image image(Window{spec.x, spec.y, spec.width, spec.height}, spec.channelnames);
    image.display = Window{spec.full_x, spec.full_y, spec.full_width, spec.full_height};
    if (!input->read_image(part, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, image.pixels.data()))
        throw Error(
            path, "expected " + std::to_string(spec.height) + " whole rows: " + oiioError(input->geterror()));
    return image;
}

struct ImageWriter::Impl {
    OutputFile file;
    std::unique_ptr<OIIO::ImageOutput> output;
    OIIO::ImageSpec spec;
    bool exr = false;
    // OpenEXR notices a full disk. The libraries behind other formats do not: libpng's output is cut short
    // without a word, libjpeg ends the program. They write to memory, and the bytes are written here.
    OIIO::Filesystem::IOVecOutput memory = {};
    int nextRow = 0;

    [[noreturn]] void fail() const {
        throw Error(file.path(), "writing failed: " + oiioError(output->geterror()));
    }
};

ImageWriter::ImageWriter(const std::string& path, const Window& data, const Window& display,
                         const std::vector<std::string>& channels, const ImageWriteOptions& options)
    : impl_(new Impl{OutputFile(path), {}, {}}) {
    auto& output = impl_->output = OIIO::ImageOutput::create(impl_->file.temporaryPath());
    if (!output) throw Error(path, "expected an image format that can be written: " + oiioError({}));

    OIIO::ImageSpec& spec = impl_->spec;
    spec = OIIO::ImageSpec(data.width, data.height, static_cast<int>(channels.size()), OIIO::TypeDesc::FLOAT);
    if (std::string_view(output->format_name()) == "png") spec.format = OIIO::TypeDesc::UINT8;
    if (options.half) spec.format = OIIO::TypeDesc::HALF;
    spec.x = data.x;
    spec.y = data.y;
    spec.full_x = display.x;
    spec.full_y = display.y;
    spec.full_width = display.width;
    spec.full_height = display.height;
    spec.channelnames = channels;
    impl_->exr = std::string_view(output->format_name()) == "openexr";
    if (impl_->exr) spec.attribute("compression", options.compression);
    // Pixels arrive as they must be stored: no library-side colour conversion of 8-bit formats.
    spec.attribute("oiio:ColorSpace", spec.format == OIIO::TypeDesc::UINT8 ? "sRGB" : "Linear");
    for (const auto& [name, value] : options.attributes) spec.attribute(name, value);

    if (!impl_->exr && !output->set_ioproxy(&impl_->memory))
        throw Error(path, std::string("expected an image format that can be written, found ") +
                              output->format_name());
    if (!output->open(impl_->file.temporaryPath(), spec)) impl_->fail();
    impl_->nextRow = data.y;
}

ImageWriter::~ImageWriter() = default;

void ImageWriter::write(const float* rows, int count) {
    if (!impl_->output->write_scanlines(impl_->nextRow, impl_->nextRow + count, 0, OIIO::TypeDesc::FLOAT,
                                        rows))
        impl_->fail();
    impl_->nextRow += count;
}

void ImageWriter::close() {
    const int end = impl_->spec.y + impl_->spec.height;
    if (impl_->nextRow != end)
        throw Error(impl_->file.path(), "expected rows up to " + std::to_string(end) + ", found them up to " +
                                            std::to_string(impl_->nextRow));
    if (!impl_->output->close()) impl_->fail();
    if (!impl_->exr) {
        std::ofstream bytes(impl_->file.temporaryPath(), std::ios::binary);
        bytes.write(reinterpret_cast<const char*>(impl_->memory.buffer().data()),
                    static_cast<std::streamsize>(impl_->memory.buffer().size()));
        bytes.close();
        if (!bytes) throw Error(impl_->file.path(), "writing to disk failed");
    }
    impl_->file.commit();
}

void writeImage(const std::string& path, const Image& image, const ImageWriteOptions& options) {
    ImageWriter writer(path, image.data, image.display, image.channels, options);
    writer.write(image.pixels.data(), image.data.height);
    writer.close();
}

std::string readTextAttribute(const std::string& path, const std::string& name) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) return {};
    const auto input = OIIO::ImageInput::open(path);
    if (!input) {
        OIIO::geterror();  // which is no news: it is not to be found by the next one who asks
        return {};
    }
    return std::string(input->spec().get_string_attribute(name));
}

float linearToSrgb(float linear) {
    if (!(linear > 0.0f)) return 0.0f;
    if (linear >= 1.0f) return 1.0f;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

}  // namespace vlx
