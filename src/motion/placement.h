#pragma once

#include "curvesup/motion/motion.h"
#include "motion/cell.h"

namespace curvesup {

struct PartPlacement {
  Vec3 offset_mm = Vec3::Zero();
  double rotation_rad = 0.0;
};

// Where the part is printed. Placement::as_modelled: where it stands. Placement::automatic: of a few turns about z and
// shifts that keep it on the platform, the one whose sampled tips are reached most often, then most comfortably, then
// the one that moves it least.
[[nodiscard]] PartPlacement place_part(const Toolpaths& toolpaths, const Cell& cell, const MotionOptions& options,
                                       const RunContext& run);

}  // namespace curvesup
