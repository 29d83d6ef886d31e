#pragma once

#include <cstddef>
#include <functional>

#include "curvesup/core/run_context.h"

namespace curvesup {

// Calls body(begin, end, chunk) for the chunks [0, grain), [grain, 2 grain), ... of [0, count) on run.threads threads.
// The chunks do not depend on the number of threads: a body that writes only to elements of its own range, or to a slot
// of its own chunk, gives the same result for any thread count. Checks run.stop before each chunk. The exception of the
// lowest failing chunk is rethrown after all threads have ended.
void parallel_for(std::size_t count, std::size_t grain, const RunContext& run,
                  const std::function<void(std::size_t begin, std::size_t end, std::size_t chunk)>& body);

[[nodiscard]] constexpr std::size_t chunk_count(std::size_t count, std::size_t grain) {
  return (count + grain - 1) / grain;
}

}  // namespace curvesup
