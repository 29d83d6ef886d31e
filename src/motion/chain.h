#pragma once

#include <vector>

#include "motion/arm_path.h"

namespace curvesup {

// A path with its arm, or no section when it was not reached.
struct PlannedPath {
  ArmPath arm;
  bool links_free = false;  // nothing comes near forearm and wrist
};

// What is measured along chains.
struct ChainFigures {
  double position_m = 0.0, rotation_rad = 0.0;  // worst difference between pose and forward kinematics of the joints
  double max_tilt_deg = 0.0;
  double min_singularity_metric = 1.0;
  double max_joint_speed_ratio = 0.0, max_joint_step_rad = 0.0;
  std::size_t rotation_limited = 0, stops = 0;
  std::size_t near = 0, jumps = 0;
  std::vector<float> deviations_deg;  // nozzle axis against layer normal, of each waypoint
  std::size_t colliding = 0;          // waypoints
  std::size_t first_colliding = 0;
  Contact first_contact;
  const char* first_body = "";

  // Takes over what is worst, and counts; not lists.
  void add(const ChainFigures& other);
};

// The waypoints of a section, with poses, speeds and blends; fills the lengths, volume, duration and rotation of `chain`.
[[nodiscard]] std::vector<Waypoint> make_waypoints(const Cell& cell, const ArmSection& section, PathMotion& chain,
                                                   ChainFigures& figures);

// Measures a chain on its waypoints as they are kept.
void measure_chain(const Cell& cell, const Motion& motion, const PathMotion& chain, ChainFigures& figures);

}  // namespace curvesup
