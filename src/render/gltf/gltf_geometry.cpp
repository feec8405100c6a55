#include "render/gltf/gltf_geometry.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "render/gltf/gltf_variants.h"

namespace vlx::render {
namespace {

int attribute(const tinygltf::Primitive& primitive, const std::string& name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

constexpr std::uint32_t kMostSteps = 16;
constexpr float kTolerance = 1e-3f;

/// The greatest way that a vertex has from one of two blocks to the other, or from the middle between two.
float greatestWay(const VertexBlock& a, const VertexBlock& b) {
    float way = 0;
    for (std::size_t i = 0; i < a.positions.size(); ++i)
        way = std::max(way, maxComponent(absolute(b.positions[i] - a.positions[i])));
    return way;
}
float offMiddle(const VertexBlock& a, const VertexBlock& middle, const VertexBlock& b) {
    float off = 0;
    for (std::size_t i = 0; i < a.positions.size(); ++i)
        off = std::max(
            off, maxComponent(absolute((a.positions[i] + b.positions[i]) * 0.5f - middle.positions[i])));
    return off;
}

/// Blocks at equal steps of time from 0 to 1; a single one, of the middle, where nothing moves.
std::vector<VertexBlock> followedBlocks(const std::function<VertexBlock(double)>& at) {
    std::vector<VertexBlock> blocks{at(0), at(0.5), at(1)};
    for (;;) {
        const std::size_t steps = blocks.size() - 1;
        std::vector<VertexBlock> finer;
        float extent = 0, off = 0;
        for (std::size_t i = 0; i < steps; ++i) {
            finer.push_back(at((static_cast<double>(i) + 0.5) / static_cast<double>(steps)));
            off = std::max(off, offMiddle(blocks[i], finer.back(), blocks[i + 1]));
            extent = std::max(
                {extent, greatestWay(blocks[0], blocks[i + 1]), greatestWay(blocks[0], finer.back())});
        }
        if (extent == 0) return {blocks[steps / 2]};
        if (off <= kTolerance * extent || steps >= kMostSteps) return blocks;
        std::vector<VertexBlock> both{std::move(blocks[0])};
        for (std::size_t i = 0; i < steps; ++i) {
            both.push_back(std::move(finer[i]));
            both.push_back(std::move(blocks[i + 1]));
        }
        blocks = std::move(both);
    }
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

/// What a mesh is read for.
struct GeometryReader::Use {
    BendAt at;
    bool bends = false;
    bool sequence = false;
    std::string cause;
    std::size_t joints = 0;
};

std::uint32_t GeometryReader::materialOf(const tinygltf::Primitive& primitive,
                                         const std::string& what) const {
    const auto materials = static_cast<int>(scene_.materials.size());  // the last one is the default
    const int material = materialIn(primitive, variant_);
    if (material >= materials - 1)
        file_.fail(what + " refers to material " + std::to_string(material) + ", the file has " +
                   std::to_string(materials - 1));
    return static_cast<std::uint32_t>(material < 0 ? materials - 1 : material);
}

std::vector<VertexBlock> GeometryReader::blocksOf(const PrimitiveVertices& vertices, const Use& use,
                                                  Deformation& deformation) const {
    if (!use.bends) return {vertices.at(use.at(0, 0.5))};
    const auto follow = [&](int frame) {
        return followedBlocks([&](double time) { return vertices.at(use.at(frame, time)); });
    };
    std::vector<VertexBlock> blocks = follow(0);
    deformation.steps = static_cast<std::uint32_t>(blocks.size());
    if (!use.sequence) return blocks;
    std::vector<VertexBlock> before = follow(-1), after = follow(1);
    const std::size_t steps = std::max({blocks.size(), before.size(), after.size()});
    const auto resampled = [&](int frame) {
        std::vector<VertexBlock> list;
        for (std::size_t i = 0; i < steps; ++i)
            list.push_back(vertices.at(
                use.at(frame, steps == 1 ? 0.5 : static_cast<double>(i) / static_cast<double>(steps - 1))));
        return list;
    };
    if (before.size() != steps) before = resampled(-1);
    if (after.size() != steps) after = resampled(1);
    float way = 0;
    for (std::size_t i = 0; i < steps; ++i) {
        const VertexBlock& own = blocks[blocks.size() == 1 ? 0 : std::min(i, blocks.size() - 1)];
        if (blocks.size() == steps || blocks.size() == 1)
            way = std::max({way, greatestWay(own, before[i]), greatestWay(own, after[i])});
        else
            way = 1;  // the neighbours move otherwise
    }
    if (way == 0) return blocks;
    deformation.neighbourSteps = static_cast<std::uint32_t>(steps);
    for (auto* list : {&before, &after})
        for (VertexBlock& block : *list) blocks.push_back(std::move(block));
    return blocks;
}

/// Those that the material's textures use; where the primitive has no such set, its first.
void GeometryReader::readFurtherUvs(const tinygltf::Primitive& primitive, Shape& shape,
                                    const std::string& what) {
    const std::vector<int>& sets = scene_.materials[shape.material].furtherUvSets;
    if (sets.empty()) return;
    shape.firstFurtherUv = static_cast<std::int64_t>(scene_.furtherUvs.size());
    for (const int set : sets) {
        const std::string name = "TEXCOORD_" + std::to_string(set);
        const int accessor = attribute(primitive, name);
        std::vector<float> uvs;
        if (accessor >= 0) {
            uvs = file_.floats(accessor, 2, what + " " + name);
            if (uvs.size() != 2 * std::size_t{shape.vertices})
                file_.fail(what + " " + name + " has " + std::to_string(uvs.size() / 2) +
                           " elements, POSITION " + std::to_string(shape.vertices));
        } else {
            scene_.report.warnings.push_back(what + " has no " + name +
                                             ", which its material uses: TEXCOORD_0 is taken");
        }
        for (std::uint32_t i = 0; i < shape.vertices; ++i)
            scene_.furtherUvs.push_back(accessor < 0
                                            ? scene_.vertices[shape.firstVertex + i].uv
                                            : Vec2{uvs[2 * std::size_t{i}], uvs[2 * std::size_t{i} + 1]});
    }
}

void GeometryReader::readPrimitive(std::size_t mesh, std::size_t index, const Use& use,
                                   std::vector<Shape>& out) {
    const tinygltf::Mesh& source = file_.model().meshes[mesh];
    const tinygltf::Primitive& primitive = source.primitives[index];
    const std::string what =
        described("mesh", mesh, source.name) + (index > 0 ? " primitive " + std::to_string(index) : "");
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
        scene_.report.warnings.push_back(what + ": points and lines are left out");
        return;
    }
    const PrimitiveVertices vertices(file_, primitive, use.joints, what);
    const std::size_t count = vertices.count();
    if (use.joints > 0 && !vertices.skinned())
        scene_.report.warnings.push_back(what + " has no JOINTS_0: it stays where its node is");
    if (const std::string doubt = vertices.doubt(); !doubt.empty())
        scene_.report.warnings.push_back(what + ": " + doubt);
    Deformation deformation;
    deformation.cause = use.cause;
    const std::vector<VertexBlock> blocks = blocksOf(vertices, use, deformation);
    if (scene_.vertices.size() + count * blocks.size() > std::numeric_limits<std::uint32_t>::max())
        file_.fail("more than 2^32 vertices");
    std::vector<float> uvs, colours;
    if (const int accessor = attribute(primitive, "TEXCOORD_0"); accessor >= 0) {
        uvs = file_.floats(accessor, 2, what + " TEXCOORD_0");
        if (uvs.size() != 2 * count)
            file_.fail(what + " TEXCOORD_0 has " + std::to_string(uvs.size() / 2) + " elements, POSITION " +
                       std::to_string(count));
    }
    if (const int accessor = attribute(primitive, "COLOR_0"); accessor >= 0) {
        colours = file_.colours(accessor, what + " COLOR_0");
        if (colours.size() != 4 * count) file_.fail(what + " COLOR_0 has another size than POSITION");
    }

    Shape shape;
    shape.firstVertex = static_cast<std::uint32_t>(scene_.vertices.size());
    shape.vertices = static_cast<std::uint32_t>(count);
    shape.firstTriangle = static_cast<std::uint32_t>(scene_.triangles.size());
    shape.material = materialOf(primitive, what);

    for (const VertexBlock& block : blocks) {
        for (std::size_t i = 0; i < count; ++i) {
            Vertex v;
            v.position = block.positions[i];
            if (!block.normals.empty()) v.normal = block.normals[i];
            if (!uvs.empty()) v.uv = {uvs[2 * i], uvs[2 * i + 1]};
            scene_.vertices.push_back(v);
        }
    }
    const auto corners = triangleIndices(primitive, shape.vertices, what);
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        std::array<std::uint32_t, 3> t{corners[i], corners[i + 1], corners[i + 2]};
        if (blocks[0].mirrored[t[0]]) std::swap(t[1], t[2]);
        for (std::uint32_t& corner : t) corner += shape.firstVertex;
        // Where it deforms: at all times.
        bool flat = true;
        for (std::uint32_t step = 0; step < deformation.steps && flat; ++step) {
            const Vertex* first = scene_.vertices.data() + std::size_t{step} * count;
            flat = degenerate(first[t[0]].position, first[t[1]].position, first[t[2]].position);
        }
        if (flat) {
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
    if (!blocks[0].tangents.empty()) {
        shape.firstTangent = static_cast<std::int64_t>(scene_.tangents.size());
        for (std::uint32_t step = 0; step < deformation.steps; ++step)
            scene_.tangents.insert(scene_.tangents.end(), blocks[step].tangents.begin(),
                                   blocks[step].tangents.end());
    }
    readFurtherUvs(primitive, shape, what);
    if (!colours.empty()) {
        if (std::ranges::any_of(colours, [](float v) { return !(v >= 0); }))
            scene_.report.warnings.push_back(what + ": COLOR_0 has values below 0: 0 is taken");
        shape.firstColour = static_cast<std::int64_t>(scene_.colours.size());
        for (std::size_t i = 0; i < count; ++i) {
            const float* c = &colours[4 * i];
            const auto part = [&](std::size_t k) { return std::max(0.f, c[k]); };
            scene_.colours.push_back({{part(0), part(1), part(2)}, part(3)});
        }
    }
    if (blocks.size() > 1) {
        shape.deformation = static_cast<std::int32_t>(scene_.deformations.size());
        scene_.deformations.push_back(std::move(deformation));
    }
    out.push_back(shape);
}

std::vector<Shape> GeometryReader::read(std::size_t mesh, const Transform& toWorld) {
    const tinygltf::Mesh& source = file_.model().meshes[mesh];
    Use use;
    use.at = [&](int, double) { return Bend{restWeights(source), {}, toWorld}; };
    std::vector<Shape> out;
    for (std::size_t i = 0; i < source.primitives.size(); ++i) readPrimitive(mesh, i, use, out);
    return out;
}

std::vector<Shape> GeometryReader::readBent(std::size_t mesh, const BendAt& at, bool sequence,
                                            const std::string& cause) {
    const Use use{at, true, sequence, cause, at(0, 0.5).joints.size()};
    std::vector<Shape> out;
    for (std::size_t i = 0; i < file_.model().meshes[mesh].primitives.size(); ++i)
        readPrimitive(mesh, i, use, out);
    return out;
}

}  // namespace vlx::render
