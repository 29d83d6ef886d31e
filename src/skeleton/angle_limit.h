#pragma once

#include "curvesup/core/types.h"

namespace curvesup {

// An angle that directions, all of unit length, may deviate from each other.
class AngleLimit {
 public:
  explicit AngleLimit(double radians);

  // Up to the rounding of exact turns.
  [[nodiscard]] bool holds(const Vec3& a, const Vec3& b) const;
  // `from` turned by the angle towards `to`; stops at `to`. Antiparallel vectors turn about any axis.
  [[nodiscard]] Vec3 turn(const Vec3& from, const Vec3& to) const;
  [[nodiscard]] double radians() const { return radians_; }

 private:
  [[nodiscard]] bool within(const Vec3& a, const Vec3& b, double slack) const;
  double radians_, cosine_, sine_;
};

}  // namespace curvesup
