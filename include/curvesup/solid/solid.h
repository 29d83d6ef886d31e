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
};

}  // namespace curvesup
