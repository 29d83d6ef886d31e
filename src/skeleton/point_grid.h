#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Cubic cells that fill a box; what lies outside counts to the nearest cell. Not more cells than `limit`: larger ones then.
class CellBox {
 public:
  CellBox() = default;
  CellBox(const Vec3& low, const Vec3& high, double cell, double limit) : low_(low), cell_(std::max(cell, 1e-9)) {
    const Vec3 size = high - low;
    while ((size.x() / cell_ + 1) * (size.y() / cell_ + 1) * (size.z() / cell_ + 1) > limit) cell_ *= 1.25;
    for (int a = 0; a < 3; ++a) count_[a] = static_cast<int>(size[a] / cell_) + 1;
  }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(count_[0]) * count_[1] * count_[2]; }
  [[nodiscard]] std::size_t cell_of(const Vec3& p) const { return cell_at(coordinate(p, 0), coordinate(p, 1), coordinate(p, 2)); }

  // Calls visit(first, last) for runs of cells that together hold every point within the radius.
  template <typename Visit>
  void near(const Vec3& centre, double radius, Visit&& visit) const {
    const Vec3 from = centre - Vec3::Constant(radius), to = centre + Vec3::Constant(radius);
    for (int z = coordinate(from, 2); z <= coordinate(to, 2); ++z) {
      for (int y = coordinate(from, 1); y <= coordinate(to, 1); ++y) {
        visit(cell_at(coordinate(from, 0), y, z), cell_at(coordinate(to, 0), y, z));
      }
    }
  }

 private:
  [[nodiscard]] int coordinate(const Vec3& p, int axis) const {
    return static_cast<int>(std::clamp((p[axis] - low_[axis]) / cell_, 0.0, count_[axis] - 1.0));
  }
  [[nodiscard]] std::size_t cell_at(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * count_[1] + y) * count_[0] + x;
  }

  Vec3 low_ = Vec3::Zero();
  double cell_ = 1.0;
  int count_[3] = {0, 0, 0};
};

// Points sorted into cells; O(points) to build, at most about four cells a point.
class PointGrid {
 public:
  PointGrid(std::span<const Vec3> points, double cell) {
    if (points.empty()) return;
    Vec3 low = points[0], high = low;
    for (const Vec3& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
    cells_ = CellBox(low, high, cell, 4.0 * static_cast<double>(points.size()) + 64.0);
    first_.assign(cells_.size() + 1, 0);
    std::vector<Index> cell_of(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) ++first_[cell_of[i] = static_cast<Index>(cells_.cell_of(points[i]))];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    entries_.resize(points.size());
    for (std::size_t i = points.size(); i-- > 0;) entries_[--first_[cell_of[i]]] = static_cast<Index>(i);
  }

  // Calls visit(point id) for every point in the cells that meet the box around `centre`; the caller tests distances.
  template <typename Visit>
  void near(const Vec3& centre, double radius, Visit&& visit) const {
    if (entries_.empty()) return;
    cells_.near(centre, radius, [&](std::size_t from, std::size_t to) {
      for (Index e = first_[from]; e < first_[to + 1]; ++e) visit(entries_[e]);
    });
  }

 protected:
  CellBox cells_;
  std::vector<Index> first_, entries_;
};

// The same for points that are of interest until something is known of them.
class ShrinkingPointGrid : private PointGrid {
 public:
  ShrinkingPointGrid(std::span<const Vec3> points, double cell) : PointGrid(points, cell) {
    if (!first_.empty()) end_.assign(first_.begin() + 1, first_.end());
  }

  // Calls keep(point id) for every point in those cells; a point for which it is false is gone from then on.
  template <typename Keep>
  void near(const Vec3& centre, double radius, Keep&& keep) {
    if (entries_.empty()) return;
    cells_.near(centre, radius, [&](std::size_t from, std::size_t to) {
      for (std::size_t c = from; c <= to; ++c) {
        for (Index e = first_[c]; e < end_[c];) {
          if (keep(entries_[e])) {
            ++e;
          } else {
            entries_[e] = entries_[--end_[c]];
          }
        }
      }
    });
  }

 private:
  std::vector<Index> end_;  // of what is left in each cell
};

// The same for points that come one by one.
class GrowingPointGrid {
 public:
  explicit GrowingPointGrid(const CellBox& cells) : cells_(cells), last_(cells.size(), kNone) {}

  void add(const Vec3& point) {
    Index& last = last_[cells_.cell_of(point)];
    before_.push_back(last);
    last = static_cast<Index>(before_.size()) - 1;
  }
  // Does test(point id) hold for any point in those cells?
  template <typename Test>
  [[nodiscard]] bool any_near(const Vec3& centre, double radius, Test&& test) const {
    bool found = false;
    cells_.near(centre, radius, [&](std::size_t from, std::size_t to) {
      for (std::size_t c = from; c <= to && !found; ++c) {
        for (Index i = last_[c]; i != kNone && !found; i = before_[i]) found = test(i);
      }
    });
    return found;
  }

 private:
  CellBox cells_;
  std::vector<Index> last_, before_;  // of a cell, and in the cell of a point
};

}  // namespace curvesup
