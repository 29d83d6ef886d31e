#include "motion/motion_checks.h"

#include "curvesup/core/format.h"

namespace curvesup {
namespace {

std::string first_unreachable(const MotionReport& report) {
  if (report.unreachable.empty()) return "every waypoint is reached";
  const UnreachableWaypoint& first = report.unreachable.front();
  return format("path %d, point %d at (%.2f, %.2f, %.2f): %s", first.path, first.point, first.tip_mm.x(), first.tip_mm.y(),
                first.tip_mm.z(), first.reason.c_str());
}

std::string first_collision(const MotionReport& report) {
  if (report.collisions.empty()) return "head and arm touch neither platform nor printed material";
  const MotionCollision& first = report.collisions.front();
  return format("path %d, point %d at (%.2f, %.2f, %.2f): %s", first.path, first.point, first.tip_mm.x(), first.tip_mm.y(),
                first.tip_mm.z(), first.what.c_str());
}

}  // namespace

std::vector<Check> motion_checks(const Motion& motion, const MotionReport& report, const MotionFigures& figures, const Machine& machine) {
  constexpr double kPoseTolerance = 1e-6;  // m and rad, between joints and pose
  const ChainFigures& worst = figures.worst;
  const auto colliding = static_cast<double>(report.colliding_waypoints + report.colliding_travels);
  return {
      check_at_most("motion.unreachable", static_cast<double>(report.unreachable_waypoints), 0, first_unreachable(report)),
      check_at_most("motion.collisions", colliding, 0, first_collision(report)),
      check_at_most("motion.forward_kinematics_m", worst.position_m, kPoseTolerance,
                    "largest distance between the tip that the joints bring about and the pose"),
      check_at_most("motion.forward_kinematics_rad", worst.rotation_rad, kPoseTolerance,
                    "largest turn between the frame that the joints bring about and the pose"),
      check_at_most("motion.branch_jumps", static_cast<double>(worst.jumps), 0,
                    "segments in which a joint turns more than arm.max_joint_step_rad"),
      check_at_most("motion.joint_speed_ratio", report.max_joint_speed_ratio, machine.arm.joint_speed_fraction + 1e-9,
                    "largest joint speed at the planned durations over its limit"),
      check_at_least("motion.singularity_metric", report.min_singularity_metric,
                     motion.waypoints.empty() ? 0.0 : machine.arm.min_singularity_metric, "least of |sin q5|, |sin q3|, shoulder margin"),
      check_at_most("motion.volume_error", figures.volume, 1e-9,
                    "largest relative difference between the volume of a path and that of its waypoints"),
      check_at_most("motion.near_waypoints", static_cast<double>(worst.near), 0,
                    "consecutive waypoints nearer than tolerances.min_segment_mm"),
      check_at_most("motion.tilt_deviation_deg", report.tilt_deviation_max_deg,
                    machine.tolerances.max_tilt_deviation.degrees() + 1e-6 + machine.tolerances.axis.degrees(),
                    "largest angle between nozzle axis and layer normal"),
  };
}

}  // namespace curvesup
