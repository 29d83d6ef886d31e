#pragma once

#include "curvesup/core/types.h"

namespace curvesup {

// A support solid as an implicit function; inside is value(p) >= 0 (paper, equation 2). Safe to call from many threads.
class Solid {
 public:
  virtual ~Solid() = default;
  [[nodiscard]] virtual double value(const Vec3& p) const = 0;

  struct Bounds {
    double low = 0.0, high = 0.0;
  };
  // Bounds that enclose value(p) for every p in the ball; conservative, never wrong.
  [[nodiscard]] virtual Bounds bounds(const Vec3& centre, double radius) const = 0;

  // Four questions that a solid may answer faster than by value() and bounds().
  // value(p) >= 0, exactly.
  [[nodiscard]] virtual bool inside(const Vec3& p) const { return value(p) >= 0.0; }
  // Whether value(p) < 0 is proved for every p in the ball.
  [[nodiscard]] virtual bool surely_outside(const Vec3& centre, double radius) const {
    return bounds(centre, radius).high < 0.0;
  }
  // No part of the solid with a smaller radius than this lies in the ball. 0 where nothing is known; the search may end as
  // soon as the answer is known to be `enough` or less.
  [[nodiscard]] virtual double thinnest_radius(const Vec3& /*centre*/, double /*radius*/, double /*enough*/) const { return 0.0; }
  // Whether value(p) >= 0 is proved for every p in the ball.
  [[nodiscard]] virtual bool surely_inside(const Vec3& centre, double radius) const {
    return bounds(centre, radius).low >= 0.0;
  }
};

}  // namespace curvesup
