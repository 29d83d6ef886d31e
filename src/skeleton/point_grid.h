#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Points sorted into the cells of a uniform grid; O(points) to build, at most about four cells a point.
class PointGrid {
 public:
  PointGrid(std::span<const Vec3> points, double cell) {
    if (points.empty()) return;
    Vec3 high = low_ = points[0];
    for (const Vec3& p : points) low_ = low_.cwiseMin(p), high = high.cwiseMax(p);
    const Vec3 size = high - low_;
    cell_ = std::max(cell, 1e-9);
    const double limit = 4.0 * static_cast<double>(points.size()) + 64.0;
    while ((size.x() / cell_ + 1) * (size.y() / cell_ + 1) * (size.z() / cell_ + 1) > limit) cell_ *= 1.25;
    for (int a = 0; a < 3; ++a) count_[a] = static_cast<int>(size[a] / cell_) + 1;
    first_.assign(static_cast<std::size_t>(count_[0]) * count_[1] * count_[2] + 1, 0);
    for (const Vec3& p : points) ++first_[cell_of(p) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    entries_.resize(points.size());
    std::vector<Index> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < points.size(); ++i) entries_[next[cell_of(points[i])]++] = static_cast<Index>(i);
  }

  // Calls visit(point id) for every point in the cells that meet the box around `centre`; the caller tests distances.
  template <typename Visit>
  void near(const Vec3& centre, double radius, Visit&& visit) const {
    if (entries_.empty()) return;
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      from[a] = coordinate(centre[a] - radius, a);
      to[a] = coordinate(centre[a] + radius, a);
    }
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        const std::size_t row = (static_cast<std::size_t>(z) * count_[1] + y) * count_[0];
        for (Index e = first_[row + from[0]]; e < first_[row + to[0] + 1]; ++e) visit(entries_[e]);
      }
    }
  }

 private:
  [[nodiscard]] int coordinate(double x, int axis) const {
    return static_cast<int>(std::clamp((x - low_[axis]) / cell_, 0.0, count_[axis] - 1.0));
  }
  [[nodiscard]] std::size_t cell_of(const Vec3& p) const {
    return (static_cast<std::size_t>(coordinate(p.z(), 2)) * count_[1] + coordinate(p.y(), 1)) * count_[0] +
           coordinate(p.x(), 0);
  }

  Vec3 low_ = Vec3::Zero();
  double cell_ = 1.0;
  int count_[3] = {0, 0, 0};
  std::vector<Index> first_, entries_;
};

}  // namespace curvesup
