#pragma once

#include "curvesup/motion/machine.h"
#include "curvesup/pipeline/config.h"

namespace curvesup {

// The `machine` section of a resolved config (every key of machine_keys() present, without the prefix) as a Machine.
// Throws Error{usage} naming the key when one is missing, or when values contradict each other.
[[nodiscard]] Machine machine_from_config(const Json& machine_section);

}  // namespace curvesup
