#pragma once

#include <algorithm>
#include <vector>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/solid/solid.h"

namespace curvesup::shapes {

// The union of capsules (a segment with a radius; a sphere where both ends agree) as a signed distance.
class Capsules : public Solid {
 public:
  struct Capsule {
    Vec3 a, b;
    double radius;
  };
  explicit Capsules(std::vector<Capsule> capsules) : capsules_(std::move(capsules)) {}
  double value(const Vec3& p) const override {
    double best = -1e9;
    for (const Capsule& c : capsules_) best = std::max(best, c.radius - (p - closest_point_on_segment(p, c.a, c.b)).norm());
    return best;
  }
  Bounds bounds(const Vec3& centre, double radius) const override {
    const double v = value(centre);
    return {v - radius, v + radius};
  }

 private:
  std::vector<Capsule> capsules_;
};

}  // namespace curvesup::shapes
