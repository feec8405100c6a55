#include "render/gltf/gltf_nodes.h"

#include <algorithm>
#include <cmath>

namespace vlx::render {
namespace {

Transform localTransform(const GltfFile& file, const tinygltf::Node& node, const std::string& what) {
    Transform t;
    if (node.matrix.size() == 16) {
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 4; ++j) t.m[i][j] = node.matrix[j * 4 + i];
    } else {
        Pose pose;
        if (node.rotation.size() == 4)
            std::copy(node.rotation.begin(), node.rotation.end(), pose.rotation.begin());
        if (node.scale.size() == 3) std::copy(node.scale.begin(), node.scale.end(), pose.scale.begin());
        if (node.translation.size() == 3)
            std::copy(node.translation.begin(), node.translation.end(), pose.translation.begin());
        if (std::ranges::all_of(pose.rotation, [](double v) { return v == 0; }))
            file.fail(what + " has a rotation that is no quaternion");
        t = placeOf(pose);
    }
    for (const auto& row : t.m)
        for (const double v : row)
            if (!std::isfinite(v)) file.fail(what + " has a transform that is not finite");
    return t;
}

}  // namespace

NodeTree::NodeTree(const GltfFile& file, const Shutter& shutter, std::vector<std::string>& warnings)
    : file_(file), shutter_(shutter), animations_(file, warnings) {}

const tinygltf::Scene* NodeTree::scene() const {
    const tinygltf::Model& model = file_.model();
    if (model.scenes.empty()) return nullptr;
    const auto which = static_cast<std::size_t>(std::max(0, model.defaultScene));
    if (which >= model.scenes.size())
        file_.fail("refers to scene " + std::to_string(which) + ", it has " +
                   std::to_string(model.scenes.size()));
    return &model.scenes[which];
}

Transform NodeTree::atRest(std::size_t node) const {
    const tinygltf::Node& source = file_.model().nodes[node];
    return localTransform(file_, source, described("node", node, source.name));
}

std::string NodeTree::movesBy(std::size_t node) const {
    const std::int64_t mover = movers_[node];
    return mover < 0 ? std::string() : animations_.causeOf(static_cast<std::size_t>(mover));
}

Transform NodeTree::placeAt(std::size_t node, double seconds) const {
    Transform place;
    for (auto n = static_cast<std::int64_t>(node); n >= 0; n = parents_[static_cast<std::size_t>(n)]) {
        const auto i = static_cast<std::size_t>(n);
        place = (animations_.causeOf(i).empty() ? atRest(i) : animations_.local(i, seconds)) * place;
    }
    return place;
}

/// While the shutter is open so much later than in this frame: one place where the node stays.
Motion NodeTree::motionOf(std::size_t node, double later) const {
    const double open = shutter_.open + later, close = shutter_.close + later;
    Motion motion;
    if (close > open) motion = followed([&](double t) { return placeAt(node, open + t * (close - open)); });
    if (!motion.moves()) motion.places = {placeAt(node, 0.5 * (open + close))};
    motion.cause = movesBy(node);
    return motion;
}

std::optional<Course> NodeTree::courseOf(std::size_t node, const Motion& own) const {
    if (shutter_.frame == 0) return {};
    Course course{motionOf(node, -shutter_.frame), motionOf(node, shutter_.frame)};
    bool elsewhere = false;
    for (Motion* other : {&course.before, &course.after}) {
        if (alike(own, *other))
            *other = own;  // not off by rounding
        else
            elsewhere = true;
    }
    return elsewhere ? std::optional(course) : std::nullopt;
}

std::string NodeTree::faultOfParents(std::size_t node, std::int64_t parent) const {
    const auto name = [&](std::size_t n) { return described("node", n, file_.model().nodes[n].name); };
    for (std::int64_t n = parent; n >= 0; n = parents_[static_cast<std::size_t>(n)])
        if (static_cast<std::size_t>(n) == node)
            return name(node) + " is below itself: it is a child of " +
                   (parent == n ? "its own" : name(static_cast<std::size_t>(parent)));
    return name(node) + " has more than one parent";
}

std::vector<PlacedNode> NodeTree::placed() {
    const tinygltf::Model& model = file_.model();
    const tinygltf::Scene* const shown = scene();
    const std::vector<int> roots = shown != nullptr ? shown->nodes : std::vector<int>{};
    struct Pending {
        int node;
        Transform parent;
        std::int64_t parentNode;  ///< -1: a root
    };
    std::vector<Pending> stack;
    std::vector<char> visited(model.nodes.size(), 0);
    parents_.assign(model.nodes.size(), -2);
    movers_.assign(model.nodes.size(), -1);
    std::vector<PlacedNode> placed;
    for (auto r = roots.rbegin(); r != roots.rend(); ++r) stack.push_back({*r, {}, -1});
    while (!stack.empty()) {
        const Pending next = stack.back();
        stack.pop_back();
        if (next.node < 0 || static_cast<std::size_t>(next.node) >= model.nodes.size())
            file_.fail("refers to node " + std::to_string(next.node) + ", it has " +
                       std::to_string(model.nodes.size()));
        const auto index = static_cast<std::size_t>(next.node);
        const tinygltf::Node& node = model.nodes[index];
        if (visited[index]++) file_.fail(faultOfParents(index, next.parentNode));
        parents_[index] = next.parentNode;
        // Known of the parent: chains may be long.
        if (!animations_.causeOf(index).empty())
            movers_[index] = next.node;
        else if (next.parentNode >= 0)
            movers_[index] = movers_[static_cast<std::size_t>(next.parentNode)];
        PlacedNode& at = placed.emplace_back();
        at.node = index;
        if (movesBy(index).empty()) {
            at.toWorld = next.parent * atRest(index);
        } else {
            at.toWorld = placeAt(index, 0.5 * (shutter_.open + shutter_.close));
            at.motion = motionOf(index, 0);
            at.course = courseOf(index, at.motion);
            if (!at.motion.moves()) at.motion = {};
        }
        for (auto c = node.children.rbegin(); c != node.children.rend(); ++c)
            stack.push_back({*c, at.toWorld, static_cast<std::int64_t>(index)});
    }
    return placed;
}

}  // namespace vlx::render
