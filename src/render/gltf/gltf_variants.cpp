#include "render/gltf/gltf_variants.h"

#include <algorithm>

namespace vlx::render {
namespace {

constexpr const char* kVariants = "KHR_materials_variants";

/// The elements of an array that is a member of an object, if it is there.
std::vector<tinygltf::Value> elementsOf(const tinygltf::Value* object, const std::string& key) {
    if (object == nullptr || !object->Has(key) || !object->Get(key).IsArray()) return {};
    return object->Get(key).Get<tinygltf::Value::Array>();
}

}  // namespace

int variantNamed(const GltfFile& file, const std::string& wanted) {
    std::vector<std::string> names;
    for (const tinygltf::Value& variant :
         elementsOf(extension(file.model().extensions, kVariants), "variants"))
        names.push_back(variant.IsObject() && variant.Has("name") && variant.Get("name").IsString()
                            ? variant.Get("name").Get<std::string>()
                            : "");
    if (names.empty()) file.fail("has no variants of materials: leave out --variant");
    if (const auto found = std::ranges::find(names, wanted); found != names.end())
        return static_cast<int>(found - names.begin());
    const bool isNumber =
        !wanted.empty() && wanted.size() < 9 && wanted.find_first_not_of("0123456789") == std::string::npos;
    if (isNumber && std::stoul(wanted) < names.size()) return std::stoi(wanted);
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "'" : ", '") + name + "'";
    file.fail("has no variant '" + wanted + "'; it has " + list);
}

int materialIn(const tinygltf::Primitive& primitive, int variant) {
    if (variant >= 0)
        for (const tinygltf::Value& mapping :
             elementsOf(extension(primitive.extensions, kVariants), "mappings"))
            for (const tinygltf::Value& of : elementsOf(&mapping, "variants"))
                if (of.IsNumber() && of.GetNumberAsInt() == variant)
                    return static_cast<int>(number(mapping, "material", -1));
    return primitive.material;
}

}  // namespace vlx::render
