#pragma once

#include <vector>

#include "curvesup/motion/motion.h"
#include "motion/cell.h"
#include "motion/head_look.h"
#include "motion/nozzle_axis.h"
#include "motion/print_order.h"

namespace curvesup {

// Chooses the nozzle axes of all paths of a run and thins their points to waypoints (`axes` and `drafts`), so that the head
// touches nothing and the arm reaches every point. What stands in the way is met in this order: the axis tilts, as little as
// possible; the path passes before those of its own piece that it touches, which changes `order` and `placed`; its tips rise
// (`raises`). Returns what is left, by path.
[[nodiscard]] std::vector<std::vector<AxisFault>> choose_axes(const Cell& cell, const MotionOptions& options, PrintOrder& order,
                                                              PlacedPaths& placed, const RunContext& run);

}  // namespace curvesup
