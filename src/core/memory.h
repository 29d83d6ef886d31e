#pragma once

namespace curvesup {

// Gives what the program has freed back to the system, which the heaps of the allocator, and of ended threads, would keep.
void release_free_memory();

}  // namespace curvesup
