#include "skeleton/angle_limit.h"

#include <cmath>

#include "core/angle_between.h"

namespace curvesup {

namespace {
constexpr double kSlack = 1e-9;   // radians: rounding of exact turns
constexpr double kNear = 1e-6;    // cosines that differ by more leave no doubt
}  // namespace

AngleLimit::AngleLimit(double radians) : radians_(radians), cosine_(std::cos(radians)), sine_(std::sin(radians)) {}

bool AngleLimit::within(const Vec3& a, const Vec3& b, double slack) const {
  const double cosine = a.dot(b);
  return std::abs(cosine - cosine_) > kNear ? cosine > cosine_ : angle_between(a, b) <= radians_ + slack;
}

bool AngleLimit::holds(const Vec3& a, const Vec3& b) const { return within(a, b, kSlack); }

Vec3 AngleLimit::turn(const Vec3& from, const Vec3& to) const {
  if (within(from, to, 0.0)) return to;
  Vec3 across = to - from.dot(to) * from;
  if (across.norm() < 1e-12) across = from.unitOrthogonal();
  across.normalize();
  return (cosine_ * from + sine_ * across).normalized();
}

}  // namespace curvesup
