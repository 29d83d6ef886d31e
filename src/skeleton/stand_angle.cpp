#include "curvesup/skeleton/stand_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curvesup {

namespace {
constexpr double kWidthPerRecess = 1.2;
}

double stand_angle(const Vec3& normal, const Vec3& up, const Vec3& axis) {
  const double rise = normal.dot(up);
  const Vec3 level = normal - rise * up;
  const double out = level.norm();
  if (out <= 0.0) return std::numbers::pi / 4.0;
  const double lean = std::atan2(axis.dot(level) / out, axis.dot(up));
  return std::min(std::numbers::pi / 4.0, std::atan2(kWidthPerRecess * rise, out) - lean);
}

}  // namespace curvesup
