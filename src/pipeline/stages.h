#pragma once

#include <span>

#include "slice_state.h"

namespace curvesup {

// The stages of `slice` in their order.
[[nodiscard]] std::span<const Stage> slice_stages();

}  // namespace curvesup
