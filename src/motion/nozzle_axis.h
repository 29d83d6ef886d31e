#pragma once

#include <span>
#include <vector>

#include "curvesup/motion/motion.h"
#include "motion/cell.h"

namespace curvesup {

// Why no allowed nozzle axis serves at a point of a path.
struct AxisFault {
  Index point = kNone;
  bool reach = false;  // else a contact
  ArmFault arm = ArmFault::none;
  Contact contact;  // contact.point == kNone: the platform
};

// `axis` pulled towards `centre` until it is within `limit` radians of it; unit vectors.
[[nodiscard]] Vec3 limited_axis(const Vec3& axis, const Vec3& centre, double limit);

// Unit vectors up to `most` radians from `axis`, itself among them, a few degrees apart.
[[nodiscard]] std::vector<Vec3> directions_around(const Vec3& axis, double most);

// Nozzle axes of one path from its layer normals: turned towards their neighbours where the normals turn faster than
// max_tilt_rate, but never more than max_tilt_deviation from the normal.
void smooth_axes(std::span<const PathPoint> points, std::span<const Vec3> tips, const Tolerances& tolerances,
                 std::span<Vec3> axes);

// Points of a path, ascending, that are no farther apart than tilts are chosen, `extra` ones among them.
[[nodiscard]] std::vector<std::size_t> key_points(std::span<const Vec3> tips, std::span<const Vec3> axes,
                                                  std::span<const Index> extra);

// Tilts the axes of one path, as little as possible, so that the head touches neither platform nor what is printed
// before each point, and the arm reaches every point at some turn of the head. Tilts are chosen at key points by
// dynamic programming over directions within max_tilt_deviation of the normal, and interpolated between. Returns the
// first fault that no allowed tilt removes, if any; its axis stays as near the normal as smoothing left it.
//   first_point  index of points[0] in Toolpaths::points
//   before       for each point: what lies before this toolpath point counts as printed
//   extra_keys   ascending; points of the path that are keys whatever their distance; with any, poses half way to the
//                neighbouring points count too
//   known_free   set for the key points that were found free of contact as they stood, when no axis was tilted
std::vector<AxisFault> tilt_axes(const Cell& cell, const Deposit& deposit, Index first_point,
                                 std::span<const PathPoint> points, std::span<const Vec3> tips,
                                 std::span<const Index> before, const MotionOptions& options,
                                 std::span<const Index> extra_keys, std::span<Vec3> axes, std::span<char> known_free);

// The height above the tip plane up to which material is the nozzle's own business: one bead.
[[nodiscard]] double free_height(const PathPoint& point);

// True when some turn of the head and some branch reach the tip; `fault` says why not (the least severe one met).
// yaw_hint and branch_hint are tried first and updated.
struct ReachHint {
  double yaw = 0.0;
  int branch = 0;
};
[[nodiscard]] bool reachable(const Cell& cell, const Vec3& tip, const Vec3& axis, int yaw_samples, ReachHint& hint,
                             ArmFault* fault = nullptr);

// Turns of the head that are tried, nearest to 0 first; never half a turn, where rotation vectors jump.
[[nodiscard]] std::vector<double> yaw_values(int samples);

}  // namespace curvesup
