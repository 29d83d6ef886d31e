#pragma once

#include <algorithm>
#include <cmath>

#include "curvesup/solid/convolution_solid.h"

namespace curvesup {

constexpr double kBoundSlack = 1e-9;  // rounding of the sums that bounds must enclose

// Integral of s^2 (1 - s)^2 from 0 to s.
[[gnu::always_inline]] inline double kernel_integral(double s) { return s * s * s * (1.0 / 3.0 + s * (-0.5 + s * 0.2)); }

// What a strut adds at a point around which the ball of radius R cuts a chord of length 2 half, half2 its square, from its line, `along`
// from its start. Without branches, so that a loop can do several at once; never negative, so that a partial sum never
// exceeds the whole one.
[[gnu::always_inline]] inline double chord_contribution(double half2, double half, double along, double length, double inverse_reach2, double scale) {
  const double per_half = 0.5 / half, part = half2 * inverse_reach2;
  const double from = -along > -half ? -along : -half, to = length - along < half ? length - along : half;
  const double s0 = from * per_half + 0.5, s1 = to * per_half + 0.5;
  const double sum = scale * part * part * (kernel_integral(s1) - kernel_integral(s0));
  const double not_negative = sum > 0.0 ? sum : 0.0, between = to > from ? not_negative : 0.0;
  return half2 > 0.0 ? between : 0.0;
}

inline double ConvolutionSolid::Kernel::contribution(double distance2, double along, double scale) const {
  const double reach2 = reach * reach, half2 = reach2 - distance2;
  if (half2 <= 0.0) return 0.0;
  const double beyond = along - length;
  // Nothing of the strut in the ball: no root is needed to know.
  if ((along <= 0.0 && along * along >= half2) || (beyond >= 0.0 && beyond * beyond >= half2)) return 0.0;
  return chord_contribution(half2, std::sqrt(half2), along, length, 1.0 / reach2, scale);
}

// The other way round: from the farthest line, for the foot farthest from the strut's middle.
inline double ConvolutionSolid::Kernel::least_in_ball(const Vec3& centre, double radius, double scale) const {
  const Vec3 offset = centre - a;
  const double middle = offset.dot(direction);
  const double farthest = std::sqrt(std::max(0.0, offset.squaredNorm() - middle * middle)) + radius;
  return contribution(farthest * farthest, middle > 0.5 * length ? middle + radius : middle - radius, scale);
}

// F_e falls with the distance from the line, and with the distance between the point's foot and the strut's middle.
inline double ConvolutionSolid::Kernel::most_in_ball(const Vec3& centre, double radius, double scale) const {
  const Vec3 offset = centre - a;
  const double along = offset.dot(direction);
  const double distance2 = std::max(0.0, offset.squaredNorm() - along * along);
  const double limit = reach + radius;
  if (distance2 >= limit * limit) return 0.0;
  const double nearest = distance2 > radius * radius ? std::sqrt(distance2) - radius : 0.0;
  return contribution(nearest * nearest, std::clamp(0.5 * length, along - radius, along + radius), scale);
}

inline Vec3 ConvolutionSolid::Kernel::from_strut(const Vec3& p) const {
  const Vec3 offset = p - a;
  return offset - std::clamp(offset.dot(direction), 0.0, length) * direction;
}

inline double ConvolutionSolid::Kernel::at(const Vec3& p, double scale) const {
  const Vec3 offset = p - a;
  const double along = offset.dot(direction);
  return contribution(offset.squaredNorm() - along * along, along, scale);
}

inline bool ConvolutionSolid::Kernel::reaches(const Vec3& centre, double radius) const {
  const double limit = reach + (1.0 + kBoundSlack) * radius + kBoundSlack;
  return from_strut(centre).squaredNorm() < limit * limit;
}

}  // namespace curvesup
