#pragma once

#include <span>
#include <vector>

#include "curvesup/motion/motion.h"

namespace curvesup {

// A waypoint before the arm is chosen. volume, duration of the segment that ends here.
struct DraftPoint {
  Vec3 tip = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
  Vec3 normal = Vec3::UnitZ();
  double volume_mm3 = 0.0;
  double duration_s = 0.0;
  Index point = kNone;
};

// The points of one path without those that are not needed: every dropped point lies within the chord tolerance of the
// segment that passes it, its axis within the axis tolerance of the one interpolated there, and the volume laid up to
// it within the bead tolerance. Points nearer than min_segment are merged; where a place between them stands for them, it
// has the normal of that place, and an axis within max_tilt_deviation of it. First and last point stay; volumes and
// durations are summed, so both are conserved. Duration: tip length over feed, longer where the melt rate needs it.
[[nodiscard]] std::vector<DraftPoint> thin_waypoints(std::span<const PathPoint> points, std::span<const Vec3> tips,
                                                     std::span<const Vec3> axes, Index first_point,
                                                     double max_flow_mm3_s, const Tolerances& tolerances);

// Blend radii of one chain: at most blend_fraction of the shorter neighbour, corner cut within corner_mm, the circle's
// v^2 / R within the acceleration, no blend at sharper turns than max_blend_turn nor below min_blend. Ends are stops.
void set_blends(std::span<Waypoint> chain, const Tolerances& tolerances, double acceleration_mm_s2);

}  // namespace curvesup
