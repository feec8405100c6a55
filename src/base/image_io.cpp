#include "variolux/base/image_io.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <half.h>
#include <openexr.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <type_traits>

#include "base/image_library.h"
#include "variolux/base/channel_names.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

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

bool isExr(const std::string& path) {
    std::array<unsigned char, 4> start{};
    std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(start.data()), start.size());
    return start == std::array<unsigned char, 4>{0x76, 0x2f, 0x31, 0x01};
}

/// Checks the sizes of the flat parts of an OpenEXR file by its headers alone: libraries take memory for the
/// tables that headers claim, or say no more than that the file ends. Returns what is wrong with the headers
/// themselves, or nothing, as of files of other formats.
std::string checkExrHeaders(const std::string& path) {
    if (!isExr(path)) return {};
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

/// An image at its first flat part, whose size was checked.
struct OpenedImage {
    std::unique_ptr<ImageInput> input;
    int part = 0;
};

OpenedImage openImage(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    const std::string fault = checkExrHeaders(path);
    std::string said;
    OpenedImage opened{imageLibrary().open(path, said)};
    if (!opened.input) throw Error(path, "expected an image: " + (fault.empty() ? said : fault));
    while (opened.input->info().deep)
        if (!opened.input->seek(++opened.part))
            throw Error(path, "expected a flat image, found only deep samples");

    const ImageInfo& info = opened.input->info();
    const Window& data = info.data;
    const auto channels = static_cast<int>(info.channels.size());
    if (data.width <= 0 || data.height <= 0 || channels <= 0 || info.depth > 1)
        throw Error(path, "expected a flat image with pixels and channels, found " +
                              std::to_string(data.width) + " x " + std::to_string(data.height) + " x " +
                              std::to_string(info.depth) + ", " + std::to_string(channels) + " channels");
    const bool lossy = info.format != "openexr" || info.text("compression").starts_with("dwa");
    checkSize(path, data.width, data.height, channels, lossy);
    return opened;
}

[[noreturn]] void failReading(const std::string& path, const Window& data, ImageInput& input) {
    throw Error(path, "expected " + std::to_string(data.height) + " whole rows: " + input.error());
}

/// A part of an image, and which of its channels are wanted.
struct WantedPart {
    int number;
    ImageInfo info;
    std::vector<std::pair<int, std::size_t>> channels;  ///< of the part; of the image that is made
};

/// By bands: what lies between the channels that are wanted is read, too.
void readPart(const std::string& path, ImageInput& input, const WantedPart& part, Image& image) {
    constexpr int kBandRows = 256;
    const bool tiled = part.info.tileHeight > 0;
    const int band = tiled ? part.info.tileHeight : kBandRows;
    const auto [first, last] = std::ranges::minmax_element(part.channels);
    const int begin = first->first, end = last->first + 1;
    const auto width = static_cast<std::size_t>(image.data.width),
               count = static_cast<std::size_t>(end - begin), made = image.channels.size();
    std::vector<float> rows;
    float* to = image.pixels.data();
    const int bottom = image.data.y + image.data.height;
    for (int y = image.data.y; y < bottom; y += band) {
        const int until = std::min(bottom, y + band);
        const std::size_t pixels = width * static_cast<std::size_t>(until - y);
        rows.resize(pixels * count);
        if (!(tiled ? input.readTileRows(part.number, y, until, begin, end, rows.data())
                    : input.readRows(part.number, y, until, begin, end, rows.data())))
            failReading(path, image.data, input);
        for (const auto& [channel, place] : part.channels)
            for (std::size_t p = 0; p < pixels; ++p)
                to[p * made + place] = rows[p * count + static_cast<std::size_t>(channel - begin)];
        to += pixels * made;
    }
}

}  // namespace

Image readImage(const std::string& path) {
    const OpenedImage opened = openImage(path);
    const ImageInfo& info = opened.input->info();
    requireMemory(path, imageBytes(info.data, info.channels.size()), "an image held whole");
    Image image(info.data, info.channels);
    image.display = info.display;
    if (!opened.input->readAll(opened.part, image.pixels.data()))
        failReading(path, image.data, *opened.input);
    return image;
}

Image readImage(const std::string& path, const ChannelChoice& choose) {
    const OpenedImage opened = openImage(path);
    std::vector<WantedPart> parts;
    std::vector<std::string> names;
    std::vector<std::pair<std::size_t, int>> places;  // of each name: part, channel
    for (int number = opened.part; opened.input->seek(number); ++number) {
        const ImageInfo& info = opened.input->info();
        if (number > opened.part && (info.deep || info.data != parts.front().info.data || info.depth > 1))
            continue;
        for (std::size_t c = 0; c < info.channels.size(); ++c) {
            std::string known = partChannel(number - opened.part, info.part, info.channels[c]);
            if (std::ranges::find(names, known) != names.end()) continue;
            names.push_back(std::move(known));
            places.emplace_back(parts.size(), static_cast<int>(c));
        }
        parts.push_back({number, info, {}});
    }
    const ImageInfo& info = parts.front().info;
    const std::vector<std::string> wanted = choose(names);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const auto found = std::ranges::find(names, wanted[i]);
        if (found == names.end())
            throw Error(path,
                        "expected a channel " + wanted[i] + ", found the layers " + listedLayers(names));
        const auto& [part, channel] = places[static_cast<std::size_t>(found - names.begin())];
        parts[part].channels.emplace_back(channel, i);
    }
    requireMemory(path, imageBytes(info.data, wanted.size()), "the channels of an image");
    Image image(info.data, wanted);
    image.display = info.display;
    for (const WantedPart& part : parts)
        if (!part.channels.empty()) readPart(path, *opened.input, part, image);
    return image;
}

namespace {

/// Of one file. Throws Error.
struct RowWriter {
    OutputFile file;
    Window data;
    int nextRow;

    RowWriter(const std::string& path, const Window& window) : file(path), data(window), nextRow(window.y) {}
    virtual ~RowWriter() = default;
    virtual void write(const float* rows, int count) = 0;
    virtual void finish() = 0;
    [[noreturn]] void fail(const std::string& why) const {
        throw Error(file.path(), "writing failed: " + why);
    }
};

Imf::Compression compressionOf(const std::string& path, const std::string& name) {
    static const std::map<std::string, Imf::Compression> known = {
        {"none", Imf::NO_COMPRESSION},  {"rle", Imf::RLE_COMPRESSION},   {"zips", Imf::ZIPS_COMPRESSION},
        {"zip", Imf::ZIP_COMPRESSION},  {"piz", Imf::PIZ_COMPRESSION},   {"pxr24", Imf::PXR24_COMPRESSION},
        {"b44", Imf::B44_COMPRESSION},  {"b44a", Imf::B44A_COMPRESSION}, {"dwaa", Imf::DWAA_COMPRESSION},
        {"dwab", Imf::DWAB_COMPRESSION}};
    const auto found = known.find(name);
    if (found == known.end()) throw Error(path, "expected a compression of OpenEXR, found '" + name + "'");
    return found->second;
}

// Images of noise: higher levels find little, and take longer.
constexpr int kZipLevel = 2;

struct ExrWriter : RowWriter {
    std::vector<std::string> channels;
    bool half;
    std::vector<::half> halves;
    std::unique_ptr<Imf::OutputFile> output;

    ExrWriter(const std::string& path, const Window& window, const Window& display,
              const std::vector<std::string>& names, const ImageWriteOptions& options)
        : RowWriter(path, window), channels(names), half(options.half) {
        const auto box = [](const Window& w) {
            return Imath::Box2i({w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1});
        };
        Imf::Header header(box(display), box(window));
        header.compression() = compressionOf(path, options.compression);
        header.zipCompressionLevel() = kZipLevel;
        for (const std::string& name : names)
            header.channels().insert(name, Imf::Channel(half ? Imf::HALF : Imf::FLOAT));
        for (const auto& [name, value] : options.attributes) header.insert(name, Imf::StringAttribute(value));
        if (Imf::globalThreadCount() < threadCount()) Imf::setGlobalThreadCount(threadCount());
        attempt([&] { output = std::make_unique<Imf::OutputFile>(file.temporaryPath().c_str(), header); });
    }

    template <class F>
    void attempt(F f) {
        try {
            f();
        } catch (const Error&) {
            throw;
        } catch (const std::exception& error) {
            fail(error.what());
        }
    }

    void write(const float* rows, int count) override {
        const std::size_t each = half ? sizeof(::half) : sizeof(float);
        const std::size_t stride = each * channels.size(),
                          row = stride * static_cast<std::size_t>(data.width);
        auto* values = reinterpret_cast<char*>(const_cast<float*>(rows));
        if (half) {
            halves.assign(rows, rows + row / each * static_cast<std::size_t>(count));
            values = reinterpret_cast<char*>(halves.data());
        }
        Imf::FrameBuffer buffer;
        for (std::size_t c = 0; c < channels.size(); ++c)
            buffer.insert(channels[c],
                          Imf::Slice::Make(half ? Imf::HALF : Imf::FLOAT, values + c * each,
                                           Imath::V2i(data.x, nextRow), data.width, count, stride, row));
        attempt([&] {
            output->setFrameBuffer(buffer);
            output->writePixels(count);
        });
    }

    void finish() override {
        attempt([&] { output.reset(); });
    }
};

/// Other formats, by OpenImageIO. The libraries behind them do not notice a full disk: libpng's output is cut
/// short without a word, libjpeg ends the program. They write to memory, and the bytes are written here.
struct OtherWriter : RowWriter {
    std::unique_ptr<ImageOutput> output;

    OtherWriter(const std::string& path, const Window& window, const Window& display,
                const std::vector<std::string>& names, const ImageWriteOptions& options)
        : RowWriter(path, window) {
        std::string fault;
        output = imageLibrary().create(file.temporaryPath(), fault);
        if (!output) throw Error(path, "expected an image format that can be written: " + fault);
        if (!output->toMemory())
            throw Error(path, "expected an image format that can be written, found " + output->format());
        if (!output->open(file.temporaryPath(), {window, display, names, options.half, options.attributes}))
            fail(output->error());
    }
    void write(const float* rows, int count) override {
        if (!output->write(nextRow, nextRow + count, rows)) fail(output->error());
    }
    void finish() override {
        if (!output->close()) fail(output->error());
        file.write({reinterpret_cast<const char*>(output->memory().data()), output->memory().size()});
    }
};

}  // namespace

struct ImageWriter::Impl {
    std::unique_ptr<RowWriter> rows;
};

ImageWriter::ImageWriter(const std::string& path, const Window& data, const Window& display,
                         const std::vector<std::string>& channels, const ImageWriteOptions& options)
    : impl_(new Impl) {
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".exr" || extension == ".sxr" || extension == ".mxr")  // OpenEXR's names
        impl_->rows = std::make_unique<ExrWriter>(path, data, display, channels, options);
    else
        impl_->rows = std::make_unique<OtherWriter>(path, data, display, channels, options);
}

ImageWriter::~ImageWriter() = default;

void ImageWriter::write(const float* rows, int count) {
    impl_->rows->write(rows, count);
    impl_->rows->nextRow += count;
}

void ImageWriter::close() {
    RowWriter& writer = *impl_->rows;
    const int end = writer.data.y + writer.data.height;
    if (writer.nextRow != end)
        throw Error(writer.file.path(), "expected rows up to " + std::to_string(end) + ", found them up to " +
                                            std::to_string(writer.nextRow));
    writer.finish();
    writer.file.commit();
}

void writeImage(const std::string& path, const Image& image, const ImageWriteOptions& options) {
    ImageWriter writer(path, image.data, image.display, image.channels, options);
    writer.write(image.pixels.data(), image.data.height);
    writer.close();
}

std::string readTextAttribute(const std::string& path, const std::string& name) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(path, ignored)) return {};
    if (isExr(path)) {
        try {
            const Imf::MultiPartInputFile file(path.c_str(), 0, false);
            const auto* found = file.header(0).findTypedAttribute<Imf::StringAttribute>(name);
            return found != nullptr ? found->value() : std::string();
        } catch (const std::exception&) {  // not whole
            return {};
        }
    }
    std::string fault;
    const auto input = imageLibrary().open(path, fault);
    return input ? input->info().text(name) : std::string();
}

float linearToSrgb(float linear) {
    if (!(linear > 0.0f)) return 0.0f;
    if (linear >= 1.0f) return 1.0f;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

}  // namespace vlx
