#pragma once

#include "curvesup/core/types.h"

namespace curvesup {

// Half the opening angle, in radians, of the cone by which a trunk stands on a face of the model: pi / 4 on broad faces, less
// where the face is steep or the trunk leans out from it, below kSlenderestStand (even negative) where it would hang on a wall
// by its side. A layer d_p . x = h of that cone gets wider by tan(lean + angle) for each mm up, the wall below it recedes by
// m = tan of its steepness; at 1.2 m nine twentieths of what first comes out of the wall lie over it.
// `normal` of the face out of the model, `up` = d_p there, `axis` of the trunk upwards; all of unit length.
[[nodiscard]] double stand_angle(const Vec3& normal, const Vec3& up, const Vec3& axis);

inline constexpr double kSlenderestStand = 0.2;

// The cone by which a trunk stands on a face: its radius at the end, how much wider it gets for each mm up the trunk, and how far
// below the end the trunk goes on into the model, until its cone is all inside.
struct Foot {
  double radius_mm = 0.0;
  double slope = 1.0;
  double depth_mm = 0.0;
};
// `thinnest_mm`: no foot is thinner.
[[nodiscard]] Foot foot_of(const Vec3& normal, const Vec3& up, const Vec3& axis, double trunk_radius_mm, double thinnest_mm);

}  // namespace curvesup
