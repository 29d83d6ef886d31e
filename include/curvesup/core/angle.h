#pragma once

#include <cmath>
#include <numbers>

namespace curvesup {

// An angle that cannot be mistaken for another unit.
class Angle {
 public:
  constexpr Angle() = default;
  static constexpr Angle degrees(double value) { return Angle(value * std::numbers::pi / 180.0); }
  static constexpr Angle radians(double value) { return Angle(value); }

  [[nodiscard]] constexpr double radians() const { return radians_; }
  [[nodiscard]] constexpr double degrees() const { return radians_ * 180.0 / std::numbers::pi; }
  [[nodiscard]] double sin() const { return std::sin(radians_); }
  [[nodiscard]] double cos() const { return std::cos(radians_); }
  [[nodiscard]] double tan() const { return std::tan(radians_); }

  friend constexpr auto operator<=>(Angle, Angle) = default;

 private:
  explicit constexpr Angle(double radians) : radians_(radians) {}
  double radians_ = 0.0;
};

}  // namespace curvesup
