// Writes the seeds of the fuzz targets: fuzz_corpus DIR makes DIR/dump, DIR/bcd, DIR/sbmc, DIR/images and
// DIR/gltf anew: what a fuzzer has added there is gone.

#include <cstdio>
#include <filesystem>

#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "../render/gltf_text.h"
#include "variolux/base/image_io.h"

namespace {

using namespace vlx;
namespace fs = std::filesystem;

void write(const fs::path& path, const FileBytes& bytes) {
    fs::create_directories(path.parent_path());
    writeBytes(path.string(), bytes);
}

void dumps(const fs::path& folder) {
    for (const auto compression : {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
        TestDump dump =
            makeDump({3, -2, 5, 4}, mixedChannels(), [](int col, int row) { return (col + row) % 3; });
        dump.header.compression = compression;
        const fs::path path = folder / ("dump" + std::to_string(static_cast<int>(compression)));
        fs::create_directories(folder);
        writeDump(path.string(), dump);
    }
}

void images(const fs::path& folder) {
    fs::create_directories(folder);
    const auto value = [](int c, int x, int y) { return static_cast<float>((c * 5 + x * 3 + y) % 11); };
    const std::vector<std::string> statistics = {"B",        "Bin_0000", "Bin_0001", "Bin_0002",
                                                 "Bin_0003", "G",        "R"};
    const std::pair<char, std::vector<std::string>> kinds[] = {
        {'\0', {"R", "G", "B", "A", "Z"}},
        {'\1', {"L.Combined.R", "L.Combined.G", "L.Combined.B", "L.Denoising Depth.Z"}},
        {'\2', pbrtChannels()},
        {'\2', mitsubaMomentChannels()},
        {'\3', statistics},
        {'\4', {"R", "G", "B"}}};
    int number = 0;
    for (const auto& [which, channels] : kinds)
        for (const char* compression : {"none", "zip", "piz"}) {
            ImageWriteOptions options;
            options.compression = compression;
            const std::string path = (folder / "image.exr").string();
            writeImage(path, imageOf({0, 0, 4, 3}, channels, value), options);
            FileBytes bytes = fileBytes(path);
            bytes.insert(bytes.begin(), static_cast<unsigned char>(which));
            write(folder / ("image" + std::to_string(number++)), bytes);
            fs::remove(path);
        }
}

void scenes(const fs::path& folder) {
    const render::GltfText scene;
    const std::string text = scene.text(), binary = scene.binary();
    write(folder / "text", {text.begin(), text.end()});
    write(folder / "binary", {binary.begin(), binary.end()});
    render::GltfText bent;  // all that bends, is instanced, chosen and compressed
    nlohmann::json& j = bent.json;
    auto& primitive = j["meshes"][0]["primitives"][0];
    j["accessors"].push_back({{"bufferView", bent.view(std::vector<std::uint16_t>(16, 0))},
                              {"componentType", 5123},
                              {"count", 4},
                              {"type", "VEC4"}});
    primitive["attributes"]["JOINTS_0"] = j["accessors"].size() - 1;
    primitive["attributes"]["WEIGHTS_0"] =
        bent.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    primitive["targets"] = {{{"POSITION", 0}, {"NORMAL", 0}}};
    primitive["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 0}, {"variants", {0}}}};
    j["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "one"}}};
    j["meshes"][0]["weights"] = {0.5};
    j["materials"][0]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
    j["skins"] = {{{"joints", {0, 1}}}};
    j["nodes"][0]["skin"] = 0;
    j["nodes"].push_back({{"mesh", 0}});
    j["nodes"][3]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = 0;
    j["scenes"][0]["nodes"] = {0, 1, 2, 3};
    animate(bent, 0, "weights", {0, 1}, {0, 1}, "SCALAR");
    const std::string bentText = bent.text();
    write(folder / "bent", {bentText.begin(), bentText.end()});
    j["bufferViews"][0]["extensions"]["EXT_meshopt_compression"] = {
        {"buffer", 0}, {"byteLength", 48}, {"byteStride", 12}, {"count", 4}, {"mode", "ATTRIBUTES"}};
    primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 1},
                                                             {"attributes", {{"POSITION", 0}}}};
    const std::string compressed = bent.text();
    write(folder / "compressed", {compressed.begin(), compressed.end()});
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fputs("Usage: fuzz_corpus DIR\n", stderr);
        return 2;
    }
    const fs::path folder = argv[1];
    for (const char* target : {"dump", "bcd", "sbmc", "images", "gltf"}) fs::remove_all(folder / target);
    dumps(folder / "dump");
    write(folder / "bcd/three", bcdRawBytes({}));
    BcdRaw four;
    four.channels = 4;
    write(folder / "bcd/four", bcdRawBytes(four));
    SbmcTileFile tile;
    tile.tileSize = 2;
    tile.samples = 1;
    tile.pathDepth = 1;
    write(folder / "sbmc/tile", sbmcTileBytes(tile));
    images(folder / "images");
    scenes(folder / "gltf");
    return 0;
}
