#include "malformed_files.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>
#include <utility>

#include "../dump/layer_files.h"
#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "../render/gltf_text.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"

namespace vlx {

namespace {

using Bytes = std::vector<unsigned char>;

template <class T>
void put(Bytes& bytes, std::size_t at, T value) {
    if (at + sizeof value > bytes.size()) ADD_FAILURE() << "no byte " << at;
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

// Where the last attribute of this name and type has its value.
std::size_t attribute(const Bytes& bytes, const std::string& name, const std::string& type) {
    const std::string pattern = name + '\0' + type + '\0';
    const auto found = std::find_end(bytes.begin(), bytes.end(), pattern.begin(), pattern.end());
    if (found == bytes.end()) ADD_FAILURE() << "no attribute " << name;
    return static_cast<std::size_t>(found - bytes.begin()) + pattern.size() + 4;
}

class Collection {
  public:
    void add(MalformedKind kind, const std::string& name, Bytes bytes) {
        files.push_back({kind, name, std::move(bytes)});
    }
    /// The file without its end, at several places.
    void truncations(MalformedKind kind, const std::string& name, const Bytes& bytes, int count) {
        for (int i = 0; i < count; ++i) {
            const std::size_t size =
                bytes.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
            add(kind, name + " cut to " + std::to_string(size) + " bytes",
                {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)});
        }
    }
    std::vector<MalformedFile> files;
};

constexpr std::int32_t kLies[] = {-1, 0, 1 << 20, 2147483647};

Bytes smallDump(const TemporaryFolder& folder) {
    TestDump dump = makeDump({0, 0, 6, 5}, {{"R"}, {"G"}, {"B"}, {"Z"}, {"sample.x"}, {"sample.y"}},
                             [](int col, int row) { return 1 + (col + row) % 3; });
    dump.header.compression = DumpCompression::None;
    writeDump(folder / "dump.exr", dump);
    return fileBytes(folder / "dump.exr");
}

void addDumps(Collection& all, const TemporaryFolder& folder) {
    using enum MalformedKind;
    const Bytes good = smallDump(folder);
    const auto with = [&](const std::string& name, const std::function<void(Bytes&)>& change) {
        Bytes bytes = good;
        change(bytes);
        all.add(Dump, "dump " + name, std::move(bytes));
    };
    all.truncations(Dump, "dump", good, 16);
    for (const unsigned char byte : {0, 255})
        with("with another magic number " + std::to_string(byte), [&](Bytes& b) { b[0] = byte; });
    for (const std::uint32_t version : {0u, 1u, 3u, 2u, 0x202u, 0xffffffffu})
        with("of version word " + std::to_string(version), [&](Bytes& b) { put(b, 4, version); });
    for (const int corner : {0, 4, 8, 12})
        for (const std::int32_t value : {-2147483647 - 1, 2147483647, 1 << 24})
            with("whose data window has " + std::to_string(value) + " at " + std::to_string(corner),
                 [&](Bytes& b) {
                     put(b, attribute(b, "dataWindow", "box2i") + static_cast<std::size_t>(corner), value);
                 });
    for (const auto& [name, type] : {std::pair{"channels", "chlist"},
                                     {"compression", "compression"},
                                     {"dataWindow", "box2i"},
                                     {"lineOrder", "lineOrder"},
                                     {"name", "string"},
                                     {"type", "string"}})
        with(std::string("whose ") + name + " claims 2^31-1 bytes",
             [&](Bytes& b) { put(b, attribute(b, name, type) - 4, 2147483647); });
    for (const unsigned char code : {4, 9, 255})
        with("of compression " + std::to_string(code),
             [&](Bytes& b) { b[attribute(b, "compression", "compression")] = code; });
    with("without R", [](Bytes& b) {
        b[attribute(b, "channels", "chlist") + 40] ^= 0x55;
        b[attribute(b, "channels", "chlist")] = 'Q';
    });
    for (const std::int32_t type : {3, -1})
        with("with channels of type " + std::to_string(type),
             [&](Bytes& b) { put(b, attribute(b, "channels", "chlist") + 2, type); });
    with("of deep data version 2", [](Bytes& b) { put(b, attribute(b, "version", "int"), 2); });
    with("of tiles", [](Bytes& b) { std::memcpy(&b[attribute(b, "type", "string")], "deeptile    ", 12); });
    // The last table of chunk positions is that of the samples: it stands before the first chunk.
    const std::size_t firstChunk = [&] {
        std::uint64_t position = 0;
        // The beauty's table is the first thing after the headers; its first entry says where chunks begin.
        for (std::size_t at = good.size(); at-- > 8;) {
            std::memcpy(&position, good.data() + at - 8, 8);
            if (position == at - 8 + 2 * 5 * 8) return static_cast<std::size_t>(position);
        }
        return std::size_t{0};
    }();
    const std::size_t table = firstChunk - 5 * 8;
    for (const std::uint64_t position :
         {std::uint64_t{0}, std::uint64_t{1} << 40, ~std::uint64_t{0}, std::uint64_t{8}})
        with("whose second chunk is at " + std::to_string(position),
             [&](Bytes& b) { put(b, table + 8, position); });
    std::uint64_t chunk = 0;
    std::memcpy(&chunk, good.data() + table + 8, 8);
    for (const std::size_t field : {0, 4, 8, 16, 24})
        for (const std::uint32_t value : {77u, 0x7fffffffu})
            with("whose second chunk has " + std::to_string(value) + " in byte " + std::to_string(field),
                 [&](Bytes& b) { put(b, static_cast<std::size_t>(chunk) + field, value); });
    with("whose counts decrease", [&](Bytes& b) { put(b, static_cast<std::size_t>(chunk) + 28, 100); });
    with("with a flat part only", [&](Bytes& b) {
        writeImage(folder / "flat.exr", vlx::Image({0, 0, 4, 4}, {"R", "G", "B"}));
        b = fileBytes(folder / "flat.exr");
    });
    all.add(Dump, "dump that is text", {'s', 'o', 'm', 'e', ' ', 't', 'e', 'x', 't', '\n'});
    all.add(Dump, "dump of zeros", Bytes(5000, 0));
}

void addImages(Collection& all, const TemporaryFolder& folder) {
    using enum MalformedKind;
    vlx::Image image({0, 0, 9, 20}, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 7);
    writeImage(folder / "image.exr", image);
    const Bytes good = fileBytes(folder / "image.exr");
    const auto with = [&](const std::string& name, const std::function<void(Bytes&)>& change) {
        Bytes bytes = good;
        change(bytes);
        all.add(Image, "image " + name, std::move(bytes));
    };
    all.truncations(Image, "image", good, 12);
    for (const int corner : {0, 4, 8, 12})
        for (const std::int32_t value : {-2147483647 - 1, 2147483647})
            with("whose data window has " + std::to_string(value) + " at " + std::to_string(corner),
                 [&](Bytes& b) {
                     put(b, attribute(b, "dataWindow", "box2i") + static_cast<std::size_t>(corner), value);
                 });
    with("whose channels claim 2^31-1 bytes",
         [](Bytes& b) { put(b, attribute(b, "channels", "chlist") - 4, 2147483647); });
    with("of compression 77", [](Bytes& b) { b[attribute(b, "compression", "compression")] = 77; });
    with("of another magic number", [](Bytes& b) { b[1] = 0; });
    with("whose packed rows are noise", [](Bytes& b) {
        for (std::size_t i = b.size() - 60; i < b.size(); ++i) b[i] = static_cast<unsigned char>(i * 37);
    });
    with("that is a dump", [&](Bytes& b) { b = smallDump(folder); });
    // Several parts: the lies are in the second, whose attributes are the last.
    std::vector<LayerPart> parts = rendererParts();
    parts.pop_back();
    writeLayers(folder / "parts.exr", parts);
    const Bytes several = fileBytes(folder / "parts.exr");
    all.truncations(Image, "image of parts, the first of which is", {several.begin(), several.begin() + 6000},
                    3);
    const auto parted = [&](const std::string& name, const std::function<void(Bytes&)>& change) {
        Bytes bytes = several;
        change(bytes);
        all.add(Image, "image of parts " + name, std::move(bytes));
    };
    parted("whose second window is huge",
           [](Bytes& b) { put(b, attribute(b, "dataWindow", "box2i") + 8, 2147483647); });
    parted("whose second tiles are empty",
           [](Bytes& b) { put(b, attribute(b, "tiles", "tiledesc"), std::int32_t{0}); });
    parted("whose second list of channels is cut",
           [](Bytes& b) { put(b, attribute(b, "channels", "chlist") - 4, std::int32_t{5}); });
    all.add(Image, "image that is text", {'s', 'o', 'm', 'e', ' ', 't', 'e', 'x', 't', '\n'});
    all.add(Image, "image that is a PNG's start", {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13});
}

void addBcd(Collection& all) {
    using enum MalformedKind;
    const Bytes good = bcdRawBytes({});
    all.truncations(BcdRaw, "bcd", good, 8);
    for (const auto& [field, at] :
         {std::pair{"width", 4u}, {"height", 8u}, {"samples", 12u}, {"channels", 16u}})
        for (const std::int32_t value : kLies) {
            Bytes bytes = good;
            put(bytes, at, value);
            all.add(BcdRaw, std::string("bcd whose ") + field + " is " + std::to_string(value), bytes);
        }
    Bytes longer = good;
    longer.push_back(0);
    all.add(BcdRaw, "bcd with a byte too many", longer);
    Bytes huge = good;  // products that overflow 64 bits
    for (const std::size_t at : {4u, 8u, 12u}) put(huge, at, 2147483647);
    all.add(BcdRaw, "bcd of 2^93 samples", huge);
}

void addSbmc(Collection& all) {
    using enum MalformedKind;
    const Bytes good = sbmcTileBytes({});
    all.truncations(Sbmc, "sbmc", good, 10);
    const char* fields[] = {"version",           "tile size",       "width",          "height",    "samples",
                            "reference samples", "sample features", "pixel features", "path depth"};
    for (std::size_t field = 0; field < 9; ++field) {
        if (field == 5) continue;  // nobody reads it
        for (const std::int32_t value : kLies) {
            if ((field == 2 || field == 3) && value == 1 << 20) continue;
            if (field == 7 && (value == 1 << 20)) continue;
            if (field == 8 && value == 0) continue;
            Bytes bytes = good;
            put(bytes, 4 * field, value);
            all.add(Sbmc, std::string("sbmc whose ") + fields[field] + " is " + std::to_string(value), bytes);
        }
    }
    for (const std::size_t at : {52u, 56u})
        for (const std::int32_t value : {-1, 8, 2147483647}) {
            Bytes bytes = good;
            put(bytes, at, value);
            all.add(Sbmc, "sbmc at " + std::to_string(value) + " in byte " + std::to_string(at), bytes);
        }
    std::int32_t reference = 0;
    std::memcpy(&reference, good.data() + 60, 4);
    const std::size_t block = 64 + static_cast<std::size_t>(reference);
    for (const std::int32_t value : {-1, 0, 3, 2147483647}) {
        Bytes bytes = good;
        put(bytes, 60, value);
        all.add(Sbmc, "sbmc whose reference has " + std::to_string(value) + " bytes", bytes);
        bytes = good;
        put(bytes, block, value);
        all.add(Sbmc, "sbmc whose first block has " + std::to_string(value) + " bytes", bytes);
    }
    Bytes noise = good;
    for (std::size_t i = block + 4; i < block + 30; ++i) noise[i] = static_cast<unsigned char>(i * 31);
    all.add(Sbmc, "sbmc whose first block is noise", noise);
}

void addGltf(Collection& all) {
    using enum MalformedKind;
    const auto bytesOf = [](const std::string& text) { return Bytes(text.begin(), text.end()); };
    const auto with = [&](const std::string& name, const std::function<void(render::GltfText&)>& change) {
        render::GltfText scene;
        change(scene);
        all.add(Gltf, "gltf " + name, bytesOf(scene.text()));
    };
    const render::GltfText good;
    all.truncations(Gltf, "gltf", bytesOf(good.text()), 6);
    const std::string binary = good.binary();
    all.truncations(Gltf, "glb", Bytes(binary.begin(), binary.end()), 6);
    for (const int index : {-5, 99, 2147483647}) {
        const std::string text = std::to_string(index);
        with("whose POSITION is accessor " + text,
             [&](auto& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = index; });
        with("whose accessor has bufferView " + text,
             [&](auto& g) { g.json["accessors"][0]["bufferView"] = index < 0 ? 98 : index; });
        with("whose bufferView has buffer " + text,
             [&](auto& g) { g.json["bufferViews"][0]["buffer"] = index; });
        with("whose node has mesh " + text,
             [&](auto& g) { g.json["nodes"][0]["mesh"] = index < 0 ? 97 : index; });
        with("whose scene has node " + text, [&](auto& g) { g.json["scenes"][0]["nodes"][0] = index; });
    }
    with("whose accessor counts 2^31", [](auto& g) { g.json["accessors"][0]["count"] = 2147483648u; });
    with("whose view is longer than its buffer",
         [](auto& g) { g.json["bufferViews"][0]["byteLength"] = 1 << 30; });
    with("whose view begins after its buffer",
         [](auto& g) { g.json["bufferViews"][0]["byteOffset"] = 1 << 30; });
    with("whose node is its own child", [](auto& g) { g.json["nodes"][0]["children"] = {0}; });
    with("whose index is out of range", [](auto& g) { g.json["accessors"][2]["bufferView"] = 0; });
    with("without anything to see", [](auto& g) { g.json["scenes"][0]["nodes"] = {1}; });
    with("with a position that is no number", [](auto& g) {
        const float nan = 0.0f / 0.0f;
        std::memcpy(g.bytes.data(), &nan, 4);
    });
    all.add(Gltf, "gltf that is an empty object", {'{', '}'});
    all.add(Gltf, "gltf that is text", {'s', 'o', 'm', 'e', ' ', 't', 'e', 'x', 't'});
}

}  // namespace

std::vector<MalformedFile> malformedFiles() {
    const TemporaryFolder folder;
    Collection all;
    addDumps(all, folder);
    addImages(all, folder);
    addBcd(all);
    addSbmc(all);
    addGltf(all);
    return std::move(all.files);
}

}  // namespace vlx
