#pragma once

#include <optional>
#include <span>
#include <vector>

#include "motion/cell.h"
#include "motion/nozzle_axis.h"
#include "motion/waypoints.h"

namespace curvesup {

// A waypoint with the arm's posture.
struct ArmPoint {
  DraftPoint draft;
  double yaw = 0.0;
  Joints joints{};  // continuous along a section, within limits
};

// A run of waypoints in one branch of the arm.
struct ArmSection {
  int branch = 0;
  std::vector<ArmPoint> points;

  // The last point of the path that it passes; waypoints that divide a segment are none.
  [[nodiscard]] Index last_point(Index before) const;
};

struct ArmPath {
  std::vector<ArmSection> sections;  // each starts where the one before ended
  Index unreachable = kNone;         // toolpath point of the first waypoint without any posture
  ArmFault fault = ArmFault::none;
};

// Where the arm stands before a path: what a path prefers to go on with.
struct ArmState {
  bool known = false;
  double yaw = 0.0;
  int branch = 0;
  Joints joints{};
};

// Chooses turn of the head and branch along one path, by dynamic programming over yaw samples and the closed form's
// solutions at key waypoints: within limits, away from singularities, no branch change, little turning, as the arm
// stands before where that serves. Where no posture goes on, a new section begins. Long steps get waypoints in between,
// so that no joint turns more than max_joint_step in one segment; where a segment is too short for that, a new
// section begins too.
//   obstacles  what forearm and wrist must not touch as it lies when each waypoint is reached; may be null
[[nodiscard]] ArmPath plan_arm_path(const Cell& cell, const Deposit* obstacles, std::span<const DraftPoint> drafts,
                                    const MotionOptions& options, const ArmState& before);

// What plan_arm_path() tries first, in steps that do not need each other's joints: the turn of the head nearest to the
// one before with which the path can be held, as far as its key waypoints tell; the whole path held so, when that is
// comfortable all along and forearm and wrist keep clear of the obstacles; and the sections it is cut into.
[[nodiscard]] std::optional<double> held_yaw(const Cell& cell, std::span<const DraftPoint> drafts,
                                             const MotionOptions& options, double yaw_before, int branch);
[[nodiscard]] std::optional<ArmSection> hold_posture(const Cell& cell, const Deposit* obstacles,
                                                     std::span<const DraftPoint> drafts, int branch, double yaw);
[[nodiscard]] ArmPath cut_section(const Cell& cell, ArmSection section, const ArmState& before);

// The link of the arm that touches what is laid before a toolpath point, or null.
[[nodiscard]] const char* touching_link(const Cell& cell, const Deposit& deposit, const Joints& joints, Index before,
                                        double clearance, Contact* contact = nullptr);

}  // namespace curvesup
