#pragma once

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace vlx::render {

inline std::string base64(const std::vector<unsigned char>& bytes) {
    static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = bytes.size() - i;
        const unsigned v = static_cast<unsigned>(bytes[i]) << 16 | (left > 1 ? bytes[i + 1] << 8 : 0) |
                           (left > 2 ? bytes[i + 2] : 0);
        out += digits[v >> 18];
        out += digits[(v >> 12) & 63];
        out += left > 1 ? digits[(v >> 6) & 63] : '=';
        out += left > 2 ? digits[v & 63] : '=';
    }
    return out;
}

/// A glTF file in the making: a square of two triangles in the xy plane, facing +z, lit by a point light and
/// seen by a camera, to be changed by the test.
struct GltfText {
    nlohmann::json json;
    std::vector<unsigned char> bytes;

    GltfText() {
        json = nlohmann::json::parse(R"({
            "asset": {"version": "2.0"},
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": [
                {"type": "point", "intensity": 5, "color": [1, 0.5, 0.25], "name": "lamp"}]}},
            "scene": 0,
            "scenes": [{"nodes": [0, 1, 2], "extras": {"light_units": "radiometric"}}],
            "nodes": [
                {"mesh": 0, "name": "square"},
                {"camera": 0, "name": "eye", "translation": [0, 0, 3]},
                {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 2]}],
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
            "materials": [{"name": "paint", "pbrMetallicRoughness": {"metallicFactor": 0}}],
            "meshes": [{"name": "square", "primitives": [
                {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
            "accessors": [], "bufferViews": [], "buffers": []})");
        floats({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}, "VEC3");
        floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2");
        indices({0, 1, 2, 0, 2, 3});
    }

    static std::size_t width(const std::string& type) {
        return type == "SCALAR" ? 1 : static_cast<std::size_t>(type.back() - '0');
    }

    /// Appends data with its bufferView; returns the view's index.
    template <class T>
    int view(const std::vector<T>& values) {
        const std::size_t offset = bytes.size(), size = values.size() * sizeof(T);
        bytes.resize(offset + size);
        if (!values.empty()) std::memcpy(bytes.data() + offset, values.data(), size);
        while (bytes.size() % 4 != 0) bytes.push_back(0);
        json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", size}});
        return static_cast<int>(json["bufferViews"].size()) - 1;
    }

    /// Appends an accessor; returns its index.
    int floats(const std::vector<float>& values, const std::string& type) {
        json["accessors"].push_back({{"bufferView", view(values)},
                                     {"componentType", 5126},
                                     {"count", values.size() / width(type)},
                                     {"type", type}});
        return static_cast<int>(json["accessors"].size()) - 1;
    }

    int indices(const std::vector<std::uint16_t>& values) {
        json["accessors"].push_back({{"bufferView", view(values)},
                                     {"componentType", 5123},
                                     {"count", values.size()},
                                     {"type", "SCALAR"}});
        return static_cast<int>(json["accessors"].size()) - 1;
    }

    /// Overwrites a float of the data.
    void poke(std::size_t index, float value) { std::memcpy(bytes.data() + 4 * index, &value, 4); }

    /// Appends an embedded image and a texture of it; returns the texture's index.
    int texture(const std::vector<unsigned char>& file, const std::string& mime = "image/png") {
        json["images"].push_back({{"bufferView", view(file)}, {"mimeType", mime}});
        json["textures"].push_back({{"source", json["images"].size() - 1}});
        return static_cast<int>(json["textures"].size()) - 1;
    }

    std::string text() const {
        nlohmann::json j = json;
        if (j["buffers"].empty())
            j["buffers"].push_back({{"byteLength", bytes.size()},
                                    {"uri", "data:application/octet-stream;base64," + base64(bytes)}});
        return j.dump();
    }

    /// The binary container.
    std::string binary() const {
        nlohmann::json j = json;
        j["buffers"].push_back({{"byteLength", bytes.size()}});
        std::string chunk = j.dump();
        while (chunk.size() % 4 != 0) chunk += ' ';
        std::string out = "glTF";
        const auto word = [&](std::size_t v) {
            const auto w = static_cast<std::uint32_t>(v);
            out.append(reinterpret_cast<const char*>(&w), 4);
        };
        word(2);
        word(28 + chunk.size() + bytes.size());
        word(chunk.size());
        out += "JSON" + chunk;
        word(bytes.size());
        out += std::string("BIN\0", 4) + std::string(bytes.begin(), bytes.end());
        return out;
    }
};

/// Adds an animation of one channel.
inline void animate(GltfText& g, int node, const std::string& path, const std::vector<float>& times,
                    const std::vector<float>& values, const std::string& type,
                    const std::string& interpolation = "LINEAR") {
    const int input = g.floats(times, "SCALAR"), output = g.floats(values, type);
    nlohmann::json animation;
    animation["name"] = "play";
    animation["samplers"] = {{{"input", input}, {"output", output}, {"interpolation", interpolation}}};
    animation["channels"] = {{{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}};
    g.json["animations"].push_back(animation);
}

inline void writeText(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

}  // namespace vlx::render
