// The module that image_library.h speaks of.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cctype>

#include "base/image_library.h"

namespace vlx {

namespace {

/// Of the object that failed, or of the thread where there is none.
std::string reason(std::string own) {
    if (own.empty()) own = OIIO::geterror();
    while (!own.empty() && own.back() == '\n') own.pop_back();
    return own.empty() ? "unknown reason" : own;
}

ImageInfo infoOf(const OIIO::ImageSpec& spec, const char* format) {
    ImageInfo info;
    info.data = {spec.x, spec.y, spec.width, spec.height};
    info.display = {spec.full_x, spec.full_y, spec.full_width, spec.full_height};
    info.depth = spec.depth;
    info.tileWidth = spec.tile_width;
    info.tileHeight = spec.tile_height;
    info.deep = spec.deep;
    info.bytes = spec.format.basesize() == 1;
    info.pixelBytes = spec.pixel_bytes(true);
    info.channels = spec.channelnames;
    for (int c = 0; c < spec.nchannels; ++c) info.types.emplace_back(spec.channelformat(c).c_str());
    info.format = format;
    for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
        std::string name(attribute.name());
        std::transform(name.begin(), name.end(), name.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        const OIIO::TypeDesc type = attribute.type();
        info.texts[name] = attribute.get_string();
        if (type.aggregate == OIIO::TypeDesc::SCALAR && type.basetype != OIIO::TypeDesc::STRING)
            // An int is no float to OpenImageIO.
            info.numbers[name] = type.is_floating_point() ? static_cast<double>(attribute.get_float())
                                                          : static_cast<double>(attribute.get_int());
    }
    if (const auto name = info.texts.find("oiio:subimagename"); name != info.texts.end())
        info.part = name->second;
    return info;
}

class Input : public ImageInput {
  public:
    /// `memory`: what `input` reads from, if it does.
    Input(std::unique_ptr<OIIO::ImageInput> input, std::unique_ptr<OIIO::Filesystem::IOProxy> memory)
        : memory_(std::move(memory)),
          input_(std::move(input)),
          info_(infoOf(input_->spec(), input_->format_name())) {}

    const ImageInfo& info() const override { return info_; }
    bool seek(int part) override {
        if (input_->seek_subimage(part, 0)) {
            info_ = infoOf(input_->spec(), input_->format_name());
            return true;
        }
        static_cast<void>(input_->geterror());  // there is no such part: not an error
        return false;
    }
    bool readRows(int part, int y, int until, int begin, int end, float* out) override {
        return input_->read_scanlines(part, 0, y, until, 0, begin, end, OIIO::TypeDesc::FLOAT, out);
    }
    bool readTileRows(int part, int y, int until, int begin, int end, float* out) override {
        const OIIO::ImageSpec spec = input_->spec_dimensions(part, 0);
        return input_->read_tiles(part, 0, spec.x, spec.x + spec.width, y, until, 0, 1, begin, end,
                                  OIIO::TypeDesc::FLOAT, out);
    }
    bool readStored(int y, int until, void* out) override {
        return input_->read_native_scanlines(0, 0, y, until, 0, out);
    }
    bool readAll(int part, float* out) override {
        return input_->read_image(part, 0, 0, input_->spec().nchannels, OIIO::TypeDesc::FLOAT, out);
    }
    bool readAll(std::uint8_t* out) override {
        return input_->read_image(0, 0, 0, input_->spec().nchannels, OIIO::TypeDesc::UINT8, out);
    }
    std::string error() override { return reason(input_->geterror()); }

    OIIO::ImageSpec firstPart() const { return input_->spec(0, 0); }

  private:
    std::unique_ptr<OIIO::Filesystem::IOProxy> memory_;
    std::unique_ptr<OIIO::ImageInput> input_;
    ImageInfo info_;  // of the part sought last: asked for often, in loops over rows
};

class Output : public ImageOutput {
  public:
    explicit Output(std::unique_ptr<OIIO::ImageOutput> output) : output_(std::move(output)) {}

    std::string format() const override { return output_->format_name(); }
    bool toMemory() override { return output_->set_ioproxy(&memory_); }
    std::span<const unsigned char> memory() const override { return memory_.buffer(); }

    bool open(const std::string& path, const ImageOutputFormat& format) override {
        OIIO::ImageSpec spec(format.data.width, format.data.height, static_cast<int>(format.channels.size()),
                             OIIO::TypeDesc::FLOAT);
        if (this->format() == "png") spec.format = OIIO::TypeDesc::UINT8;
        if (format.half) spec.format = OIIO::TypeDesc::HALF;
        spec.x = format.data.x;
        spec.y = format.data.y;
        spec.full_x = format.display.x;
        spec.full_y = format.display.y;
        spec.full_width = format.display.width;
        spec.full_height = format.display.height;
        spec.channelnames = format.channels;
        // Pixels arrive as they must be stored: no library-side colour conversion of 8-bit formats.
        spec.attribute("oiio:ColorSpace", spec.format == OIIO::TypeDesc::UINT8 ? "sRGB" : "Linear");
        for (const auto& [name, value] : format.attributes) spec.attribute(name, value);
        return output_->open(path, spec);
    }
    bool openLike(const std::string& path, const ImageInput& input, const Window& data,
                  const std::string& inputs) override {
        OIIO::ImageSpec spec = dynamic_cast<const Input&>(input).firstPart();
        spec.x = data.x;
        spec.y = data.y;
        spec.width = data.width;
        spec.height = data.height;
        spec.erase_attribute("variolux:inputs");
        if (!inputs.empty()) spec.attribute("variolux:inputs", inputs);
        return output_->open(path, spec);
    }
    bool write(int y, int until, const float* rows) override {
        return output_->write_scanlines(y, until, 0, OIIO::TypeDesc::FLOAT, rows);
    }
    bool writeStored(int y, int until, const void* rows) override {
        return output_->write_scanlines(y, until, 0, OIIO::TypeDesc::UNKNOWN, rows);
    }
    bool close() override { return output_->close(); }
    std::string error() override { return reason(output_->geterror()); }

  private:
    OIIO::Filesystem::IOVecOutput memory_;
    std::unique_ptr<OIIO::ImageOutput> output_;
};

class Library : public ImageLibrary {
  public:
    std::unique_ptr<ImageInput> open(const std::string& path, std::string& fault) const override {
        auto input = OIIO::ImageInput::open(path);
        if (input) return std::make_unique<Input>(std::move(input), nullptr);
        fault = reason({});
        return nullptr;
    }
    std::unique_ptr<ImageInput> open(std::span<const unsigned char> bytes, const std::string& extension,
                                     std::string& fault) const override {
        auto memory = std::make_unique<OIIO::Filesystem::IOMemReader>(
            const_cast<unsigned char*>(bytes.data()), bytes.size());
        OIIO::ImageSpec config;
        config["oiio:UnassociatedAlpha"] = 1;
        OIIO::Filesystem::IOProxy* proxy = memory.get();
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        auto input = OIIO::ImageInput::open("memory" + extension, &config);
        if (input) return std::make_unique<Input>(std::move(input), std::move(memory));
        fault = reason({});
        return nullptr;
    }
    std::unique_ptr<ImageOutput> create(const std::string& path, std::string& fault) const override {
        auto output = OIIO::ImageOutput::create(path);
        if (output) return std::make_unique<Output>(std::move(output));
        fault = reason({});
        return nullptr;
    }
};

}  // namespace

}  // namespace vlx

extern "C" [[gnu::visibility("default")]] const vlx::ImageLibrary* variolux_image_library() {
    static const vlx::Library library;
    return &library;
}
