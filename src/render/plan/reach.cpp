#include "render/plan/reach.h"

#include <algorithm>

namespace vlx::render {
namespace {

std::array<Vec3, 8> corners(const Bounds& b) {
    std::array<Vec3, 8> c;
    for (unsigned int i = 0; i < 8; ++i)
        c[i] = {(i & 1u) ? b.high.x : b.low.x, (i & 2u) ? b.high.y : b.low.y, (i & 4u) ? b.high.z : b.low.z};
    return c;
}

/// Distance of a point to a box.
float distanceTo(const Bounds& b, const Vec3& p) {
    const auto gap = [](float low, float high, float v) { return std::max({low - v, v - high, 0.f}); };
    return length(
        Vec3{gap(b.low.x, b.high.x, p.x), gap(b.low.y, b.high.y, p.y), gap(b.low.z, b.high.z, p.z)});
}

/// Whether a plane through the tip of a light's cone has the cone on one side and a box on the other.
bool outsideCone(const Bounds& b, const Light& light) {
    // The cone's edge is where cos = -offset / scale.
    const float edge = std::acos(std::clamp(-light.coneOffset / light.coneScale, -1.f, 1.f)) + 1e-3f;
    if (edge >= kPi / 2) return false;
    const Vec3 to = b.centre() - light.position;
    const Vec3 across = to - light.direction * dot(to, light.direction);
    const float norm = length(across);
    const Vec3 aside = norm > 0 ? across / norm : Frame(light.direction).tangent;
    // Normals on the cone's side: its axis, and the axis tilted away from the box until the plane touches it.
    for (const Vec3& normal : {light.direction, light.direction * std::sin(edge) - aside * std::cos(edge)}) {
        const auto c = corners(b);
        if (std::ranges::all_of(c, [&](const Vec3& p) { return dot(p - light.position, normal) < 0; }))
            return true;
    }
    return false;
}

}  // namespace

void Bounds::include(const Vec3& p) {
    if (empty()) {
        low = high = p;
        return;
    }
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
}

Reach::Reach(const Scene& scene, const MaterialRanges& ranges, const PlanOptions& options)
    : scene_(scene),
      ranges_(ranges),
      options_(options),
      bounds_(scene.shapes.size()),
      seen_(scene.shapes.size(), 0) {
    std::vector<Bounds> own(scene.shapes.size());
    for (std::size_t i = 0; i < scene.shapes.size(); ++i)
        for (const Vertex& v : verticesOf(scene, scene.shapes[i])) own[i].include(v.position);
    for (std::size_t i = 0; i < scene.worldShapes; ++i) {
        bounds_[i] = own[i];
        seen_[i] = inView(own[i]);
    }
    for (const Instance& instance : scene.instances) {
        const Group& group = scene.groups[instance.group];
        for (std::size_t i = group.firstShape; i < group.firstShape + group.shapes; ++i) {
            Bounds placed;
            const auto place = [&](const Transform& toWorld) {
                for (const Vec3& corner : corners(own[i])) placed.include(toWorld.point(corner));
            };
            if (instance.motion < 0) {
                place(instance.toWorld);
            } else {
                for (const Transform& t : scene.motions[static_cast<std::size_t>(instance.motion)].places)
                    place(t);
            }
            bounds_[i].include(placed.low);
            bounds_[i].include(placed.high);
            seen_[i] = seen_[i] || inView(placed);
        }
    }
    for (std::size_t i = 0; i < scene.shapes.size(); ++i)
        bounces_ = bounces_ || (seen_[i] && ranges.of(scene.shapes[i].material).scatters());
    bounces_ = bounces_ && options.maxBounces > 0;
}

/// Whether a box may be in the picture. Moving cameras and lenses see everything.
bool Reach::inView(const Bounds& bounds) const {
    const Camera& camera = scene_.cameras[options_.camera];
    if (camera.motion.moves() || camera.lensRadius > 0) return true;
    const auto toCamera = camera.toWorld.inverse();
    if (!toCamera) return true;
    const bool parallel = camera.orthographicHeight > 0;
    const float halfY =
        (parallel ? 0.5f * camera.orthographicHeight : std::tan(0.5f * camera.verticalFov)) * 1.001f;
    const float halfX = halfY * static_cast<float>(options_.width) / static_cast<float>(options_.height);
    std::array<bool, 5> outside{true, true, true, true, true};
    for (const Vec3& corner : corners(bounds)) {
        const Vec3 p = toCamera->point(corner);
        const float depth = -p.z;
        const float slack = 1e-4f * (1 + length(p));
        const float scale = parallel ? 1 : depth;
        outside[0] = outside[0] && depth < -slack;
        outside[1] = outside[1] && p.x > scale * halfX + slack;
        outside[2] = outside[2] && -p.x > scale * halfX + slack;
        outside[3] = outside[3] && p.y > scale * halfY + slack;
        outside[4] = outside[4] && -p.y > scale * halfY + slack;
    }
    return std::ranges::none_of(outside, [](bool o) { return o; });
}

std::string Reach::idle(const Light& light) const {
    if (isBlack(light.intensity)) return "it has no power";
    if (light.type == LightType::Environment) return "";
    if (light.type == LightType::Mesh) return idleMesh(light);
    if (light.type == LightType::Sphere) return "";  // the camera may see it
    if (options_.maxBounces < 1) return "no light is scattered with --max-bounces 0";
    bool spreads = false;
    for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
        if (!shaded(i) || !ranges_.of(scene_.shapes[i].material).spreads()) continue;
        spreads = true;
        if (light.type == LightType::Directional) return "";
        const Bounds& b = bounds_[i];
        if (light.range > 0 && distanceTo(b, light.position) > light.range) continue;
        if (light.coneScale == 0) return "";
        if (!outsideCone(b, light)) return "";
    }
    if (!spreads) return "no surface that a path can meet spreads its light";
    return "it reaches no surface that a path can meet";
}

std::string Reach::idleMesh(const Light& light) const {
    if (!met(light.shape)) return "no path can meet its surface";
    const Shape& shape = scene_.shapes[light.shape];
    if (scene_.materials[shape.material].visibleFromBehind()) return "";
    // Everything that could be lit, and the camera.
    Bounds others;
    for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
        if (!shaded(i) || !ranges_.of(scene_.shapes[i].material).scatters()) continue;
        others.include(bounds_[i].low);
        others.include(bounds_[i].high);
    }
    const Camera& camera = scene_.cameras[options_.camera];
    const Vec3 eye = camera.toWorld.point({0, 0, 0});
    const float slack = camera.lensRadius + 1e-4f * (1 + length(scene_.boundsMax - scene_.boundsMin));
    if (camera.motion.moves()) return "";
    const bool parallel = camera.orthographicHeight > 0;
    if (parallel && camera.lensRadius > 0) return "";
    const Vec3 back = camera.toWorld.vector({0, 0, 1});
    for (std::uint32_t t = 0; t < shape.triangles; ++t) {
        const auto& corner = scene_.triangles[shape.firstTriangle + t];
        const Vec3& a = scene_.vertices[corner[0]].position;
        const Vec3 n = normalized(
            cross(scene_.vertices[corner[1]].position - a, scene_.vertices[corner[2]].position - a));
        if (parallel ? dot(n, back) > -1e-4f : dot(n, eye - a) > -slack) return "";
        if (others.empty()) continue;
        for (const Vec3& p : corners(others))
            if (dot(n, p - a) > slack) return "";
    }
    return "it faces away from everything";
}

bool Reach::coplanar() const {
    std::optional<Vec3> origin, normal;
    const float slack = 1e-6f * (1 + length(scene_.boundsMax - scene_.boundsMin));
    for (std::size_t i = 0; i < scene_.shapes.size(); ++i) {
        const Shape& shape = scene_.shapes[i];
        if (!shaded(i) || !ranges_.of(shape.material).scatters()) continue;
        if (i >= scene_.worldShapes) return false;
        const auto position = [&](std::uint32_t v) { return scene_.vertices[v].position; };
        if (!origin) {
            const auto& t = scene_.triangles[shape.firstTriangle];
            origin = position(t[0]);
            normal = normalized(cross(position(t[1]) - *origin, position(t[2]) - *origin));
        }
        for (const Vertex& v : verticesOf(scene_, shape))
            if (std::abs(dot(*normal, v.position - *origin)) > slack) return false;
    }
    return true;
}

bool Reach::indirect() const { return bounces_ && options_.maxBounces > 1 && !coplanar(); }

}  // namespace vlx::render
