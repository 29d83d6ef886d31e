#pragma once

#include <algorithm>
#include <array>

#include "curvesup/motion/machine.h"

namespace curvesup {

// Nozzle and head as a solid of revolution about the nozzle axis: a cone with a flat tip, then a cylinder. Millimetres.
// A point is given by its height above the tip plane along the axis and its distance from the axis.
class HeadShape {
 public:
  explicit HeadShape(const Tool& tool);

  // Exact signed distance, negative inside.
  [[nodiscard]] double distance(double height, double radius) const;
  // A lower bound of it that costs a tenth.
  [[nodiscard]] double distance_bound(double height, double radius) const {
    const double flank = (radius - tip_radius_ - hull_slope_ * height) * hull_cosine_;
    return std::max({flank, -height, radius - widest_, height - length_});
  }
  // What the bound is made of, in single precision.
  [[nodiscard]] float tip_radius() const { return static_cast<float>(tip_radius_); }
  [[nodiscard]] float hull_slope() const { return static_cast<float>(hull_slope_); }
  [[nodiscard]] float hull_cosine() const { return static_cast<float>(hull_cosine_); }
  [[nodiscard]] float widest() const { return static_cast<float>(widest_); }
  // Of a point from the head whose tip and unit axis are given.
  [[nodiscard]] double distance(const Vec3& point, const Vec3& tip, const Vec3& axis) const;
  // Lowest z of the part of the head above `from_height`, for a tip and unit axis.
  [[nodiscard]] double lowest_z(const Vec3& tip, const Vec3& axis, double from_height) const;
  [[nodiscard]] double length() const { return length_; }

 private:
  struct Corner {
    double height, radius;
  };
  [[nodiscard]] bool inside(double height, double radius) const;

  std::array<Corner, 6> profile_;  // from the axis at the tip, around the outside, to the axis at the far end
  double tip_radius_, slope_, cone_length_, head_radius_, length_;
  double widest_, hull_slope_, hull_cosine_;  // of the least cone from the tip's edge that holds the whole head
};

}  // namespace curvesup
