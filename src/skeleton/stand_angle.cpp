#include "curvesup/skeleton/stand_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curvesup {

namespace {
constexpr double kWidthPerRecess = 1.2;
constexpr double kFootPart = 0.4;  // of its radius a trunk has where it stands on the model
}

double stand_angle(const Vec3& normal, const Vec3& up, const Vec3& axis) {
  const double rise = normal.dot(up);
  const Vec3 level = normal - rise * up;
  const double out = level.norm();
  if (out <= 0.0) return std::numbers::pi / 4.0;
  const double lean = std::atan2(axis.dot(level) / out, axis.dot(up));
  return std::min(std::numbers::pi / 4.0, std::atan2(kWidthPerRecess * rise, out) - lean);
}

Foot foot_of(const Vec3& normal, const Vec3& up, const Vec3& axis, double trunk_radius_mm, double thinnest_mm) {
  Foot foot;
  foot.slope = std::tan(std::max(kSlenderestStand, stand_angle(normal, up, axis)));
  foot.radius_mm = std::max(thinnest_mm, normal.dot(up) * std::max(thinnest_mm, kFootPart * trunk_radius_mm));
  const double rise = axis.dot(normal);
  foot.depth_mm = foot.radius_mm / (foot.slope + rise / std::sqrt(std::max(1.0 - rise * rise, 1e-12)));
  return foot;
}

}  // namespace curvesup
