#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace vlx::render {

/// The glTF file `path` and the files that it names: buffers and images, where it looks for them. Only the
/// file itself if it is no glTF file.
std::vector<std::string> gltfFiles(const std::string& path);

/// The JSON of a text or binary glTF file, whose rest is not read; empty if there is no file that can be
/// read.
std::string gltfJson(const std::string& path);

/// How deep arrays and objects may lie in each other: readers call themselves for each.
inline constexpr int kDeepest = 200;
bool isNestedTooDeep(const std::string& json);

/// Of the JSON of a glTF file, what its cameras need: scenes, nodes with their places, cameras, and where
/// animations move cameras, these with the buffers. Empty if the text is no JSON object or
/// isNestedTooDeep().
std::string camerasAlone(const std::string& json);

/// Checks the uris of a glTF file's buffers: a file that is there, or data in base64 of a kind and of the
/// length that is read; and that those of images are no folders, pipes or devices.
/// Throws Error.
void checkGltfFiles(const std::string& path, const nlohmann::json& root);

/// "no such file", "a folder", "a file that is none of data": what stands in a regular file's place.
std::string kindOf(const std::filesystem::file_status& status);

}  // namespace vlx::render
