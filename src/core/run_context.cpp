#include "curvesup/core/run_context.h"

#include "curvesup/core/error.h"

namespace curvesup {

void RunContext::check_stop() const {
  if (stop.stop_requested()) throw Error(ErrorKind::interrupted, "run", "interrupted");
}

}  // namespace curvesup
