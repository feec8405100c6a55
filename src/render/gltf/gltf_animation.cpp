#include "render/gltf/gltf_animation.h"

#include <algorithm>
#include <cmath>

namespace vlx::render {
namespace {

std::vector<double> slerp(const std::vector<double>& a, std::vector<double> b, double t) {
    double cosine = 0;
    for (std::size_t i = 0; i < 4; ++i) cosine += a[i] * b[i];
    if (cosine < 0) {  // the shorter way round
        for (double& v : b) v = -v;
        cosine = -cosine;
    }
    const double angle = std::acos(std::min(1.0, cosine));
    const double sine = std::sin(angle);
    const double wa = sine > 1e-6 ? std::sin((1 - t) * angle) / sine : 1 - t;
    const double wb = sine > 1e-6 ? std::sin(t * angle) / sine : t;
    std::vector<double> r(4);
    for (std::size_t i = 0; i < 4; ++i) r[i] = wa * a[i] + wb * b[i];
    return r;
}

}  // namespace

std::size_t morphTargets(const tinygltf::Model& model, std::size_t node) {
    const int mesh = model.nodes[node].mesh;
    if (mesh < 0 || static_cast<std::size_t>(mesh) >= model.meshes.size()) return 0;
    std::size_t targets = 0;
    for (const tinygltf::Primitive& p : model.meshes[static_cast<std::size_t>(mesh)].primitives)
        targets = std::max(targets, p.targets.size());
    return targets;
}

Transform placeOf(const Pose& pose) {
    const auto& q = pose.rotation;
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double x = q[0] / norm, y = q[1] / norm, z = q[2] / norm, w = q[3] / norm;
    Transform t;
    t.m = {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0},
            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0},
            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0}}};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) t.m[i][j] *= pose.scale[j];
        t.m[i][3] = pose.translation[i];
    }
    return t;
}

Animations::Animations(const GltfFile& file, std::vector<std::string>& warnings)
    : file_(file), warnings_(warnings) {
    const auto& animations = file.model().animations;
    for (std::size_t a = 0; a < animations.size(); ++a)
        for (std::size_t c = 0; c < animations[a].channels.size(); ++c) readChannel(a, c);
}

void Animations::readChannel(std::size_t animation, std::size_t index) {
    const tinygltf::Model& model = file_.model();
    const tinygltf::Animation& source = model.animations[animation];
    const tinygltf::AnimationChannel& channel = source.channels[index];
    const std::string name = described("animation", animation, source.name);
    const std::string what = name + " channel " + std::to_string(index);
    if (channel.target_node < 0) return;  // the specification: to be ignored
    const auto node = static_cast<std::size_t>(channel.target_node);
    if (node >= model.nodes.size())
        file_.fail(what + " refers to node " + std::to_string(node) + ", the file has " +
                   std::to_string(model.nodes.size()));
    const std::map<std::string, Property> properties = {{"translation", Property::Translation},
                                                        {"rotation", Property::Rotation},
                                                        {"scale", Property::Scale},
                                                        {"weights", Property::Weights}};
    const auto property = properties.find(channel.target_path);
    const std::size_t width = property == properties.end() ? 0 : widthOf(property->second, node);
    if (width == 0) {
        warnings_.push_back(what + " animates '" + channel.target_path + "'" +
                            (property == properties.end() ? "" : " of a mesh without morph targets") +
                            ": left at rest");
        return;
    }
    if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= source.samplers.size())
        file_.fail(what + " refers to sampler " + std::to_string(channel.sampler) + ", the animation has " +
                   std::to_string(source.samplers.size()));
    const tinygltf::AnimationSampler& sampler = source.samplers[static_cast<std::size_t>(channel.sampler)];
    Channel out;
    out.property = property->second;
    out.width = width;
    out.interpolation = sampler.interpolation == "STEP"          ? Interpolation::Step
                        : sampler.interpolation == "CUBICSPLINE" ? Interpolation::Cubic
                                                                 : Interpolation::Linear;
    const auto doubles = [](const std::vector<float>& v) { return std::vector<double>(v.begin(), v.end()); };
    out.times = doubles(file_.floats(sampler.input, 1, what + " times"));
    const bool morphs = out.property == Property::Weights;  // whose values are single numbers
    out.values =
        doubles(file_.floats(sampler.output, morphs ? 1 : static_cast<int>(width), what + " values"));
    if (out.times.empty()) {
        warnings_.push_back(what + " has no keys: " + described("node", node, model.nodes[node].name) +
                            " is left at rest");
        return;
    }
    for (std::size_t i = 0; i < out.times.size(); ++i)
        if (!std::isfinite(out.times[i]) || (i > 0 && !(out.times[i] > out.times[i - 1])))
            file_.fail(what + ": times must be finite and ascend, key " + std::to_string(i) + " is at " +
                       std::to_string(out.times[i]));
    lastKey_ = std::max(lastKey_, out.times.back());
    const std::size_t wanted = out.times.size() * width * (out.interpolation == Interpolation::Cubic ? 3 : 1);
    if (out.values.size() != wanted)
        file_.fail(what + " has " + std::to_string(out.values.size() / (morphs ? 1 : width)) +
                   " values, expected " + std::to_string(wanted / (morphs ? 1 : width)) + " for " +
                   std::to_string(out.times.size()) + " keys");
    if (!std::ranges::all_of(out.values, [](double v) { return std::isfinite(v); }))
        file_.fail(what + " has values that are not finite");

    const std::string twice = what + " animates what another channel does already: left out";
    if (morphs) {
        const bool first =
            morphed_
                .emplace(node, Morphed{name + " morphs " + described("node", node, model.nodes[node].name),
                                       std::move(out)})
                .second;
        if (!first) warnings_.push_back(twice);
        return;
    }
    Animated& animated = nodes_[node];
    if (animated.channels.empty()) {
        const tinygltf::Node& n = model.nodes[node];
        if (n.translation.size() == 3)
            std::copy(n.translation.begin(), n.translation.end(), animated.rest.translation.begin());
        if (n.rotation.size() == 4)
            std::copy(n.rotation.begin(), n.rotation.end(), animated.rest.rotation.begin());
        if (n.scale.size() == 3) std::copy(n.scale.begin(), n.scale.end(), animated.rest.scale.begin());
        animated.cause = name + " moves " + described("node", node, n.name);
    }
    if (std::ranges::any_of(animated.channels,
                            [&](const Channel& c) { return c.property == out.property; })) {
        warnings_.push_back(twice);
        return;
    }
    animated.channels.push_back(std::move(out));
}

/// How many numbers a key has; 0: there is nothing to animate.
std::size_t Animations::widthOf(Property property, std::size_t node) const {
    if (property == Property::Weights) return morphTargets(file_.model(), node);
    return property == Property::Rotation ? 4 : 3;
}

std::vector<double> Animations::Channel::at(double seconds) const {
    const std::size_t w = width;
    const bool cubic = interpolation == Interpolation::Cubic;
    const std::size_t stride = cubic ? 3 * w : w;
    const auto value = [&](std::size_t key, std::size_t part) {
        const auto first = values.begin() + static_cast<std::ptrdiff_t>(key * stride + part * w);
        return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(w));
    };
    const std::size_t middle = cubic ? 1 : 0;
    const auto after = std::ranges::upper_bound(times, seconds);
    if (after == times.begin()) return value(0, middle);
    if (after == times.end()) return value(times.size() - 1, middle);
    const auto next = static_cast<std::size_t>(after - times.begin());
    const double step = times[next] - times[next - 1];
    const double t = (seconds - times[next - 1]) / step;
    const auto a = value(next - 1, middle), b = value(next, middle);
    if (interpolation == Interpolation::Step) return a;
    if (!cubic && property == Property::Rotation) return slerp(a, b, t);
    std::vector<double> r(w);
    if (!cubic) {
        for (std::size_t i = 0; i < w; ++i) r[i] = a[i] * (1 - t) + b[i] * t;
        return r;
    }
    const auto out = value(next - 1, 2), in = value(next, 0);
    const double t2 = t * t, t3 = t2 * t;
    for (std::size_t i = 0; i < w; ++i)
        r[i] = (2 * t3 - 3 * t2 + 1) * a[i] + (t3 - 2 * t2 + t) * step * out[i] + (3 * t2 - 2 * t3) * b[i] +
               (t3 - t2) * step * in[i];
    return r;
}

std::string Animations::causeOf(std::size_t node) const {
    const auto found = nodes_.find(node);
    return found == nodes_.end() || found->second.channels.empty() ? "" : found->second.cause;
}

Transform Animations::local(std::size_t node, double seconds) const {
    const Animated& animated = nodes_.at(node);
    Pose pose = animated.rest;
    for (const Channel& channel : animated.channels) {
        const std::vector<double> v = channel.at(seconds);
        if (channel.property == Property::Rotation) {
            const bool none = v[0] == 0 && v[1] == 0 && v[2] == 0 && v[3] == 0;
            if (!none) std::copy(v.begin(), v.end(), pose.rotation.begin());
        } else {
            auto& target = channel.property == Property::Translation ? pose.translation : pose.scale;
            std::copy(v.begin(), v.begin() + 3, target.begin());
        }
    }
    return placeOf(pose);
}

std::string Animations::morphCauseOf(std::size_t node) const {
    const auto found = morphed_.find(node);
    return found == morphed_.end() ? "" : found->second.cause;
}

std::optional<std::vector<double>> Animations::weights(std::size_t node, double seconds) const {
    const auto found = morphed_.find(node);
    if (found == morphed_.end()) return std::nullopt;
    return found->second.channel.at(seconds);
}

}  // namespace vlx::render
