#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "render/gltf/check/gltf_check.h"
#include "render/scene/texture.h"

namespace vlx::render {

/// A parsed glTF file. Its JSON is checked first (check/gltf_check.h), the bytes that references lead to when
/// they are followed: tinygltf does neither.
class GltfFile {
  public:
    /// What is wanted of a file; the rest is not read, and may be broken.
    enum class Use { Scene, Cameras };

    /// Parses the file, loads its buffers, and decodes those that meshopt or Draco has compressed; images
    /// stay encoded.
    explicit GltfFile(const std::string& path, Use use = Use::Scene);

    const std::string& path() const { return path_; }
    const tinygltf::Model& model() const { return model_; }
    /// Whether a camera's aspectRatio is 0, not just missing.
    bool zeroAspect(std::size_t camera) const { return facts_.zeroAspects[camera]; }
    /// Of values that are taken as others.
    const std::vector<std::string>& warnings() const { return facts_.warnings; }

    [[noreturn]] void fail(const std::string& message) const;

    /// The elements of an accessor, `components` floats each; normalised integers are mapped to [0, 1] or
    /// [-1, 1]; sparse substitutions applied. `what` names the accessor's use in messages.
    std::vector<float> floats(int accessor, int components, const std::string& what) const;
    /// The same for vectors of 3 or 4 components (colours): 4 floats each, the fourth 1 when missing.
    std::vector<float> colours(int accessor, const std::string& what) const;
    /// The values of an accessor of unsigned integers, `components` each.
    std::vector<std::uint32_t> indices(int accessor, const std::string& what, int components = 1) const;

    /// The image decoded, four channels. `glossiness`: green becomes the roughness, 1 - it x alpha.
    Texture image(int index, ColourSpace space, std::optional<float> glossiness = {}) const;

  private:
    struct Elements;
    const tinygltf::Accessor& accessorAt(int index, const std::string& what) const;
    std::span<const unsigned char> viewBytes(int bufferView, const std::string& what) const;
    std::span<const unsigned char> rangeOf(int bufferView, std::size_t offset, std::size_t count,
                                           std::size_t stride, std::size_t size,
                                           const std::string& what) const;
    std::vector<double> values(int accessor, int components, const std::string& what) const;
    // gltf_compressed.cpp: compressed bufferViews and primitives are made plain ones.
    void decompress();
    void decodeMeshopt();
    void decodeDraco(tinygltf::Primitive& primitive, const std::string& what);

    std::string path_;
    GltfFacts facts_;
    tinygltf::Model model_;
};

/// An object of an extension of `element`, or null.
const tinygltf::Value* extension(const tinygltf::ExtensionMap& extensions, const std::string& name);

/// A number of an object, or `fallback` when it is missing or no number.
double number(const tinygltf::Value& object, const std::string& key, double fallback);

/// A name for messages: "mesh 3 'chair'".
std::string described(std::string_view kind, std::size_t index, const std::string& name);

}  // namespace vlx::render
