#pragma once

#include <array>
#include <vector>

#include "curvesup/solid/convolution_solid.h"

namespace curvesup {

// Holds the kernels that reach into the ball in focus, those without a cone as columns of numbers, so that a loop over them does
// several at once.
class ConvolutionSolid::Local : public LocalSolid {
 public:
  explicit Local(const ConvolutionSolid& solid) : LocalSolid(solid), solid_(solid) {}

  using LocalSolid::focus;
  void focus(const Vec3& centre, double radius, const Neighbourhood& around, double half_height) override;
  [[nodiscard]] double value(const Vec3& p) override;
  [[nodiscard]] bool surely_outside(const Vec3& centre, double radius) override;
  [[nodiscard]] bool surely_inside(const Vec3& centre, double radius) const override;
  [[nodiscard]] double thinnest_radius(const Vec3& centre, double radius, double enough) const override;

 private:
  enum Column { kStartX, kStartY, kStartZ, kDirectionX, kDirectionY, kDirectionZ, kLength, kReach2, kInverseReach2, kColumns };

  const ConvolutionSolid& solid_;
  std::vector<Index> near_;        // ascending, so those with a cone come last
  std::size_t without_cone_ = 0, rows_ = 0;
  std::vector<double> table_, most_;
};

}  // namespace curvesup
