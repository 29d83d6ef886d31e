#include "motion/chain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/angle_between.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// The duration that feed, melt rate, joint speeds and the controller's rotation rule allow, and the speed to state
// for it.
void set_speed(const Cell& cell, const Waypoint& from, double duration, Waypoint& to) {
  const Speeds& speeds = cell.machine().speeds;
  const double length = (to.tip_mm - from.tip_mm).norm();
  const double turn = (to.pose.rotation_vector - from.pose.rotation_vector).norm();
  for (int j = 0; j < 6; ++j)
    duration = std::max(duration, std::abs(to.joints[j] - from.joints[j]) / cell.joint_speed(j));
  const double planned = std::max(length, 1e3 * turn / speeds.rotation_rad_per_m);
  duration = std::max(duration, planned / speeds.max_programmed_mm_s);
  to.duration_s = duration;
  to.speed_mm_s = planned / duration;
  to.rotation_limited = planned > length;
}

// Joints between two waypoints, before they are rounded to be kept.
void measure_joints(const Cell& cell, const Waypoint& before, const Waypoint& waypoint, ChainFigures& figures) {
  double step = 0.0;
  for (int j = 0; j < 6; ++j) {
    const double turned = std::abs(waypoint.joints[j] - before.joints[j]);
    step = std::max(step, turned);
    const double limit = cell.joint_speed(j) / cell.machine().arm.joint_speed_fraction;
    figures.max_joint_speed_ratio = std::max(figures.max_joint_speed_ratio, turned / waypoint.duration_s / limit);
  }
  figures.max_joint_step_rad = std::max(figures.max_joint_step_rad, step);
  figures.jumps += step > cell.machine().arm.max_joint_step_rad;
}

}  // namespace

void ChainFigures::add(const ChainFigures& other) {
  position_m = std::max(position_m, other.position_m);
  rotation_rad = std::max(rotation_rad, other.rotation_rad);
  max_tilt_deg = std::max(max_tilt_deg, other.max_tilt_deg);
  min_singularity_metric = std::min(min_singularity_metric, other.min_singularity_metric);
  max_joint_speed_ratio = std::max(max_joint_speed_ratio, other.max_joint_speed_ratio);
  max_joint_step_rad = std::max(max_joint_step_rad, other.max_joint_step_rad);
  rotation_limited += other.rotation_limited;
  stops += other.stops;
  near += other.near;
  jumps += other.jumps;
  colliding += other.colliding;
}

std::vector<Waypoint> make_waypoints(const Cell& cell, const ArmSection& section, PathMotion& chain,
                                     ChainFigures& figures) {
  std::vector<Waypoint> waypoints;
  waypoints.reserve(section.points.size());
  figures.deviations_deg.reserve(section.points.size());
  double rotation = 0.0;
  for (const ArmPoint& point : section.points) {
    Waypoint waypoint;
    waypoint.tip_mm = point.draft.tip;
    waypoint.axis = point.draft.axis;
    waypoint.joints = point.joints;
    waypoint.point = point.draft.point;
    const Frame frame = cell.tcp_frame(point.draft.tip, point.draft.axis, point.yaw);
    const Vec3 near = waypoints.empty() ? Vec3(Vec3::Zero()) : waypoints.back().pose.rotation_vector;
    waypoint.pose = {frame.translation(), rotation_vector_near(frame.linear(), near)};
    if (!waypoints.empty()) {
      const Waypoint& before = waypoints.back();
      waypoint.volume_mm3 = point.draft.volume_mm3;
      set_speed(cell, before, point.draft.duration_s, waypoint);
      chain.length_mm += (waypoint.tip_mm - before.tip_mm).norm();
      chain.volume_mm3 += waypoint.volume_mm3;
      chain.duration_s += waypoint.duration_s;
      measure_joints(cell, before, waypoint, figures);
      rotation += (waypoint.pose.rotation_vector - before.pose.rotation_vector).norm();
    }
    const double deviation = angle_between(waypoint.axis, point.draft.normal) / kDegree;
    chain.max_tilt_deviation_deg = std::max(chain.max_tilt_deviation_deg, deviation);
    figures.deviations_deg.push_back(static_cast<float>(deviation));
    waypoints.push_back(waypoint);
  }
  chain.rotation_rad_per_m = chain.length_mm > 0.0 ? 1e3 * rotation / chain.length_mm : 0.0;
  set_blends(waypoints, cell.machine().tolerances, 1e3 * cell.machine().speeds.print_acceleration_m_s2);
  return waypoints;
}

void measure_chain(const Cell& cell, const Motion& motion, const PathMotion& chain, ChainFigures& figures) {
  const Arm& arm = cell.machine().arm;
  const Frame tcp = to_frame(cell.machine().tool.tcp);
  const double d4 = std::abs(arm.dh[3].d_m);
  double least_upright = 1.0;
  Waypoint before;
  for (Index w = 0; w < chain.waypoint_count; ++w) {
    const Waypoint waypoint = motion.waypoints[chain.first_waypoint + w];
    const std::array<Frame, 6> frames = link_frames(arm, waypoint.joints);
    const Frame reached = frames[5] * tcp;
    figures.position_m = std::max(figures.position_m, (reached.translation() - waypoint.pose.position_m).norm());
    // Of a rotation by a small angle, the matrix less the identity is that angle times the root of two long.
    const double apart = (reached.linear() - rotation_of(waypoint.pose.rotation_vector)).norm();
    figures.rotation_rad = std::max(figures.rotation_rad, apart / std::numbers::sqrt2);
    const Vec3 wrist = frames[4].translation();
    const double shoulder = (std::sqrt(wrist.head<2>().squaredNorm()) - d4) / d4;
    figures.min_singularity_metric =
        std::min({figures.min_singularity_metric, std::abs(std::sin(waypoint.joints[4])),
                  std::abs(std::sin(waypoint.joints[2])), shoulder});
    least_upright = std::min(least_upright, waypoint.axis.z());
    figures.rotation_limited += waypoint.rotation_limited;
    if (w > 0) {
      figures.stops += w + 1 < chain.waypoint_count && waypoint.blend_mm == 0.0;
      figures.near += (waypoint.tip_mm - before.tip_mm).norm() < 0.999 * cell.machine().tolerances.min_segment_mm;
    }
    before = waypoint;
  }
  figures.max_tilt_deg = std::acos(std::clamp(least_upright, -1.0, 1.0)) / kDegree;
}

}  // namespace curvesup
