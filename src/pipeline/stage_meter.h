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

// Gives what the program has freed back to the system: the heaps of ended threads would keep it from the next stage.
void release_free_memory();

}  // namespace curvesup
