#pragma once

#include <cstddef>

namespace curvesup {

// Gives what the program has freed back to the system, which the heaps of the allocator, and of ended threads, would keep.
void release_free_memory();

// Does so each time that a count has grown by `step` since the last time.
class ReleasedInSteps {
 public:
  explicit ReleasedInSteps(std::size_t step) : step_(step) {}
  void at(std::size_t count) {
    if (count - released_ < step_) return;
    released_ = count;
    release_free_memory();
  }

 private:
  std::size_t step_, released_ = 0;
};

}  // namespace curvesup
