#include "curvesup/core/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

namespace curvesup {

void parallel_for(std::size_t count, std::size_t grain, const RunContext& run,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  grain = std::max<std::size_t>(grain, 1);
  const std::size_t chunks = chunk_count(count, grain);
  std::atomic<std::size_t> next{0};
  std::mutex failure_mutex;
  std::size_t failed_chunk = std::numeric_limits<std::size_t>::max();
  std::exception_ptr failure;

  auto work = [&] {
    for (std::size_t chunk = next.fetch_add(1); chunk < chunks; chunk = next.fetch_add(1)) {
      try {
        run.check_stop();
        body(chunk * grain, std::min(count, (chunk + 1) * grain), chunk);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (chunk < failed_chunk) {
          failed_chunk = chunk;
          failure = std::current_exception();
        }
        next.store(chunks);  // chunks start in order, so every lower one has been started already
      }
    }
  };

  const std::size_t workers = std::min<std::size_t>(std::max(run.threads, 1), chunks);
  {
    std::vector<std::jthread> helpers;
    for (std::size_t i = 1; i < workers; ++i) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace curvesup
