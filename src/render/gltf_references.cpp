#include "gltf_references.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace vlx::render {
namespace {

/// The JSON of a text or binary glTF file.
std::string jsonOf(const std::string& path) {
    std::error_code ignored;
    std::ifstream in;
    if (std::filesystem::is_regular_file(path, ignored)) in.open(path, std::ios::binary | std::ios::ate);
    if (!in.is_open()) return {};
    std::uint64_t size = static_cast<std::uint64_t>(in.tellg());
    in.seekg(0);
    char head[20] = {};
    in.read(head, sizeof head);
    if (in && std::memcmp(head, "glTF", 4) == 0) {
        std::uint32_t length = 0;
        std::memcpy(&length, head + 12, sizeof length);
        size = std::min(std::uint64_t{length}, size - sizeof head);
    } else {
        in.clear();
        in.seekg(0);
    }
    std::string text(size, '\0');
    in.read(text.data(), static_cast<std::streamsize>(size));
    return text;
}

bool isHex(char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; }

/// URIs write some characters as %20.
std::string decoded(const std::string& uri) {
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const bool hex = uri[i] == '%' && i + 2 < uri.size() && isHex(uri[i + 1]) && isHex(uri[i + 2]);
        text += hex ? static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16)) : uri[i];
        if (hex) i += 2;
    }
    return text;
}

}  // namespace

std::vector<std::string> gltfFiles(const std::string& path) {
    std::vector<std::string> files = {path};
    const auto json = nlohmann::json::parse(jsonOf(path), nullptr, false);
    if (!json.is_object()) return files;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    for (const char* kind : {"buffers", "images"}) {
        const auto list = json.find(kind);
        if (list == json.end() || !list->is_array()) continue;
        for (const auto& item : *list) {
            const auto uri = item.is_object() ? item.find("uri") : item.end();
            if (!item.is_object() || uri == item.end() || !uri->is_string()) continue;
            const auto text = uri->get<std::string>();
            if (!text.starts_with("data:")) files.push_back((folder / decoded(text)).string());
        }
    }
    return files;
}

}  // namespace vlx::render
