#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/gltf/gltf_dialect.h"
#include "render/gltf/gltf_file.h"
#include "render/scene/material.h"

namespace vlx::render {

/// Reads materials and, once each, the textures they use.
class MaterialReader {
  public:
    /// Appends textures to `textures`.
    MaterialReader(const GltfFile& file, std::vector<Texture>& textures)
        : file_(file), textures_(textures), retro_(dialectOf(file.model()).oldBlender()) {}

    Material read(const tinygltf::Material& source, std::size_t index);

  private:
    TextureRef texture(int index, int uvSet, const tinygltf::ExtensionMap& extensions, ColourSpace space,
                       const std::string& what);
    TextureRef texture(const tinygltf::Value& object, const std::string& key, ColourSpace space,
                       const std::string& what);
    Texture load(const tinygltf::Texture& source, int index, ColourSpace space, const std::string& what,
                 std::optional<float> glossiness = {}) const;
    int slotOf(int uvSet);
    void readUnlit(Material& material) const;
    void readGlossiness(Material& material, const tinygltf::Value& source, const std::string& what);

    const GltfFile& file_;
    std::vector<Texture>& textures_;
    bool retro_;
    std::map<std::pair<int, ColourSpace>, int> loaded_;
    std::vector<int> furtherUvSets_;  ///< of the material that is being read
};

}  // namespace vlx::render
