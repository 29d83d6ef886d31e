#pragma once

#include <vector>

#include "curvesup/motion/motion.h"
#include "motion/cell.h"

namespace curvesup {

// One end of a travel: a printing pose, or a station (tilt and branch of no interest).
struct TravelEnd {
  bool station = false;
  Vec3 tip = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
  double yaw = 0.0;
  int branch = 0;
  Joints joints{};
  Pose pose;
  Index layer = kNone;
};

struct TravelPlan {
  std::vector<Travel> moves;
  bool clear = true;
  Contact contact;        // when not clear
  const char* body = "";  // what touches; null where the arm reaches no pose above an end of the way
};

// Moves from one end to another clear of everything laid before toolpath point `before`: back along the nozzle's own
// axis, across, and down along the axis of the next pose. Low hops are tried first, then ways over the top; every way
// is proved on samples of it before it is taken. The last way is returned with clear = false when all touch.
//   via  optional station in between (filament change)
[[nodiscard]] TravelPlan plan_travel(const Cell& cell, const Deposit& deposit, const TravelEnd& from,
                                     const TravelEnd& to, const TravelEnd* via, Index before);

}  // namespace curvesup
