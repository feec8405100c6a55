#pragma once

#include <vector>

#include "render/plan/material_range.h"
#include "render/plan/plan.h"
#include "render/scene/scene.h"

namespace vlx::render {

struct Bounds {
    Vec3 low{1, 1, 1}, high{-1, -1, -1};  ///< empty when low > high

    bool empty() const { return low.x > high.x; }
    void include(const Vec3& p);
    Vec3 centre() const { return (low + high) * 0.5f; }
    float radius() const { return 0.5f * length(high - low); }
};

/// Which shapes and lights the paths of a picture can meet, as far as bounds tell. Errs on the side of
/// meeting.
class Reach {
  public:
    Reach(const Scene& scene, const MaterialRanges& ranges, const PlanOptions& options);

    bool seen(std::size_t shape) const { return seen_[shape]; }  ///< by the camera
    bool met(std::size_t shape) const { return seen_[shape] || bounces_; }
    /// Light is scattered there, or its features are looked at.
    bool shaded(std::size_t shape) const { return seen_[shape] || (bounces_ && options_.maxBounces > 1); }
    /// Empty when the light reaches something, otherwise why not.
    std::string idle(const Light& light) const;
    /// Whether light can go from one surface that scatters to another.
    bool indirect() const;

  private:
    bool inView(const Bounds& bounds) const;
    bool coplanar() const;
    std::string idleMesh(const Light& light) const;

    const Scene& scene_;
    const MaterialRanges& ranges_;
    PlanOptions options_;
    std::vector<Bounds> bounds_;  ///< of shapes, over all instances and times
    std::vector<char> seen_;
    bool bounces_ = false;  ///< something in sight scatters
};

}  // namespace vlx::render
