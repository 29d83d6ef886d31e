#pragma once

#include <vector>

#include "motion/cell.h"
#include "motion/chain.h"

namespace curvesup {

// What is measured of all chains while they are planned.
struct MotionFigures {
  ChainFigures worst;
  double volume = 0.0;  // largest relative difference between a path's volume and that of its waypoints
};

// The checks of the motion stage, on a report that is complete but for them.
[[nodiscard]] std::vector<Check> motion_checks(const Motion& motion, const MotionReport& report, const MotionFigures& figures,
                                               const Machine& machine);

}  // namespace curvesup
