#include "motion/head_shape.h"

#include <algorithm>
#include <cmath>

namespace curvesup {

HeadShape::HeadShape(const Tool& tool)
    : tip_radius_(tool.tip_radius_mm),
      slope_(tool.cone_half_angle.tan()),
      cone_length_(tool.cone_length_mm),
      head_radius_(tool.head_radius_mm),
      length_(tool.head_length_mm) {
  hull_slope_ = std::max(slope_, (head_radius_ - tip_radius_) / std::max(1e-9, cone_length_));
  hull_cosine_ = 1.0 / std::sqrt(1.0 + hull_slope_ * hull_slope_);
  const double cone_end = tip_radius_ + slope_ * cone_length_;
  widest_ = std::max(cone_end, head_radius_);
  profile_ = {{{0.0, 0.0},
               {0.0, tip_radius_},
               {cone_length_, cone_end},
               {cone_length_, head_radius_},
               {length_, head_radius_},
               {length_, 0.0}}};
}

bool HeadShape::inside(double height, double radius) const {
  if (height < 0.0 || height > length_) return false;
  if (height <= cone_length_ && radius <= tip_radius_ + slope_ * height) return true;
  return height >= cone_length_ && radius <= head_radius_;
}

double HeadShape::distance(double height, double radius) const {
  double nearest = 1e300;
  for (std::size_t i = 0; i + 1 < profile_.size(); ++i) {
    const double along_h = profile_[i + 1].height - profile_[i].height,
                 along_r = profile_[i + 1].radius - profile_[i].radius;
    const double h = height - profile_[i].height, r = radius - profile_[i].radius;
    const double squared = along_h * along_h + along_r * along_r;
    const double t = squared > 0.0 ? std::clamp((h * along_h + r * along_r) / squared, 0.0, 1.0) : 0.0;
    const double dh = h - t * along_h, dr = r - t * along_r;
    nearest = std::min(nearest, dh * dh + dr * dr);
  }
  return inside(height, radius) ? -std::sqrt(nearest) : std::sqrt(nearest);
}

double HeadShape::distance(const Vec3& point, const Vec3& tip, const Vec3& axis) const {
  const Vec3 from_tip = point - tip;
  const double height = from_tip.dot(axis);
  return distance(height, std::sqrt(std::max(0.0, from_tip.squaredNorm() - height * height)));
}

double HeadShape::lowest_z(const Vec3& tip, const Vec3& axis, double from_height) const {
  const double level = std::sqrt(std::max(0.0, 1.0 - axis.z() * axis.z()));
  const auto ring = [&](double height, double radius) { return tip.z() + height * axis.z() - radius * level; };
  return std::min({ring(from_height, tip_radius_ + slope_ * from_height),
                   ring(cone_length_, std::max(tip_radius_ + slope_ * cone_length_, head_radius_)),
                   ring(length_, head_radius_)});
}

}  // namespace curvesup
