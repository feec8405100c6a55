#include "render/gltf/gltf_file.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "render/gltf/check/gltf_files.h"
#include "render/gltf/gltf_compressed.h"
#include "variolux/base/error.h"

namespace vlx::render {
namespace {

std::vector<unsigned char> readBytes(const std::string& path) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (!std::filesystem::is_regular_file(status))
        throw Error(path, "expected a glTF file, found " + kindOf(status));
    std::ifstream in(path, std::ios::binary);
    if (!in) throw Error(path, "cannot be opened");
    std::vector<unsigned char> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    if (in.bad() || bytes.empty()) throw Error(path, "expected a glTF file, found nothing that can be read");
    if (bytes.size() > std::numeric_limits<unsigned int>::max())
        throw Error(path, "expected a file of less than 4 GB");
    return bytes;
}

std::uint32_t word(const std::vector<unsigned char>& bytes, std::size_t offset) {
    std::uint32_t v = 0;
    std::memcpy(&v, bytes.data() + offset, sizeof v);
    return v;
}

bool isBinary(const std::vector<unsigned char>& bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

/// Whether the chunks of a binary glTF file lie inside it.
void checkChunks(const std::string& path, const std::vector<unsigned char>& bytes) {
    const std::size_t size = bytes.size();
    if (size < 20)
        throw Error(path, "truncated: a binary glTF header has 20 bytes, found " + std::to_string(size));
    if (word(bytes, 4) != 2)
        throw Error(path, "expected binary glTF 2, found version " + std::to_string(word(bytes, 4)) +
                              "; turn it into 2, for example with `gltf-pipeline -i IN -o OUT`");
    const std::size_t length = word(bytes, 8);
    if (length > size)
        throw Error(path, "truncated: the header says " + std::to_string(length) + " bytes, the file has " +
                              std::to_string(size));
    const std::size_t json = word(bytes, 12);
    const bool hasBinary = json + 20 + 8 <= length;
    if (json + 20 > length || (hasBinary && json + 28 + word(bytes, json + 20) > length))
        throw Error(path, "a chunk of the binary glTF file is longer than the file");
}

/// A text or binary glTF file, whose chunks have been checked, with another JSON.
std::vector<unsigned char> withJson(const std::vector<unsigned char>& whole, std::string text) {
    if (!isBinary(whole)) return {text.begin(), text.end()};
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::size_t rest = 20 + std::size_t{word(whole, 12)};
    std::vector<unsigned char> bytes(whole.begin(), whole.begin() + 20);
    const auto setWord = [&](std::size_t offset, std::size_t value) {
        const auto v = static_cast<std::uint32_t>(value);
        std::memcpy(bytes.data() + offset, &v, sizeof v);
    };
    setWord(8, 20 + text.size() + (word(whole, 8) - rest));
    setWord(12, text.size());
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.insert(bytes.end(), whole.begin() + static_cast<std::ptrdiff_t>(rest), whole.end());
    return bytes;
}

/// A text or binary glTF file with what the cameras of the file `path` need.
std::vector<unsigned char> readCameras(const std::string& path) {
    const std::string text = camerasAlone(gltfJson(path));
    if (text.empty()) return readBytes(path);  // which says what is wrong
    // Its own buffer, when it has one, is the binary file's.
    const bool buffered = text.find("\"buffers\"") != std::string::npos;
    const std::vector<unsigned char> whole = buffered ? readBytes(path) : std::vector<unsigned char>();
    if (isBinary(whole)) checkChunks(path, whole);
    return withJson(whole, text);
}

/// Images of their own files are kept encoded; those in buffers are read from there when wanted.
bool keepEncoded(tinygltf::Image* image, int, std::string*, std::string*, int, int,
                 const unsigned char* bytes, int size, void*) {
    if (image->bufferView < 0 && size > 0) image->image.assign(bytes, bytes + size);
    return true;
}

std::string firstLine(const std::string& text) {
    const std::size_t begin = text.find_first_not_of(" \n\r\t");
    if (begin == std::string::npos) return "not a glTF 2.0 file";
    std::string line = text.substr(begin, text.find_first_of("\n\r", begin) - begin);
    if (line.size() > 200) line = line.substr(0, 197) + "...";  // some hold data
    return line;
}

double component(const unsigned char* bytes, int type, bool normalized) {
    const auto as = [&]<class T>(T) {
        T v;
        std::memcpy(&v, bytes, sizeof v);
        if constexpr (std::is_floating_point_v<T>) return static_cast<double>(v);
        if (!normalized) return static_cast<double>(v);
        return std::max(-1.0, static_cast<double>(v) / static_cast<double>(std::numeric_limits<T>::max()));
    };
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return as(std::int8_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return as(std::uint8_t{});
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return as(std::int16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return as(std::uint16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return as(std::uint32_t{});
        default:
            return as(float{});
    }
}

}  // namespace

GltfFile::GltfFile(const std::string& path, Use use) : path_(path) {
    std::vector<unsigned char> bytes = use == Use::Scene ? readBytes(path) : readCameras(path);
    const bool binary = isBinary(bytes);
    if (binary) checkChunks(path, bytes);
    const std::string json(reinterpret_cast<const char*>(bytes.data()) + (binary ? 20 : 0),
                           binary ? word(bytes, 12) : bytes.size());
    facts_ = checkGltf(path, json);
    if (std::string plain = withCompressedViews(json); plain != json)
        bytes = withJson(bytes, std::move(plain));
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(keepEncoded, nullptr);
    const std::size_t slash = path.find_last_of('/');
    const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash);
    const auto size = static_cast<unsigned int>(bytes.size());
    std::string errors, warnings;
    const bool good =
        binary ? loader.LoadBinaryFromMemory(&model_, &errors, &warnings, bytes.data(), size, folder)
               : loader.LoadASCIIFromString(&model_, &errors, &warnings,
                                            reinterpret_cast<const char*>(bytes.data()), size, folder);
    if (!good) fail(firstLine(errors));
    decompress();
}

void GltfFile::fail(const std::string& message) const { throw Error(path_, message); }

const tinygltf::Accessor& GltfFile::accessorAt(int index, const std::string& what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size())
        fail(what + " refers to accessor " + std::to_string(index) + ", the file has " +
             std::to_string(model_.accessors.size()));
    return model_.accessors[static_cast<std::size_t>(index)];
}

std::span<const unsigned char> GltfFile::viewBytes(int index, const std::string& what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= model_.bufferViews.size())
        fail(what + " refers to bufferView " + std::to_string(index) + ", the file has " +
             std::to_string(model_.bufferViews.size()));
    const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(index)];
    if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model_.buffers.size())
        fail("bufferView " + std::to_string(index) + " refers to buffer " + std::to_string(view.buffer) +
             ", the file has " + std::to_string(model_.buffers.size()));
    const auto& data = model_.buffers[static_cast<std::size_t>(view.buffer)].data;
    if (view.byteOffset > data.size() || view.byteLength > data.size() - view.byteOffset)
        fail("bufferView " + std::to_string(index) + " (" + what + ") spans bytes " +
             std::to_string(view.byteOffset) + " to " + std::to_string(view.byteOffset + view.byteLength) +
             ", its buffer has " + std::to_string(data.size()));
    return std::span(data).subspan(view.byteOffset, view.byteLength);
}

/// The bytes of `count` elements of `size` bytes, `stride` apart.
std::span<const unsigned char> GltfFile::rangeOf(int bufferView, std::size_t offset, std::size_t count,
                                                 std::size_t stride, std::size_t size,
                                                 const std::string& what) const {
    const auto bytes = viewBytes(bufferView, what);
    if (count == 0) return {};
    // Division avoids overflow: the last element ends at offset + (count - 1) stride + size.
    const bool fits = offset <= bytes.size() && size <= bytes.size() - offset &&
                      (count - 1) <= (bytes.size() - offset - size) / stride;
    if (!fits)
        fail(what + " needs " + std::to_string(count) + " elements of " + std::to_string(size) +
             " bytes from byte " + std::to_string(offset) + " on, bufferView " + std::to_string(bufferView) +
             " has " + std::to_string(bytes.size()) + " bytes");
    return bytes.subspan(offset);
}

std::vector<double> GltfFile::values(int index, int components, const std::string& what) const {
    const tinygltf::Accessor& a = accessorAt(index, what);
    const int componentBytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.componentType));
    if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(a.type)) != components ||
        componentBytes <= 0)
        fail(what + ": accessor " + std::to_string(index) + " must have " + std::to_string(components) +
             " components of a glTF type");
    const auto width = static_cast<std::size_t>(components);
    const auto unit = static_cast<std::size_t>(componentBytes);
    const std::size_t size = width * unit;
    std::vector<double> out;
    if (a.bufferView >= 0) {
        viewBytes(a.bufferView, what);
        const std::size_t given = model_.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
        const std::size_t stride = given != 0 ? given : size;
        const auto bytes = rangeOf(a.bufferView, a.byteOffset, a.count, stride, size, what);
        out.resize(a.count * width);
        for (std::size_t i = 0; i < a.count; ++i)
            for (std::size_t c = 0; c < width; ++c)
                out[i * width + c] =
                    component(bytes.data() + i * stride + c * unit, a.componentType, a.normalized);
    } else {
        // Zeros, as the specification says; bounded, as no bytes vouch for the count.
        if (a.count > (std::size_t{1} << 28))
            fail(what + " has " + std::to_string(a.count) + " elements without data");
        out.resize(a.count * width);
    }
    if (a.sparse.isSparse) {
        const auto count = static_cast<std::size_t>(std::max(0, a.sparse.count));
        const int indexBytes =
            tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(a.sparse.indices.componentType));
        if (indexBytes <= 0 || a.sparse.indices.byteOffset < 0 || a.sparse.values.byteOffset < 0)
            fail(what + ": accessor " + std::to_string(index) + " has a broken sparse part");
        const auto step = static_cast<std::size_t>(indexBytes);
        const auto where =
            rangeOf(a.sparse.indices.bufferView, static_cast<std::size_t>(a.sparse.indices.byteOffset), count,
                    step, step, what);
        const auto with =
            rangeOf(a.sparse.values.bufferView, static_cast<std::size_t>(a.sparse.values.byteOffset), count,
                    size, size, what);
        for (std::size_t i = 0; i < count; ++i) {
            const auto target = static_cast<std::size_t>(
                component(where.data() + i * step, a.sparse.indices.componentType, false));
            if (target >= a.count) fail(what + ": a sparse index is " + std::to_string(target));
            for (std::size_t c = 0; c < width; ++c)
                out[target * width + c] =
                    component(with.data() + i * size + c * unit, a.componentType, a.normalized);
        }
    }
    return out;
}

std::vector<float> GltfFile::floats(int index, int components, const std::string& what) const {
    const std::vector<double> v = values(index, components, what);
    return {v.begin(), v.end()};
}

std::vector<float> GltfFile::colours(int index, const std::string& what) const {
    const tinygltf::Accessor& a = accessorAt(index, what);
    if (a.type != TINYGLTF_TYPE_VEC3) return floats(index, 4, what);
    const std::vector<double> rgb = values(index, 3, what);
    std::vector<float> rgba(rgb.size() / 3 * 4, 1.f);
    for (std::size_t i = 0; i < rgb.size(); ++i) rgba[i / 3 * 4 + i % 3] = static_cast<float>(rgb[i]);
    return rgba;
}

std::vector<std::uint32_t> GltfFile::indices(int index, const std::string& what, int components) const {
    const tinygltf::Accessor& a = accessorAt(index, what);
    if (a.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE &&
        a.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        a.componentType != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        fail(what + ": accessor " + std::to_string(index) + " must hold unsigned integers");
    const std::vector<double> v = values(index, components, what);
    return {v.begin(), v.end()};
}

const tinygltf::Value* extension(const tinygltf::ExtensionMap& extensions, const std::string& name) {
    const auto found = extensions.find(name);
    return found != extensions.end() && found->second.IsObject() ? &found->second : nullptr;
}

double number(const tinygltf::Value& object, const std::string& key, double fallback) {
    if (!object.IsObject() || !object.Has(key)) return fallback;
    const tinygltf::Value& v = object.Get(key);
    if (v.IsBool()) return v.Get<bool>() ? 1 : 0;
    return v.IsNumber() ? v.GetNumberAsDouble() : fallback;
}

std::string described(std::string_view kind, std::size_t index, const std::string& name) {
    std::string text = std::string(kind) + " " + std::to_string(index);
    if (!name.empty()) text += " '" + name + "'";
    return text;
}

}  // namespace vlx::render
