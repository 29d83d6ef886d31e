#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

// A bounding-volume tree over the triangles of a mesh; stands degenerate triangles. Build O(n log n), queries O(log n)
// on ordinary input. Keeps its own copy of the corner points.
class TriangleTree {
 public:
  TriangleTree() = default;
  explicit TriangleTree(const TriangleMesh& mesh);

  struct Nearest {
    Index triangle = kNone;
    Vec3 point = Vec3::Zero();
    double distance = 0.0;
  };
  // Nearest point within max_distance; equal distances go to the lowest triangle id.
  [[nodiscard]] std::optional<Nearest> nearest(const Vec3& p, double max_distance) const;

  struct Hit {
    Index triangle = kNone;
    double t = 0.0;  // along direction, which need not be a unit vector
  };
  // First triangle that origin + t * direction meets for t in [t_min, t_max].
  [[nodiscard]] std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction, double t_min, double t_max) const;
  // The triangle that the line meets nearest to its origin, on either side, |t| <= t_max; of equal ones that at negative t.
  [[nodiscard]] std::optional<Hit> nearest_hit(const Vec3& origin, const Vec3& direction, double t_max) const;

  // Calls visit(triangle) for every triangle whose bounding box meets [low, high]; ascending order is not promised.
  void overlapping(const Vec3& low, const Vec3& high, const std::function<void(Index)>& visit) const;

  [[nodiscard]] bool empty() const { return corners_.empty(); }

 private:
  struct Node {
    Vec3 low, high;
    Index first = 0;  // leaf: first entry of order_; inner: index of the left child (right one follows it)
    Index count = 0;  // leaf: entries; inner: 0
  };
  void build(Index node, Index begin, Index end);
  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Index> order_;
  std::vector<Node> nodes_;
};

}  // namespace curvesup
