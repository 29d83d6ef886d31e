#pragma once

#include <cmath>

#include "curvesup/core/types.h"

namespace curvesup {

// Radians between two vectors, accurate for small angles also.
[[nodiscard]] inline double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace curvesup
