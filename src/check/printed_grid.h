#pragma once

#include <vector>

#include "check/support_parts.h"

namespace curvesup::certificate {

// The printed triangles of one material by cell. A triangle carries what lies within 1.5 times its own thickness, so there
// is a grid for the thin ones and one for each doubling of the thickness: no search reaches farther than it must.
class PrintedGrid {
 public:
  PrintedGrid() = default;
  PrintedGrid(const Subject& subject, Material material);

  // Calls use(triangle), for some triangles twice, for all triangles that have a point within `radius` of the line from q
  // along the unit vector `down`, no farther on than 1.5 times the thicker one of `thickness` and the triangle's own, and
  // `gap`; others may be among them. Stops when use says true, and returns that.
  bool visit_below(const Vec3& q, const Vec3& down, double thickness, double gap, double radius, const auto& use) const {
    const Vec3 around = radius * (1.0 - down.array().square()).max(0.0).sqrt();  // half the box of the disc across `down`
    for (const Class& c : classes_) {
      const Vec3 far = q + (1.5 * std::max(thickness, c.most_mm) + gap) * down;
      const Vec3 low = q.cwiseMin(far) - around, high = q.cwiseMax(far) + around;
      if (((high - c.low).array() < 0.0).any() || ((low - c.high).array() > 0.0).any()) continue;
      const bool found = c.grid.visit(low, high, [&](std::size_t cell) {
        for (Index e = c.first[cell]; e < c.first[cell + 1]; ++e) {
          if (use(c.entries[e])) return true;
        }
        return false;
      });
      if (found) return true;
    }
    return false;
  }

  [[nodiscard]] const Sheet& sheet(Index triangle) const { return subject_->printed.sheets[sheet_of_[triangle]]; }
  [[nodiscard]] double thickness(Index triangle) const {
    return subject_->thickness(subject_->printed.triangle_tet[triangle], sheet(triangle).passes);
  }

 private:
  struct Class {
    double most_mm;  // no triangle is thicker
    Vec3 low, high;
    CellGrid grid;
    std::vector<Index> first, entries;
  };
  Class make_class(const std::vector<Index>& triangles, double most_mm) const;

  const Subject* subject_ = nullptr;
  std::vector<Index> sheet_of_;  // of the stack's triangles
  std::vector<Class> classes_;
};

}  // namespace curvesup::certificate
