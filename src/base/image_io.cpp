#include "variolux/base/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <openexr.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <type_traits>

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

/// Throws Error when an image is larger than this program takes, or than the file can hold: a small file
/// holds no huge image, whatever its header says. zlib makes at most 1032 bytes of one, of an area of one
/// colour lossy compressions many more.
void checkSize(const std::string& path, int width, int height, int channels, bool lossy) {
    const double values = static_cast<double>(width) * height * channels;
    const auto bytes = static_cast<double>(std::filesystem::file_size(path));
    const std::string found = std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
                              std::to_string(channels) + " channels";
    if (values > bytes * (lossy ? 1 << 16 : 1 << 11) + (1 << 20))
        throw Error(path, "truncated or damaged: its header claims " + found + ", more than the file's " +
                              std::to_string(std::filesystem::file_size(path)) + " bytes can hold");
    if (values > std::numeric_limits<std::int32_t>::max())
        throw Error(path, "expected at most 2^31 values, found " + found);
}

/// Checks the sizes of the flat parts of an OpenEXR file by its headers alone: libraries take memory for the
/// tables that headers claim, or say no more than that the file ends. Returns what is wrong with the headers
/// themselves, or nothing, as of files of other formats.
std::string checkExrHeaders(const std::string& path) {
    std::array<unsigned char, 4> start{};
    std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(start.data()), start.size());
    if (start != std::array<unsigned char, 4>{0x76, 0x2f, 0x31, 0x01}) return {};

    std::string fault;
    exr_context_initializer_t how = EXR_DEFAULT_CONTEXT_INITIALIZER;
    how.user_data = &fault;
    how.error_handler_fn = [](exr_const_context_t file, exr_result_t, const char* message) {
        void* text = nullptr;
        exr_get_user_data(file, &text);
        if (text != nullptr) *static_cast<std::string*>(text) = message;
    };
    exr_context_t opened = nullptr;
    if (exr_start_read(&opened, path.c_str(), &how) != EXR_ERR_SUCCESS) return fault;
    const auto close = [](exr_context_t file) { exr_finish(&file); };
    const std::unique_ptr<std::remove_pointer_t<exr_context_t>, decltype(close)> file(opened, close);
    int parts = 0;
    exr_get_count(file.get(), &parts);
    for (int part = 0; part < parts; ++part) {
        exr_storage_t storage{};
        exr_compression_t compression{};
        exr_attr_box2i_t window{};
        const exr_attr_chlist_t* channels = nullptr;
        if (exr_get_storage(file.get(), part, &storage) != EXR_ERR_SUCCESS ||
            exr_get_compression(file.get(), part, &compression) != EXR_ERR_SUCCESS ||
            exr_get_data_window(file.get(), part, &window) != EXR_ERR_SUCCESS ||
            exr_get_channels(file.get(), part, &channels) != EXR_ERR_SUCCESS)
            return fault;
        if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) continue;
        // Windows lie within 2^30 of 0, which was checked.
        checkSize(path, window.max.x - window.min.x + 1, window.max.y - window.min.y + 1,
                  channels->num_channels, compression >= EXR_COMPRESSION_DWAA);
    }
    return {};
}

}  // namespace

Image readImage(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    const std::string fault = checkExrHeaders(path);
    const auto input = OIIO::ImageInput::open(path);
    if (!input) {
        const std::string said = oiioError({});
        throw Error(path, "expected an image: " + (fault.empty() ? said : fault));
    }
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
    const bool exr = std::string_view(input->format_name()) == "openexr";
    const bool lossy = !exr || std::string(spec.get_string_attribute("compression")).starts_with("dwa");
    checkSize(path, spec.width, spec.height, spec.nchannels, lossy);
    requireMemory(path, imageBytes(Window{0, 0, spec.width, spec.height}, spec.channelnames.size()),
                  "an image held whole");

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
