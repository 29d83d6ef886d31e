#pragma once

#include "toolpath/ridge.h"

namespace curvesup::toolpath {

// Rings at (i + 1/2) w from the border, or where Ridge puts them, for i < max_rings, the border on their right. Where the
// ridge leaves the strip to a centre line they are cut, and closed across it. Outermost first.
[[nodiscard]] std::vector<Track> trace_rings(const BorderDistance& distance, const Ridge& ridge, double width, int max_rings);

}  // namespace curvesup::toolpath
