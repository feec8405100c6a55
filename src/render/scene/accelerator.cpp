#include "render/scene/accelerator.h"

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <limits>
#include <string>
#include <vector>

#include "render/scene/scene.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"

namespace vlx::render {
namespace {

thread_local std::uint64_t raysTested = 0;

/// What Embree's filters get to see of a ray.
struct RayContext : RTCIntersectContext {
    explicit RayContext(std::uint32_t raySeed, bool both = false) : seed(raySeed), bothSides(both) {
        rtcInitIntersectContext(this);
    }
    std::uint32_t seed;
    bool bothSides;
};

struct FilterData {
    const Scene* scene;
    const Shape* shape;
    bool seeThroughBack;
    bool seeThroughOpacity;
};

void filter(const RTCFilterFunctionNArguments* args) {
    const auto& data = *static_cast<const FilterData*>(args->geometryUserPtr);
    const auto* context = reinterpret_cast<const RayContext*>(args->context);
    for (unsigned int i = 0; i < args->N; ++i) {
        if (args->valid[i] != -1) continue;
        if (data.seeThroughBack && !context->bothSides) {
            const float facing = RTCHitN_Ng_x(args->hit, args->N, i) * RTCRayN_dir_x(args->ray, args->N, i) +
                                 RTCHitN_Ng_y(args->hit, args->N, i) * RTCRayN_dir_y(args->ray, args->N, i) +
                                 RTCHitN_Ng_z(args->hit, args->N, i) * RTCRayN_dir_z(args->ray, args->N, i);
            if (facing > 0) {
                args->valid[i] = 0;
                continue;
            }
        }
        if (!data.seeThroughOpacity) continue;
        const unsigned int triangle = RTCHitN_primID(args->hit, args->N, i);
        const float opacity = opacityAt(*data.scene, *data.shape, data.shape->firstTriangle + triangle,
                                        RTCHitN_u(args->hit, args->N, i), RTCHitN_v(args->hit, args->N, i));
        if (opacity >= 1) continue;
        const std::uint64_t hash = hashOf(context->seed, RTCHitN_geomID(args->hit, args->N, i), triangle,
                                          RTCHitN_instID(args->hit, args->N, i, 0));
        if (opacity <= 0 || unitFloat(static_cast<std::uint32_t>(hash)) >= opacity) args->valid[i] = 0;
    }
}

RTCRay toEmbree(const Ray& ray, float distance) {
    RTCRay r;
    r.org_x = ray.origin.x;
    r.org_y = ray.origin.y;
    r.org_z = ray.origin.z;
    r.tnear = 0;
    r.dir_x = ray.direction.x;
    r.dir_y = ray.direction.y;
    r.dir_z = ray.direction.z;
    r.time = ray.time;
    r.tfar = distance;
    r.mask = 0xffffffffu;
    r.id = 0;
    r.flags = 0;
    return r;
}

void check(RTCDevice device) {
    const RTCError code = rtcGetDeviceError(device);
    if (code == RTC_ERROR_NONE) return;
    throw Error("", code == RTC_ERROR_OUT_OF_MEMORY ? std::string("out of memory building the ray structure")
                                                    : "Embree failed with error " + std::to_string(code));
}

}  // namespace

struct Accelerator::Impl {
    RTCDevice device = nullptr;
    RTCScene top = nullptr;
    std::vector<RTCScene> groups;
    std::vector<FilterData> filters;
    std::vector<std::array<float, 4>> spheres;
    std::vector<std::int32_t> sphereLights;
    const Scene& scene;
    EffectSet effects;

    Impl(const Scene& s, const EffectSet& e) : scene(s), effects(e) {}
    ~Impl() {
        if (top != nullptr) rtcReleaseScene(top);
        for (RTCScene group : groups) rtcReleaseScene(group);
        if (device != nullptr) rtcReleaseDevice(device);
    }

    RTCScene newScene() const {
        RTCScene s = rtcNewScene(device);
        rtcSetSceneFlags(s, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(s, RTC_BUILD_QUALITY_HIGH);
        return s;
    }

    void attachShape(RTCScene to, std::uint32_t index, std::uint32_t id) {
        const Shape& shape = scene.shapes[index];
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        const std::uint32_t steps =
            shape.deformation < 0 ? 1 : scene.deformations[static_cast<std::size_t>(shape.deformation)].steps;
        rtcSetGeometryTimeStepCount(geometry, steps);
        for (std::uint32_t step = 0; step < steps; ++step)
            rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                       scene.vertices.data() + std::size_t{step} * shape.vertices, 0,
                                       sizeof(Vertex), std::size_t{shape.firstVertex} + shape.vertices);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                   scene.triangles.data() + shape.firstTriangle, 0,
                                   sizeof(scene.triangles[0]), shape.triangles);
        const Material& material = scene.materials[shape.material];
        FilterData& data = filters[index];
        data = {&scene, &shape, !material.visibleFromBehind(),
                effects.has(Effect::Alpha) && material.alphaMode != AlphaMode::Opaque};
        if (data.seeThroughBack || data.seeThroughOpacity) {
            rtcSetGeometryUserData(geometry, &data);
            rtcSetGeometryIntersectFilterFunction(geometry, filter);
            rtcSetGeometryOccludedFilterFunction(geometry, filter);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(to, geometry, id);
        rtcReleaseGeometry(geometry);
    }

    void attachSpheres() {
        for (std::size_t i = 0; i < scene.lights.size(); ++i) {
            const Light& light = scene.lights[i];
            if (light.type != LightType::Sphere) continue;
            spheres.push_back({light.position.x, light.position.y, light.position.z, light.radius});
            sphereLights.push_back(static_cast<std::int32_t>(i));
        }
        if (spheres.empty()) return;
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
        rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, spheres.data(), 0,
                                   sizeof(spheres[0]), spheres.size());
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(top, geometry, scene.worldShapes);
        rtcReleaseGeometry(geometry);
    }

    void attachInstance(const Instance& instance, std::uint32_t id) {
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, groups[instance.group]);
        const auto setPlace = [&](unsigned int step, const Transform& toWorld) {
            std::array<float, 12> rows;
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 4; ++j) rows[i * 4 + j] = static_cast<float>(toWorld.m[i][j]);
            rtcSetGeometryTransform(geometry, step, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows.data());
        };
        if (instance.motion < 0) {
            setPlace(0, instance.toWorld);
        } else {
            const auto& places = scene.motions[static_cast<std::size_t>(instance.motion)].places;
            rtcSetGeometryTimeStepCount(geometry, static_cast<unsigned int>(places.size()));
            for (std::size_t i = 0; i < places.size(); ++i) setPlace(static_cast<unsigned int>(i), places[i]);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(top, geometry, id);
        rtcReleaseGeometry(geometry);
    }

    void build() {
        for (const Group& group : scene.groups) {
            groups.push_back(newScene());
            for (std::uint32_t i = 0; i < group.shapes; ++i)
                attachShape(groups.back(), group.firstShape + i, i);
            rtcJoinCommitScene(groups.back());
        }
        top = newScene();
        for (std::uint32_t i = 0; i < scene.worldShapes; ++i) attachShape(top, i, i);
        attachSpheres();
        for (std::size_t i = 0; i < scene.instances.size(); ++i)
            attachInstance(scene.instances[i], firstInstance() + static_cast<std::uint32_t>(i));
        rtcJoinCommitScene(top);
    }

    std::uint32_t firstInstance() const { return scene.worldShapes + 1; }
};

Accelerator::Accelerator(const Scene& scene, const EffectSet& effects) : impl_(new Impl(scene, effects)) {
    Impl& im = *impl_;
    im.device = rtcNewDevice("set_affinity=0");
    check(im.device);
    im.filters.resize(scene.shapes.size());
    // Built by one thread: where two surfaces coincide the hit depends on the tree, and the image must not
    // depend on the number of threads.
    tbb::task_arena(1).execute([&] { im.build(); });
    check(im.device);
}

Accelerator::~Accelerator() = default;

std::optional<Hit> Accelerator::intersect(const Ray& ray, std::uint32_t seed, bool bothSides) const {
    if (recorder_ != nullptr) recorder_->push_back({ray, 0, seed, false});
    ++raysTested;
    RayContext context(seed, bothSides);
    RTCRayHit r;
    r.ray = toEmbree(ray, std::numeric_limits<float>::infinity());
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(impl_->top, &context, &r);
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    Hit hit{r.ray.tfar, r.hit.u, r.hit.v, r.hit.geomID, r.hit.primID, -1, -1};
    if (r.hit.instID[0] != RTC_INVALID_GEOMETRY_ID) {
        hit.instance = static_cast<std::int32_t>(r.hit.instID[0] - impl_->firstInstance());
        const Instance& instance = impl_->scene.instances[static_cast<std::size_t>(hit.instance)];
        hit.shape += impl_->scene.groups[instance.group].firstShape;
    } else if (r.hit.geomID == impl_->scene.worldShapes) {
        hit.light = impl_->sphereLights[r.hit.primID];
    }
    return hit;
}

bool Accelerator::occluded(const Ray& ray, float distance, std::uint32_t seed) const {
    if (recorder_ != nullptr) recorder_->push_back({ray, distance, seed, true});
    ++raysTested;
    RayContext context(seed);
    RTCRay r = toEmbree(ray, distance);
    rtcOccluded1(impl_->top, &context, &r);
    return r.tfar < 0;
}

std::uint64_t Accelerator::raysOnThisThread() { return raysTested; }

void* Accelerator::embreeScene() const { return impl_->top; }

}  // namespace vlx::render
