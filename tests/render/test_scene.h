#pragma once

#include <array>

#include "render/integrator/path_tracer.h"
#include "render/scene/scene.h"
#include "render/scene/scene_loader.h"

namespace vlx::render {

/// Builds small scenes in code.
class TestScene {
  public:
    std::uint32_t material(const Material& m) {
        scene_.materials.push_back(m);
        return static_cast<std::uint32_t>(scene_.materials.size()) - 1;
    }

    /// A diffuse, non-reflecting, double-sided material.
    static Material matte(const Rgb& colour) {
        Material m;
        m.baseColour = colour;
        m.metallic = 0;
        m.roughness = 1;
        m.specular = 0;
        m.doubleSided = true;
        return m;
    }

    static Material emitter(const Rgb& radiance, const Rgb& colour = {0, 0, 0}) {
        Material m = matte(colour);
        m.emission = radiance;
        return m;
    }

    static Material glass(float ior, float roughness) {
        Material m = matte({1, 1, 1});
        m.specular = 1;
        m.transmission = 1;
        m.ior = ior;
        m.roughness = roughness;
        return m;
    }

    /// Corners counter-clockwise seen from the front; texture coordinates (0,0), (1,0), (1,1), (0,1).
    void quad(std::uint32_t material, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
        begin(material);
        const Vec3 n = normalized(cross(b - a, c - a));
        scene_.vertices.insert(scene_.vertices.end(),
                               {{a, n, {0, 0}}, {b, n, {1, 0}}, {c, n, {1, 1}}, {d, n, {0, 1}}});
        triangle(0, 1, 2);
        triangle(0, 2, 3);
        end();
    }

    /// An axis-parallel box, fronts outwards.
    void box(std::uint32_t material, const Vec3& low, const Vec3& high) {
        const auto p = [&](int x, int y, int z) {
            return Vec3{x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z};
        };
        quad(material, p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1));
        quad(material, p(1, 0, 0), p(0, 0, 0), p(0, 1, 0), p(1, 1, 0));
        quad(material, p(1, 0, 1), p(1, 0, 0), p(1, 1, 0), p(1, 1, 1));
        quad(material, p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0));
        quad(material, p(0, 1, 1), p(1, 1, 1), p(1, 1, 0), p(0, 1, 0));
        quad(material, p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1));
    }

    /// A sphere of 2 n^2 quadrilaterals, smooth normals.
    void sphere(std::uint32_t material, const Vec3& centre, float radius, std::uint32_t n = 24) {
        begin(material);
        for (std::uint32_t i = 0; i <= n; ++i) {
            for (std::uint32_t j = 0; j <= 2 * n; ++j) {
                const float theta = kPi * static_cast<float>(i) / static_cast<float>(n);
                const float phi = kPi * static_cast<float>(j) / static_cast<float>(n);
                const Vec3 d{std::sin(theta) * std::cos(phi), std::cos(theta),
                             -std::sin(theta) * std::sin(phi)};
                scene_.vertices.push_back({centre + d * radius, d, {}});
            }
        }
        for (std::uint32_t i = 0; i < n; ++i) {
            for (std::uint32_t j = 0; j < 2 * n; ++j) {
                const std::uint32_t a = i * (2 * n + 1) + j, b = a + 2 * n + 1;
                if (i > 0) triangle(a, b, a + 1);
                if (i + 1 < n) triangle(a + 1, b, b + 1);
            }
        }
        end();
    }

    void light(const Light& l) { scene_.lights.push_back(l); }

    void environment(const Environment& e) { scene_.environment = e; }

    /// Camera at `eye` looking at `target`.
    void camera(const Vec3& eye, const Vec3& target, float verticalFov) {
        const Vec3 back = normalized(eye - target);
        const Vec3 up = std::abs(back.y) > 0.99f ? Vec3{0, 0, 1} : Vec3{0, 1, 0};
        const Vec3 right = normalized(cross(up, back));
        const Vec3 above = cross(back, right);
        Camera c;
        c.name = "camera";
        c.verticalFov = verticalFov;
        c.toWorld.m = {{{right.x, above.x, back.x, eye.x},
                        {right.y, above.y, back.y, eye.y},
                        {right.z, above.z, back.z, eye.z}}};
        scene_.cameras.push_back(c);
    }

    Scene finish() {
        scene_.name = "test";
        scene_.worldShapes = static_cast<std::uint32_t>(scene_.shapes.size());
        completeScene(scene_);
        return std::move(scene_);
    }

    Scene& scene() { return scene_; }

  private:
    void begin(std::uint32_t material) {
        Shape shape;
        shape.material = material;
        shape.firstVertex = static_cast<std::uint32_t>(scene_.vertices.size());
        shape.firstTriangle = static_cast<std::uint32_t>(scene_.triangles.size());
        scene_.shapes.push_back(shape);
    }

    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const std::uint32_t first = scene_.shapes.back().firstVertex;
        scene_.triangles.push_back({first + a, first + b, first + c});
    }

    void end() {
        Shape& shape = scene_.shapes.back();
        shape.vertices = static_cast<std::uint32_t>(scene_.vertices.size()) - shape.firstVertex;
        shape.triangles = static_cast<std::uint32_t>(scene_.triangles.size()) - shape.firstTriangle;
    }

    Scene scene_;
};

/// Mean radiance along rays, with the standard error of each channel's mean.
struct Estimate {
    std::array<double, 3> mean{};
    std::array<double, 3> error{};
};

/// `samples` independent estimates (one index each of many seeds) along one ray.
inline Estimate estimate(const Scene& scene, const Ray& ray, int samples, const PathOptions& options = {}) {
    const Accelerator accelerator(scene);
    const PathTracer tracer(scene, accelerator, View(Camera{}, 1, 1), options);
    std::array<double, 3> sum{}, squares{};
    for (int i = 0; i < samples; ++i) {
        const Rgb v = tracer.along(ray, PathSampler(hashOf(i, 5), 0)).radiance;
        const std::array<double, 3> rgb{v.x, v.y, v.z};
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += rgb[c];
            squares[c] += rgb[c] * rgb[c];
        }
    }
    Estimate e;
    for (std::size_t c = 0; c < 3; ++c) {
        e.mean[c] = sum[c] / samples;
        e.error[c] = std::sqrt(std::max(0.0, squares[c] / samples - e.mean[c] * e.mean[c]) / samples);
    }
    return e;
}

}  // namespace vlx::render
