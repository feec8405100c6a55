#include "render/light/light_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace vlx::render {
namespace {

/// Intensity towards an unoccluded receiver far off.
float intensityOf(const LightCandidate& light) {
    return light.type == LightType::Mesh ? light.strength * light.area : light.strength;
}

float at(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

LightTree::LightTree(std::span<const LightCandidate> lights) : leafOf_(lights.size()) {
    std::vector<std::uint32_t> order(lights.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_partition(order, [&](std::uint32_t i) { return !lights[i].finite(); });
    nodes_.reserve(2 * lights.size());
    nodes_.emplace_back();
    split(0, lights, order);
}

void LightTree::split(std::uint32_t index, std::span<const LightCandidate> lights,
                      std::span<std::uint32_t> order) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    Vec3 low(inf), high(-inf), centreLow(inf), centreHigh(-inf);
    double strength = 0;
    std::size_t infinite = 0;
    for (const std::uint32_t i : order) {
        const LightCandidate& light = lights[i];
        const Vec3 r(light.radius), p = light.position;
        strength += intensityOf(light);
        infinite += !light.finite();
        const auto grow = [](Vec3& a, Vec3& b, const Vec3& from, const Vec3& to) {
            a = {std::min(a.x, from.x), std::min(a.y, from.y), std::min(a.z, from.z)};
            b = {std::max(b.x, to.x), std::max(b.y, to.y), std::max(b.z, to.z)};
        };
        grow(low, high, p - r, p + r);
        grow(centreLow, centreHigh, p, p);
    }
    Node node = nodes_[index];
    node.low = low;
    node.high = high;
    node.strength = static_cast<float>(strength);
    node.count = static_cast<std::uint32_t>(order.size());
    node.infinite = infinite > 0;
    if (order.size() == 1) {
        node.light = static_cast<std::int32_t>(order[0]);
        leafOf_[order[0]] = index;
        nodes_[index] = node;
        return;
    }
    std::size_t middle = order.size() / 2;
    if (infinite > 0 && infinite < order.size()) {
        middle = infinite;  // they come first
    } else if (infinite == 0) {
        const Vec3 extent = centreHigh - centreLow;
        const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
        std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) {
            return at(lights[a].position, axis) < at(lights[b].position, axis);
        });
    }
    node.left = static_cast<std::uint32_t>(nodes_.size());
    nodes_[index] = node;
    Node child;
    child.parent = index;
    nodes_.push_back(child);
    nodes_.push_back(child);
    split(node.left, lights, order.first(middle));
    split(node.left + 1, lights, order.subspan(middle));
}

float LightTree::importance(std::span<const LightCandidate> lights, const Receiver& receiver,
                            const Node& node) const {
    if (node.light >= 0) return lightImportance(receiver, lights[static_cast<std::size_t>(node.light)]);
    if (node.infinite) return node.strength * kPi;
    const Vec3 to = (node.low + node.high) * 0.5f - receiver.position;
    const float radius = 0.5f * length(node.high - node.low);
    if (belowHorizon(receiver, to, radius)) return 0;
    const float d2 = lengthSquared(to);
    float cosine = 1;
    if (!receiver.bothSides && d2 > radius * radius) {
        // The greatest cosine that a point of the ball has: the centre's angle less the ball's.
        const float d = std::sqrt(d2);
        const float c = dot(to, receiver.normal) / d, sineBall = radius / d;
        const float cosBall = std::sqrt(1 - sineBall * sineBall);
        cosine =
            c >= cosBall ? 1 : std::max(0.f, c * cosBall + std::sqrt(std::max(0.f, 1 - c * c)) * sineBall);
        cosine = std::max(cosine, 1e-3f);
    }
    return node.strength * cosine / std::max(d2, 0.25f * radius * radius);
}

float LightTree::leftShare(std::span<const LightCandidate> lights, const Receiver& receiver,
                           const Node& node) const {
    const Node& left = nodes_[node.left];
    const Node& right = nodes_[node.left + 1];
    const float a = importance(lights, receiver, left), b = importance(lights, receiver, right);
    if (a == 0 && b == 0) return -1;
    if (a == 0) return 0;
    if (b == 0) return 1;
    const float even = static_cast<float>(left.count) / static_cast<float>(node.count);
    // A tenth of the choice in all goes by count; the share of one level compounds over the levels.
    constexpr float kEvenShare = 0.02f;
    return kEvenShare * even + (1 - kEvenShare) * (a / (a + b));
}

LightTree::Choice LightTree::choose(std::span<const LightCandidate> lights, const Receiver& receiver,
                                    float u) const {
    std::uint32_t index = 0;
    float probability = 1, rest = u;
    while (nodes_[index].light < 0) {
        const Node& node = nodes_[index];
        const float share = leftShare(lights, receiver, node);
        if (share < 0) return {};
        const bool goLeft = rest < share;
        const float part = goLeft ? share : 1 - share;
        rest = std::min((goLeft ? rest : rest - share) / part, 0x1.fffffep-1f);
        probability *= part;
        index = goLeft ? node.left : node.left + 1;
    }
    return {static_cast<std::size_t>(nodes_[index].light), probability};
}

float LightTree::probability(std::span<const LightCandidate> lights, const Receiver& receiver,
                             std::size_t light) const {
    float probability = 1;
    for (std::uint32_t index = leafOf_[light]; index != 0; index = nodes_[index].parent) {
        const Node& parent = nodes_[nodes_[index].parent];
        const float share = leftShare(lights, receiver, parent);
        if (share < 0) return 0;
        probability *= index == parent.left ? share : 1 - share;
    }
    return probability;
}

}  // namespace vlx::render
