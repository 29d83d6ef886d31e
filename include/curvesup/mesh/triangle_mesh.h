#pragma once

#include <array>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<Index, 3>> triangles;
};

// Twice the area along the normal.
[[nodiscard]] inline Vec3 area_normal(const Vec3& a, const Vec3& b, const Vec3& c) { return (b - a).cross(c - a); }
[[nodiscard]] inline double triangle_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  return 0.5 * area_normal(a, b, c).norm();
}
[[nodiscard]] double total_area(const TriangleMesh& mesh);

// Closest point of the closed triangle abc to p.
[[nodiscard]] Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);
[[nodiscard]] Vec3 closest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b);

}  // namespace curvesup
