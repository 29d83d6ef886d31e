#pragma once

#include <vector>

#include "curvesup/motion/motion.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// When the nozzle is where, in the frame of the toolpaths; precise enough to be looked at.
struct PrintClock {
  struct Travel {
    double begin_s = 0.0, end_s = 0.0;
    std::vector<Vec3> tips;  // at least two
  };
  std::vector<float> point_s;         // by toolpath point
  std::vector<Eigen::Vector3f> axis;  // by toolpath point: nozzle axis; the layer normal without a motion
  std::vector<Travel> travels;  // in order of time
  double end_s = 0.0;
};

// From the motion's durations when there is one, else from feeds, with an assumed travel speed and time for each jump.
[[nodiscard]] PrintClock run_clock(const Toolpaths& toolpaths, const Motion* motion);

}  // namespace curvesup
