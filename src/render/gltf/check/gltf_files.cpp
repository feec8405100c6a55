#include "render/gltf/check/gltf_files.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "variolux/base/error.h"

namespace vlx::render {
namespace {

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

using OrderedJson = nlohmann::ordered_json;

void keepOnly(OrderedJson& object, std::initializer_list<const char*> keys) {
    for (auto item = object.begin(); item != object.end();)
        item = std::ranges::find(keys, item.key()) == keys.end() ? object.erase(item) : std::next(item);
}

/// An array of an object, or an empty one.
const OrderedJson& listOf(const OrderedJson& object, const char* key) {
    static const OrderedJson none = OrderedJson::array();
    if (!object.is_object()) return none;
    const auto found = object.find(key);
    return found != object.end() && found->is_array() ? *found : none;
}

std::optional<std::size_t> indexOf(const OrderedJson& object, const char* key) {
    if (!object.is_object() || !object.contains(key) || !object[key].is_number_unsigned()) return {};
    return object[key].get<std::size_t>();
}

/// The nodes that have cameras, and all above them.
std::set<std::size_t> cameraNodes(const OrderedJson& nodes) {
    std::map<std::size_t, std::size_t> parents;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (const OrderedJson& child : listOf(nodes[i], "children"))
            if (child.is_number_unsigned()) parents[child.get<std::size_t>()] = i;
    std::set<std::size_t> found;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!nodes[i].is_object() || !nodes[i].contains("camera")) continue;
        std::size_t at = i;
        while (found.insert(at).second && parents.contains(at)) at = parents[at];
    }
    return found;
}

/// Leaves the channels that move one of the nodes, and the animations that have any.
OrderedJson animationsOf(const OrderedJson& animations, const std::set<std::size_t>& nodes) {
    OrderedJson kept = OrderedJson::array();
    for (OrderedJson animation : animations) {
        OrderedJson channels = OrderedJson::array();
        for (const OrderedJson& channel : listOf(animation, "channels"))
            if (channel.is_object() && channel.contains("target"))
                if (const auto node = indexOf(channel["target"], "node"); node && nodes.contains(*node))
                    channels.push_back(channel);
        if (channels.empty()) continue;
        animation["channels"] = std::move(channels);
        kept.push_back(std::move(animation));
    }
    return kept;
}

}  // namespace

std::string gltfJson(const std::string& path) {
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

std::string camerasAlone(const std::string& json) {
    if (isNestedTooDeep(json)) return {};
    OrderedJson file = OrderedJson::parse(json, nullptr, false);
    if (!file.is_object()) return {};
    const OrderedJson animations =
        animationsOf(listOf(file, "animations"), cameraNodes(listOf(file, "nodes")));
    if (animations.empty()) {
        keepOnly(file, {"asset", "scene", "scenes", "nodes", "cameras"});
    } else {
        keepOnly(file,
                 {"asset", "scene", "scenes", "nodes", "cameras", "accessors", "bufferViews", "buffers"});
        file["animations"] = animations;
    }
    if (file.contains("nodes") && file["nodes"].is_array())
        for (OrderedJson& node : file["nodes"])
            if (node.is_object())
                keepOnly(node, {"name", "camera", "children", "matrix", "translation", "rotation", "scale",
                                "extras"});
    return file.dump();
}

std::vector<std::string> gltfFiles(const std::string& path) {
    std::vector<std::string> files = {path};
    const std::string text = gltfJson(path);
    if (isNestedTooDeep(text)) return files;
    const auto json = nlohmann::json::parse(text, nullptr, false);
    if (!json.is_object()) return files;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    for (const char* kind : {"buffers", "images"}) {
        const auto list = json.find(kind);
        if (list == json.end() || !list->is_array()) continue;
        for (const auto& item : *list) {
            const auto uri = item.is_object() ? item.find("uri") : item.end();
            if (!item.is_object() || uri == item.end() || !uri->is_string()) continue;
            const auto name = uri->get<std::string>();
            if (!name.starts_with("data:")) files.push_back((folder / decoded(name)).string());
        }
    }
    return files;
}

std::string kindOf(const std::filesystem::file_status& status) {
    switch (status.type()) {
        case std::filesystem::file_type::none:
        case std::filesystem::file_type::not_found:
            return "no such file";
        case std::filesystem::file_type::regular:
            return "a file";
        case std::filesystem::file_type::directory:
            return "a folder";
        default:
            return "a pipe or device";
    }
}

bool isNestedTooDeep(const std::string& json) {
    int depth = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (quoted && c == '\\')
            ++i;
        else if (c == '"')
            quoted = !quoted;
        else if (!quoted && (c == '[' || c == '{') && ++depth > kDeepest)
            return true;
        else if (!quoted && (c == ']' || c == '}'))
            --depth;
    }
    return false;
}

namespace {

void checkData(const std::string& path, const std::string& where, const std::string& uri,
               std::uint64_t byteLength) {
    constexpr std::array kinds{"data:application/octet-stream;base64,",
                               "data:application/gltf-buffer;base64,", "data:text/plain;base64,"};
    if (std::ranges::none_of(kinds, [&](const char* kind) { return uri.starts_with(kind); }))
        throw Error(path, where + ": expected data:application/octet-stream;base64, found " +
                              uri.substr(0, std::min<std::size_t>(uri.find(','), 60)));
    const std::string_view digits = std::string_view(uri).substr(uri.find(',') + 1);
    const std::size_t bytes = (digits.find_last_not_of('=') + 1) * 3 / 4;
    if (bytes != byteLength)
        throw Error(path, where + ": expected " + std::to_string(byteLength) +
                              " bytes (its byteLength), found " + std::to_string(bytes));
}

}  // namespace

void checkGltfFiles(const std::string& path, const nlohmann::json& root) {
    for (const char* kind : {"buffers", "images"}) {
        const auto list = root.find(kind);
        if (list == root.end()) continue;
        const bool buffers = kind[0] == 'b';
        for (std::size_t i = 0; i < list->size(); ++i) {
            const auto& item = (*list)[i];
            const auto uri = item.find("uri");
            if (uri == item.end()) continue;
            const auto text = uri->get<std::string>();
            const std::string where = std::string(kind) + "[" + std::to_string(i) + "].uri";
            if (text.starts_with("data:")) {
                if (buffers) checkData(path, where, text, item.value("byteLength", std::uint64_t{0}));
                continue;
            }
            std::error_code ignored;
            const std::filesystem::path file = std::filesystem::path(path).parent_path() / decoded(text);
            const std::filesystem::file_status status = std::filesystem::status(file, ignored);
            if (std::filesystem::is_regular_file(status)) continue;
            // Whoever shows an image that is not there says so; not all are shown.
            if (buffers || std::filesystem::exists(status))
                throw Error(path,
                            where + ": expected a file beside it, '" + text + "', found " + kindOf(status));
        }
    }
}

}  // namespace vlx::render
