#include "render/gltf/gltf_bend.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/text.h"

namespace vlx::render {
namespace {

/// A unit vector, or zero where the input has none (the triangle's own normal is taken then).
Vec3 unitOrZero(const Vec3& v) {
    const float norm = length(v);
    return norm > 1e-30f && std::isfinite(norm) ? v / norm : Vec3{};
}

Vec3 vec3At(const std::vector<float>& values, std::size_t i, std::size_t stride = 3) {
    return {values[stride * i], values[stride * i + 1], values[stride * i + 2]};
}

std::vector<Vec3> vec3s(const std::vector<float>& values) {
    std::vector<Vec3> v(values.size() / 3);
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = vec3At(values, i);
    return v;
}

int accessorOf(const std::map<std::string, int>& attributes, const std::string& name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

}  // namespace

std::vector<double> restWeights(const tinygltf::Mesh& mesh) {
    std::size_t targets = 0;
    for (const tinygltf::Primitive& p : mesh.primitives) targets = std::max(targets, p.targets.size());
    std::vector<double> weights = mesh.weights;
    weights.resize(targets, 0);
    return weights;
}

bool Bends::bends(std::size_t node) const {
    const tinygltf::Node& source = file_.model().nodes[node];
    return source.skin >= 0 || (!source.weights.empty() && morphTargets(file_.model(), node) > 0) ||
           !nodes_.animations().morphCauseOf(node).empty();
}

std::string Bends::causeOf(std::size_t node) const {
    std::string cause = nodes_.animations().morphCauseOf(node);
    const int skin = file_.model().nodes[node].skin;
    if (cause.empty() && skin < 0) cause = nodes_.movesBy(node);
    if (cause.empty() && skin >= 0)
        for (const int joint : file_.model().skins[static_cast<std::size_t>(skin)].joints)
            if (cause = nodes_.movesBy(static_cast<std::size_t>(joint)); !cause.empty()) break;
    return cause;
}

Bend Bends::at(std::size_t node, int frame, double time) {
    const tinygltf::Model& model = file_.model();
    const tinygltf::Node& source = model.nodes[node];
    const Shutter& shutter = nodes_.shutter();
    const double seconds = shutter.open + time * (shutter.close - shutter.open) + frame * shutter.frame;
    Bend bend;
    bend.toWorld = nodes_.placeAt(node, seconds);
    if (auto animated = nodes_.animations().weights(node, seconds)) {
        bend.weights = std::move(*animated);
    } else {
        bend.weights = restWeights(model.meshes[static_cast<std::size_t>(source.mesh)]);
        std::copy_n(source.weights.begin(), std::min(source.weights.size(), bend.weights.size()),
                    bend.weights.begin());
    }
    if (source.skin < 0) return bend;
    const auto skin = static_cast<std::size_t>(source.skin);
    const std::vector<Transform>& binds = inverseBinds(skin);
    const std::vector<int>& joints = model.skins[skin].joints;
    for (std::size_t i = 0; i < joints.size(); ++i) {
        const auto joint = static_cast<std::size_t>(joints[i]);
        if (!nodes_.isPlaced(joint))
            file_.fail(described("skin", skin, model.skins[skin].name) + " has the joint " +
                       described("node", joint, model.nodes[joint].name) + ", which is not in the scene");
        bend.joints.push_back(nodes_.placeAt(joint, seconds) * binds[i]);
    }
    return bend;
}

const std::vector<Transform>& Bends::inverseBinds(std::size_t index) {
    const auto [found, isNew] = inverseBinds_.try_emplace(index);
    if (!isNew) return found->second;
    const tinygltf::Skin& skin = file_.model().skins[index];
    const std::string what = described("skin", index, skin.name);
    if (skin.joints.empty()) file_.fail(what + " has no joints");
    std::vector<Transform>& binds = found->second;
    binds.resize(skin.joints.size());
    if (skin.inverseBindMatrices < 0) return binds;  // the specification: identities
    const std::vector<float> m = file_.floats(skin.inverseBindMatrices, 16, what + " inverseBindMatrices");
    if (m.size() < 16 * binds.size())
        file_.fail(what + " has " + std::to_string(m.size() / 16) + " inverse bind matrices, expected " +
                   std::to_string(binds.size()) + ", one for each joint");
    for (std::size_t b = 0; b < binds.size(); ++b)
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 4; ++j) {
                const float v = m[16 * b + 4 * j + i];
                if (!std::isfinite(v))
                    file_.fail(what + ": inverse bind matrix " + std::to_string(b) + " is not finite");
                binds[b].m[i][j] = static_cast<double>(v);
            }
    return binds;
}

PrimitiveVertices::PrimitiveVertices(const GltfFile& file, const tinygltf::Primitive& primitive,
                                     std::size_t joints, const std::string& what)
    : file_(file), what_(what) {
    const int position = accessorOf(primitive.attributes, "POSITION");
    if (position < 0) file_.fail(what + " has no POSITION");
    positions_ = vec3s(file_.floats(position, 3, what + " POSITION"));
    normals_ = vec3s(optional(primitive, "NORMAL", 3));
    tangents_ = optional(primitive, "TANGENT", 4);
    for (std::size_t t = 0; t < primitive.targets.size(); ++t) {
        Target& target = targets_.emplace_back();
        const auto differences = [&](const char* name) {
            const int accessor = accessorOf(primitive.targets[t], name);
            if (accessor < 0) return std::vector<float>();
            const std::string place = what + " target " + std::to_string(t) + " " + name;
            std::vector<float> v = file_.floats(accessor, 3, place);
            if (v.size() != 3 * count())
                file_.fail(place + " has " + std::to_string(v.size() / 3) + " elements, POSITION " +
                           std::to_string(count()));
            return v;
        };
        target.positions = differences("POSITION");
        if (!normals_.empty()) target.normals = differences("NORMAL");
        if (!tangents_.empty()) target.tangents = differences("TANGENT");
    }
    if (joints > 0) readInfluences(primitive, joints);
}

std::vector<float> PrimitiveVertices::optional(const tinygltf::Primitive& primitive, const char* name,
                                               int components) const {
    const int accessor = accessorOf(primitive.attributes, name);
    if (accessor < 0) return {};
    std::vector<float> v = file_.floats(accessor, components, what_ + " " + name);
    const auto each = static_cast<std::size_t>(components);
    if (v.size() != count() * each)
        file_.fail(what_ + " " + name + " has " + std::to_string(v.size() / each) + " elements, POSITION " +
                   std::to_string(count()));
    return v;
}

void PrimitiveVertices::readInfluences(const tinygltf::Primitive& primitive, std::size_t joints) {
    std::size_t sets = 0;
    while (accessorOf(primitive.attributes, "JOINTS_" + std::to_string(sets)) >= 0) ++sets;
    influencesEach_ = 4 * sets;
    influences_.resize(count() * influencesEach_);
    for (std::size_t set = 0; set < sets; ++set) {
        const std::string number = std::to_string(set), joint = "JOINTS_" + number,
                          weight = "WEIGHTS_" + number;
        if (accessorOf(primitive.attributes, weight) < 0)
            file_.fail(what_ + " has " + joint + ", but no " + weight);
        const std::vector<std::uint32_t> which =
            file_.indices(accessorOf(primitive.attributes, joint), what_ + " " + joint, 4);
        if (which.size() != 4 * count())
            file_.fail(what_ + " " + joint + " has " + std::to_string(which.size() / 4) +
                       " elements, POSITION " + std::to_string(count()));
        const std::vector<float> weights = optional(primitive, weight.c_str(), 4);
        for (std::size_t i = 0; i < which.size(); ++i) {
            const std::string vertex = what_ + ": vertex " + std::to_string(i / 4);
            if (!(weights[i] >= 0) || !std::isfinite(weights[i]))
                file_.fail(vertex + " has a weight of " + std::to_string(weights[i]) + " in " + weight +
                           ", expected finite and >= 0");
            Influence& influence = influences_[i / 4 * influencesEach_ + 4 * set + i % 4];
            if (weights[i] == 0) continue;  // whatever the joint
            if (which[i] >= joints)
                file_.fail(vertex + " refers to joint " + std::to_string(which[i]) + " in " + joint +
                           ", the skin has " + std::to_string(joints));
            influence = {which[i], weights[i]};
        }
    }
    for (std::size_t v = 0; sets > 0 && v < count(); ++v) {
        const auto each = std::span(influences_).subspan(v * influencesEach_, influencesEach_);
        float sum = 0;
        for (const Influence& i : each) sum += i.weight;
        if (std::abs(sum - 1) > 0.02f && scaled_++ == 0) firstScaled_ = {v, sum};  // bytes round
        if (!(sum > 0 && std::isfinite(sum)))
            file_.fail(what_ + ": the weights of vertex " + std::to_string(v) + " add up to " +
                       std::to_string(sum) + ", expected 1");
        for (Influence& i : each) i.weight /= sum;
    }
}

std::string PrimitiveVertices::doubt() const {
    if (scaled_ == 0) return {};
    return "the weights of " + std::to_string(scaled_) + " of its " + std::to_string(count()) +
           " vertices do not add up to 1 (those of vertex " + std::to_string(firstScaled_.first) + " to " +
           formatted("%.3g", static_cast<double>(firstScaled_.second)) + "): they are scaled to it";
}

/// Linear blend skinning: the mean of the joints' transforms.
Transform PrimitiveVertices::placeOf(std::size_t vertex, const Bend& bend) const {
    if (bend.joints.empty() || !skinned()) return bend.toWorld;
    Transform mean;
    mean.m = {};
    for (std::size_t k = 0; k < influencesEach_; ++k) {
        const Influence& influence = influences_[vertex * influencesEach_ + k];
        if (influence.weight == 0) continue;
        const Transform& joint = bend.joints[influence.joint];
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 4; ++j)
                mean.m[i][j] += static_cast<double>(influence.weight) * joint.m[i][j];
    }
    return mean;
}

VertexBlock PrimitiveVertices::at(const Bend& bend) const {
    VertexBlock block;
    block.positions.resize(count());
    block.mirrored.resize(count());
    if (!normals_.empty()) block.normals.resize(count());
    if (!tangents_.empty()) block.tangents.resize(count());
    const auto morphed = [&](Vec3 v, std::vector<float> Target::*differences, std::size_t i) {
        for (std::size_t t = 0; t < std::min(targets_.size(), bend.weights.size()); ++t) {
            const std::vector<float>& d = targets_[t].*differences;
            if (bend.weights[t] != 0 && !d.empty())
                v = v + vec3At(d, i) * static_cast<float>(bend.weights[t]);
        }
        return v;
    };
    for (std::size_t i = 0; i < count(); ++i) {
        const Transform place = placeOf(i, bend);
        block.positions[i] = place.point(morphed(positions_[i], &Target::positions, i));
        if (!isFinite(block.positions[i]))
            file_.fail(what_ + ": vertex " + std::to_string(i) + " is not finite");
        block.mirrored[i] = place.determinant() < 0;
        if (!normals_.empty())
            block.normals[i] =
                unitOrZero(place.normal(unitOrZero(morphed(normals_[i], &Target::normals, i))));
        if (tangents_.empty()) continue;
        const Vec3 direction = morphed(vec3At(tangents_, i, 4), &Target::tangents, i);
        const float sign = (tangents_[4 * i + 3] < 0) != (block.mirrored[i] != 0) ? -1.f : 1.f;
        block.tangents[i] = {unitOrZero(place.vector(direction)), sign};
    }
    return block;
}

}  // namespace vlx::render
