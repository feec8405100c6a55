#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <limits>

#include "render/gltf/gltf_file.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"

namespace vlx::render {
namespace {

constexpr std::int64_t kMostPixels = std::int64_t{1} << 28;

/// The file name extension that tells OpenImageIO which reader to use, from the first bytes.
std::string formatOf(std::span<const unsigned char> bytes) {
    const auto starts = [&](std::initializer_list<unsigned char> magic) {
        return bytes.size() >= magic.size() && std::equal(magic.begin(), magic.end(), bytes.begin());
    };
    if (starts({0x89, 'P', 'N', 'G'})) return ".png";
    if (starts({0xff, 0xd8, 0xff})) return ".jpg";
    if (starts({'R', 'I', 'F', 'F'})) return ".webp";
    return {};
}

/// One to four channels to four: grey is repeated, a missing alpha is `one`.
template <class T>
std::vector<T> toRgba(const std::vector<T>& in, int channels, T one) {
    const auto n = static_cast<std::size_t>(channels);
    std::vector<T> out(in.size() / n * 4);
    for (std::size_t i = 0; i < in.size() / n; ++i) {
        const T* p = in.data() + i * n;
        const bool grey = n < 3;
        out[4 * i] = p[0];
        out[4 * i + 1] = p[grey ? 0 : 1];
        out[4 * i + 2] = p[grey ? 0 : 2];
        out[4 * i + 3] = n == 2 ? p[1] : n >= 4 ? p[3] : one;
    }
    return out;
}

template <class T>
std::vector<T> readPixels(OIIO::ImageInput& in, const OIIO::ImageSpec& spec) {
    std::vector<T> pixels(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                          static_cast<std::size_t>(spec.nchannels));
    if (!in.read_image(0, 0, 0, spec.nchannels, OIIO::BaseTypeFromC<T>::value, pixels.data())) pixels.clear();
    return pixels;
}

}  // namespace

Texture GltfFile::image(int index, ColourSpace space) const {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.images.size())
        fail("a texture refers to image " + std::to_string(index) + ", the file has " +
             std::to_string(model_.images.size()));
    const tinygltf::Image& source = model_.images[static_cast<std::size_t>(index)];
    const std::string what = described("image", static_cast<std::size_t>(index), source.name);
    std::span<const unsigned char> bytes = source.image;
    if (source.bufferView >= 0) bytes = viewBytes(source.bufferView, what);
    if (bytes.empty())
        fail(what + " has no data" + (source.uri.empty() ? "" : ": '" + source.uri + "' is missing"));
    const std::string format = formatOf(bytes);
    if (format.empty()) fail(what + " is neither PNG nor JPEG nor WebP");

    OIIO::Filesystem::IOMemReader memory(const_cast<unsigned char*>(bytes.data()), bytes.size());
    OIIO::ImageSpec config;
    config["oiio:UnassociatedAlpha"] = 1;
    OIIO::Filesystem::IOProxy* proxy = &memory;
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    const auto in = OIIO::ImageInput::open("memory" + format, &config);
    if (!in) fail(what + " cannot be decoded: " + OIIO::geterror());
    const OIIO::ImageSpec spec = in->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 ||
        std::int64_t{spec.width} * spec.height > kMostPixels)
        fail(what + " has the size " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
             ", expected 1 to 2^28 pixels");
    if (spec.format.basesize() == 1) {
        const auto pixels = readPixels<std::uint8_t>(*in, spec);
        if (pixels.empty()) fail(what + " cannot be decoded: " + in->geterror());
        return {spec.width, spec.height, toRgba<std::uint8_t>(pixels, spec.nchannels, 255), space};
    }
    const auto pixels = readPixels<float>(*in, spec);
    if (pixels.empty()) fail(what + " cannot be decoded: " + in->geterror());
    return {spec.width, spec.height, toRgba(pixels, spec.nchannels, 1.f), space};
}

Environment loadEnvironment(const std::string& path) {
    const Image image = readImage(path);
    int r = image.channel("R"), g = image.channel("G"), b = image.channel("B");
    if (r < 0 || g < 0 || b < 0) {
        if (image.channelCount() != 1) throw Error(path, "expected channels R, G, B or a single one");
        r = g = b = 0;
    }
    std::vector<Rgb> pixels;
    pixels.reserve(static_cast<std::size_t>(image.data.pixels()));
    for (int row = 0; row < image.data.height; ++row) {
        for (int col = 0; col < image.data.width; ++col) {
            const float* p = image.at(col, row);
            const Rgb value{p[r], p[g], p[b]};
            if (!isFinite(value) || value.x < 0 || value.y < 0 || value.z < 0)
                throw Error(path, "expected finite radiance >= 0, found (" + std::to_string(value.x) + ", " +
                                      std::to_string(value.y) + ", " + std::to_string(value.z) +
                                      ") at column " + std::to_string(col) + ", row " + std::to_string(row));
            pixels.push_back(value);
        }
    }
    return {image.data.width, image.data.height, std::move(pixels)};
}

}  // namespace vlx::render
