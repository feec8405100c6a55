#include "render/gltf/gltf_geometry.h"

#include <limits>
#include <numeric>

namespace vlx::render {
namespace {

int attribute(const tinygltf::Primitive& primitive, const char* name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

Vec3 vec3At(const std::vector<float>& values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

/// A unit vector, or zero where the input has none (the triangle's own normal is taken then).
Vec3 unitOrZero(const Vec3& v) {
    const float norm = length(v);
    return norm > 1e-30f && std::isfinite(norm) ? v / norm : Vec3{};
}

/// Whether a triangle has no area in float: corners that coincide or lie on a line.
bool degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 n = cross(b - a, c - a);
    return !(maxComponent(absolute(n)) > std::numeric_limits<float>::min());
}

}  // namespace

/// The corners of all triangles, strips and fans taken apart.
std::vector<std::uint32_t> GeometryReader::triangleIndices(const tinygltf::Primitive& primitive,
                                                           std::uint32_t vertices,
                                                           const std::string& what) const {
    std::vector<std::uint32_t> list;
    if (primitive.indices >= 0) {
        list = file_.indices(primitive.indices, what + " indices");
    } else {
        list.resize(vertices);
        std::iota(list.begin(), list.end(), 0u);
    }
    for (std::size_t i = 0; i < list.size(); ++i)
        if (list[i] >= vertices)
            file_.fail(what + ": index " + std::to_string(i) + " is " + std::to_string(list[i]) +
                       ", it has " + std::to_string(vertices) + " vertices");
    std::vector<std::uint32_t> corners;
    const std::size_t n = list.size();
    if (primitive.mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
        for (std::size_t i = 0; i + 2 < n; ++i)
            corners.insert(corners.end(), {list[i], list[i + 1 + i % 2], list[i + 2 - i % 2]});
    } else if (primitive.mode == TINYGLTF_MODE_TRIANGLE_FAN) {
        for (std::size_t i = 1; i + 1 < n; ++i)
            corners.insert(corners.end(), {list[i], list[i + 1], list[0]});
    } else {
        list.resize(n - n % 3);
        corners = std::move(list);
    }
    return corners;
}

void GeometryReader::readPrimitive(std::size_t mesh, std::size_t index, const Transform& toWorld,
                                   std::vector<Shape>& out) {
    const tinygltf::Mesh& source = file_.model().meshes[mesh];
    const tinygltf::Primitive& primitive = source.primitives[index];
    const std::string what =
        described("mesh", mesh, source.name) + (index > 0 ? " primitive " + std::to_string(index) : "");
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        scene_.report.warnings.push_back(what + ": points and lines are left out");
        return;
    }
    if (!primitive.targets.empty())
        scene_.report.warnings.push_back(what + ": morph targets are left at rest");

    const int positionAccessor = attribute(primitive, "POSITION");
    if (positionAccessor < 0) file_.fail(what + " has no POSITION");
    const std::vector<float> positions = file_.floats(positionAccessor, 3, what + " POSITION");
    const std::size_t count = positions.size() / 3;
    if (scene_.vertices.size() + count > std::numeric_limits<std::uint32_t>::max())
        file_.fail("more than 2^32 vertices");
    const auto optional = [&](const char* name, int components) {
        const int accessor = attribute(primitive, name);
        if (accessor < 0) return std::vector<float>();
        std::vector<float> v = file_.floats(accessor, components, what + " " + name);
        if (v.size() != count * static_cast<std::size_t>(components))
            file_.fail(what + " " + name + " has " +
                       std::to_string(v.size() / static_cast<std::size_t>(components)) +
                       " elements, POSITION " + std::to_string(count));
        return v;
    };
    const std::vector<float> normals = optional("NORMAL", 3), uvs = optional("TEXCOORD_0", 2),
                             secondUvs = optional("TEXCOORD_1", 2), tangents = optional("TANGENT", 4);
    std::vector<float> colours;
    if (const int accessor = attribute(primitive, "COLOR_0"); accessor >= 0) {
        colours = file_.colours(accessor, what + " COLOR_0");
        if (colours.size() != 4 * count) file_.fail(what + " COLOR_0 has another size than POSITION");
    }

    Shape shape;
    shape.firstVertex = static_cast<std::uint32_t>(scene_.vertices.size());
    shape.vertices = static_cast<std::uint32_t>(count);
    shape.firstTriangle = static_cast<std::uint32_t>(scene_.triangles.size());
    const auto materials = static_cast<int>(scene_.materials.size());  // the last one is the default
    if (primitive.material >= materials - 1)
        file_.fail(what + " refers to material " + std::to_string(primitive.material) + ", the file has " +
                   std::to_string(materials - 1));
    shape.material = static_cast<std::uint32_t>(primitive.material < 0 ? materials - 1 : primitive.material);

    for (std::size_t i = 0; i < count; ++i) {
        Vertex v;
        v.position = toWorld.point(vec3At(positions, i));
        if (!isFinite(v.position)) file_.fail(what + ": vertex " + std::to_string(i) + " is not finite");
        if (!normals.empty()) v.normal = unitOrZero(toWorld.normal(unitOrZero(vec3At(normals, i))));
        if (!uvs.empty()) v.uv = {uvs[2 * i], uvs[2 * i + 1]};
        scene_.vertices.push_back(v);
    }
    const bool mirrored = toWorld.determinant() < 0;
    const auto corners = triangleIndices(primitive, shape.vertices, what);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        std::array<std::uint32_t, 3> t{corners[i], corners[i + 1], corners[i + 2]};
        if (mirrored) std::swap(t[1], t[2]);
        for (std::uint32_t& corner : t) corner += shape.firstVertex;
        if (degenerate(scene_.vertices[t[0]].position, scene_.vertices[t[1]].position,
                       scene_.vertices[t[2]].position)) {
            ++scene_.report.degenerateTriangles;
            continue;
        }
        scene_.triangles.push_back(t);
    }
    shape.triangles = static_cast<std::uint32_t>(scene_.triangles.size()) - shape.firstTriangle;
    if (shape.triangles == 0) {
        scene_.vertices.resize(shape.firstVertex);
        return;
    }
    if (!tangents.empty()) {
        shape.firstTangent = static_cast<std::int64_t>(scene_.tangents.size());
        for (std::size_t i = 0; i < count; ++i) {
            const float* t = &tangents[4 * i];
            const float sign = (t[3] < 0) != mirrored ? -1.f : 1.f;
            scene_.tangents.push_back({unitOrZero(toWorld.vector({t[0], t[1], t[2]})), sign});
        }
    }
    if (!secondUvs.empty()) {
        shape.firstSecondUv = static_cast<std::int64_t>(scene_.secondUvs.size());
        for (std::size_t i = 0; i < count; ++i)
            scene_.secondUvs.push_back({secondUvs[2 * i], secondUvs[2 * i + 1]});
    }
    if (!colours.empty()) {
        shape.firstColour = static_cast<std::int64_t>(scene_.colours.size());
        for (std::size_t i = 0; i < count; ++i) {
            const float* c = &colours[4 * i];
            scene_.colours.push_back({{c[0], c[1], c[2]}, c[3]});
        }
    }
    out.push_back(shape);
}

std::vector<Shape> GeometryReader::read(std::size_t mesh, const Transform& toWorld) {
    std::vector<Shape> out;
    for (std::size_t i = 0; i < file_.model().meshes[mesh].primitives.size(); ++i)
        readPrimitive(mesh, i, toWorld, out);
    return out;
}

}  // namespace vlx::render
