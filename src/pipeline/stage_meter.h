#pragma once

#include "curvesup/pipeline/slice.h"

namespace curvesup {

// Wall time, processor time and peak memory between construction and stop().
class StageMeter {
 public:
  StageMeter();
  [[nodiscard]] StageTime stop(std::string name) const;

 private:
  double wall_start_ = 0.0, cpu_start_ = 0.0;
};

}  // namespace curvesup
