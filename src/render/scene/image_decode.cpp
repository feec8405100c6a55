#include <algorithm>
#include <cmath>
#include <limits>

#include "base/image_library.h"
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

/// Of four channels whose fourth is a glossiness: the second becomes the roughness.
template <class T>
std::vector<T> withRoughness(std::vector<T> rgba, std::optional<float> glossiness, float one) {
    for (std::size_t i = 0; glossiness && i + 3 < rgba.size(); i += 4) {
        const float glossy = std::clamp(static_cast<float>(rgba[i + 3]), 0.f, one);
        const float rough = one - *glossiness * glossy;
        rgba[i + 1] = std::is_integral_v<T> ? static_cast<T>(std::lround(rough)) : static_cast<T>(rough);
    }
    return rgba;
}

}  // namespace

Texture GltfFile::image(int index, ColourSpace space, std::optional<float> glossiness) const {
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

    std::string fault;
    const auto in = imageLibrary().open(bytes, format, fault);
    if (!in) fail(what + " cannot be decoded: " + fault);
    const ImageInfo info = in->info();
    const int width = info.data.width, height = info.data.height;
    if (width <= 0 || height <= 0 || info.channels.empty() || std::int64_t{width} * height > kMostPixels)
        fail(what + " has the size " + std::to_string(width) + "x" + std::to_string(height) +
             ", expected 1 to 2^28 pixels");
    const std::size_t values =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * info.channels.size();
    const auto channels = static_cast<int>(info.channels.size());
    if (info.bytes) {
        std::vector<std::uint8_t> pixels(values);
        if (!in->readAll(pixels.data())) fail(what + " cannot be decoded: " + in->error());
        return {width, height, withRoughness(toRgba<std::uint8_t>(pixels, channels, 255), glossiness, 255),
                space};
    }
    std::vector<float> pixels(values);
    if (!in->readAll(0, pixels.data())) fail(what + " cannot be decoded: " + in->error());
    return {width, height, withRoughness(toRgba(pixels, channels, 1.f), glossiness, 1), space};
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
