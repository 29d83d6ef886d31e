#include "curvesup/mesh/triangle_mesh.h"

#include <algorithm>

namespace curvesup {

double total_area(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) sum += triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  return sum;
}

Vec3 closest_point_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 <= 0.0) return a;
  return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

Vec3 closest_point_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  // Inside the prism over the triangle the foot of the perpendicular is nearest; elsewhere one of the three edges is.
  const Vec3 n = area_normal(a, b, c);
  const double n2 = n.squaredNorm();
  if (n2 > 0.0) {
    const double wa = n.dot((c - b).cross(p - b)), wb = n.dot((a - c).cross(p - c)), wc = n.dot((b - a).cross(p - a));
    if (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) return p - n * (n.dot(p - a) / n2);
  }
  Vec3 best = closest_point_on_segment(p, a, b);
  for (const Vec3& q : {closest_point_on_segment(p, b, c), closest_point_on_segment(p, c, a)}) {
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
  }
  return best;
}

}  // namespace curvesup
