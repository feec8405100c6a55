#include "render/gltf/gltf_compressed.h"

#include <draco/compression/decode.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>

#include "render/gltf/gltf_file.h"

namespace vlx::render {
namespace {

using OrderedJson = nlohmann::ordered_json;
constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kDraco = "KHR_draco_mesh_compression";

OrderedJson* extensionOf(OrderedJson& object, const char* name) {
    if (!object.is_object() || !object.contains("extensions") || !object["extensions"].contains(name))
        return nullptr;
    return &object["extensions"][name];
}

void eachOf(OrderedJson& object, const char* array, const auto& visit) {
    if (object.is_object() && object.contains(array))
        for (OrderedJson& item : object[array]) visit(item);
}

/// The text of a member of an extension's object, or nothing.
std::string textOf(const tinygltf::Value& object, const char* key) {
    return object.Has(key) && object.Get(key).IsString() ? object.Get(key).Get<std::string>() : "";
}

/// Decoded elements of an attribute, one a point, as components of type T.
template <class T>
bool copyAttribute(const draco::PointAttribute& attribute, std::uint32_t points, std::size_t width,
                   std::vector<unsigned char>& out) {
    out.resize(points * width * sizeof(T));
    for (std::uint32_t i = 0; i < points; ++i) {
        std::array<T, 16> value{};
        if (!attribute.ConvertValue<T>(attribute.mapped_index(draco::PointIndex(i)),
                                       static_cast<std::int8_t>(width), value.data()))
            return false;
        std::memcpy(out.data() + i * width * sizeof(T), value.data(), width * sizeof(T));
    }
    return true;
}

bool copyAs(int componentType, const draco::PointAttribute& attribute, std::uint32_t points,
            std::size_t width, std::vector<unsigned char>& out) {
    switch (componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return copyAttribute<std::int8_t>(attribute, points, width, out);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return copyAttribute<std::uint8_t>(attribute, points, width, out);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return copyAttribute<std::int16_t>(attribute, points, width, out);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return copyAttribute<std::uint16_t>(attribute, points, width, out);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return copyAttribute<std::uint32_t>(attribute, points, width, out);
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return copyAttribute<float>(attribute, points, width, out);
        default:
            return false;
    }
}

/// Appends a buffer with a view of all of it; returns the view's number.
int addView(tinygltf::Model& model, std::vector<unsigned char> bytes) {
    tinygltf::BufferView view;
    view.buffer = static_cast<int>(model.buffers.size());
    view.byteLength = bytes.size();
    model.buffers.emplace_back().data = std::move(bytes);
    model.bufferViews.push_back(std::move(view));
    return static_cast<int>(model.bufferViews.size()) - 1;
}

}  // namespace

std::string withCompressedViews(const std::string& json) {
    if (json.find(kMeshopt) == std::string::npos && json.find(kDraco) == std::string::npos) return json;
    OrderedJson file = OrderedJson::parse(json);
    eachOf(file, "buffers", [](OrderedJson& buffer) {
        const OrderedJson* meshopt = extensionOf(buffer, kMeshopt);
        if (meshopt == nullptr || meshopt->value("fallback", false) == false) return;
        buffer = {{"byteLength", 1}, {"uri", "data:application/octet-stream;base64,AA=="}};
    });
    eachOf(file, "bufferViews", [](OrderedJson& view) {
        const OrderedJson* meshopt = extensionOf(view, kMeshopt);
        if (meshopt == nullptr) return;
        for (const char* key : {"buffer", "byteOffset", "byteLength"})
            view[key] = meshopt->value(key, std::uint64_t{0});
    });
    eachOf(file, "meshes", [&](OrderedJson& mesh) {
        eachOf(mesh, "primitives", [&](OrderedJson& primitive) {
            const OrderedJson* draco = extensionOf(primitive, kDraco);
            if (draco == nullptr) return;
            const auto isPlain = [&](const OrderedJson& accessor) {
                return file["accessors"][accessor.get<std::size_t>()].contains("bufferView");
            };
            const OrderedJson attributes = primitive.value("attributes", OrderedJson::object());
            if (attributes.contains("POSITION") && isPlain(attributes["POSITION"])) {
                primitive["extensions"].erase(kDraco);
            } else if (primitive.contains("indices") && !isPlain(primitive["indices"])) {
                // tinygltf wants to see one.
                file["accessors"][primitive["indices"].get<std::size_t>()]["bufferView"] =
                    draco->value("bufferView", 0);
            }
        });
    });
    return file.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

void GltfFile::decodeMeshopt() {
    for (std::size_t i = 0; i < model_.bufferViews.size(); ++i) {
        const tinygltf::Value* meshopt = extension(model_.bufferViews[i].extensions, kMeshopt);
        if (meshopt == nullptr) continue;
        const std::string what = "bufferView " + std::to_string(i) + " " + kMeshopt;
        const std::span<const unsigned char> bytes = viewBytes(static_cast<int>(i), what);
        const auto whole = [&](const char* key) {
            return static_cast<std::size_t>(std::clamp(number(*meshopt, key, 0), 0.0, 1e15));
        };
        const std::size_t count = whole("count"), stride = whole("byteStride");
        const std::string mode = textOf(*meshopt, "mode"), filter = textOf(*meshopt, "filter");
        const bool attributes = mode == "ATTRIBUTES", triangles = mode == "TRIANGLES";
        // What the library takes for granted, and (of sizes) no more than so many bytes can stand for.
        if (!attributes && !triangles && mode != "INDICES")
            fail(what + " has the mode '" + mode + "', expected ATTRIBUTES, TRIANGLES or INDICES");
        if (attributes ? stride == 0 || stride > 256 || stride % 4 != 0 : stride != 2 && stride != 4)
            fail(what + " has a byteStride of " + std::to_string(stride) + ", expected " +
                 (attributes ? "a multiple of 4 up to 256" : "2 or 4"));
        if (count == 0 || (triangles && count % 3 != 0) || count > 128 * bytes.size() / stride)
            fail(what + " has a count of " + std::to_string(count) + " in " + std::to_string(bytes.size()) +
                 " bytes");
        std::vector<unsigned char> out(count * stride);
        const int fault =
            attributes  ? meshopt_decodeVertexBuffer(out.data(), count, stride, bytes.data(), bytes.size())
            : triangles ? meshopt_decodeIndexBuffer(out.data(), count, stride, bytes.data(), bytes.size())
                        : meshopt_decodeIndexSequence(out.data(), count, stride, bytes.data(), bytes.size());
        if (fault != 0) fail(what + " cannot be decoded: its data is damaged");
        if (filter == "OCTAHEDRAL" && attributes && (stride == 4 || stride == 8)) {
            meshopt_decodeFilterOct(out.data(), count, stride);
        } else if (filter == "QUATERNION" && attributes && stride == 8) {
            meshopt_decodeFilterQuat(out.data(), count, stride);
        } else if (filter == "EXPONENTIAL" && attributes) {
            meshopt_decodeFilterExp(out.data(), count, stride);
        } else if (!filter.empty() && filter != "NONE") {
            fail(what + " has the filter '" + filter + "', which does not go with its byteStride of " +
                 std::to_string(stride));
        }
        tinygltf::BufferView& view = model_.bufferViews[i];
        view.buffer = static_cast<int>(model_.buffers.size());
        view.byteOffset = 0;
        view.byteLength = out.size();
        model_.buffers.emplace_back().data = std::move(out);
    }
}

void GltfFile::decodeDraco(tinygltf::Primitive& primitive, const std::string& what) {
    const tinygltf::Value* compressed = extension(primitive.extensions, kDraco);
    if (compressed == nullptr) return;
    const std::span<const unsigned char> bytes =
        viewBytes(static_cast<int>(number(*compressed, "bufferView", -1)), what);
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) fail(what + " cannot be decoded: " + decoded.status().error_msg_string());
    const draco::Mesh& mesh = *decoded.value();
    // Accessors of their own: others may use what they are copied from.
    const auto replace = [&](int& accessor, std::size_t count, std::vector<unsigned char> data) {
        tinygltf::Accessor own = accessorAt(accessor, what);
        if (own.count != count)
            fail(what + " has " + std::to_string(count) + " elements for accessor " +
                 std::to_string(accessor) + ", which has " + std::to_string(own.count));
        own.bufferView = addView(model_, std::move(data));
        own.byteOffset = 0;
        own.sparse.isSparse = false;
        accessor = static_cast<int>(model_.accessors.size());
        model_.accessors.push_back(std::move(own));
    };
    const tinygltf::Value& attributes = compressed->Get("attributes");
    for (auto& [name, accessor] : primitive.attributes) {
        if (!attributes.IsObject() || !attributes.Has(name)) continue;
        const auto id = static_cast<std::uint32_t>(number(attributes, name, 0));
        const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(id);
        if (attribute == nullptr)
            fail(what + " " + name + " refers to attribute " + std::to_string(id) +
                 ", which is not in the data");
        const tinygltf::Accessor& as = accessorAt(accessor, what);
        const int width = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(as.type));
        std::vector<unsigned char> data;
        if (width < 1 || width > 16 ||
            !copyAs(as.componentType, *attribute, mesh.num_points(), static_cast<std::size_t>(width), data))
            fail(what + " " + name + " cannot be converted to what accessor " + std::to_string(accessor) +
                 " holds");
        replace(accessor, mesh.num_points(), std::move(data));
    }
    if (primitive.indices < 0) fail(what + " has no indices");
    std::vector<unsigned char> corners;
    corners.reserve(std::size_t{mesh.num_faces()} * 12);
    for (std::uint32_t f = 0; f < mesh.num_faces(); ++f)
        for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(f))) {
            const std::uint32_t index = corner.value();
            const auto* first = reinterpret_cast<const unsigned char*>(&index);
            corners.insert(corners.end(), first, first + sizeof index);
        }
    const std::size_t count = corners.size() / sizeof(std::uint32_t);
    tinygltf::Accessor list;
    list.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    list.type = TINYGLTF_TYPE_SCALAR;
    list.count = count;
    list.bufferView = addView(model_, std::move(corners));
    primitive.indices = static_cast<int>(model_.accessors.size());
    model_.accessors.push_back(std::move(list));
    primitive.mode = TINYGLTF_MODE_TRIANGLES;  // strips are encoded as triangles, too
}

void GltfFile::decompress() {
    decodeMeshopt();
    for (std::size_t m = 0; m < model_.meshes.size(); ++m)
        for (std::size_t p = 0; p < model_.meshes[m].primitives.size(); ++p)
            decodeDraco(model_.meshes[m].primitives[p], described("mesh", m, model_.meshes[m].name) +
                                                            " primitive " + std::to_string(p) + " " + kDraco);
}

}  // namespace vlx::render
