#pragma once

#include <string>

namespace curvesup {

// About as many tets as TetGen makes of a volume when none may be larger than `max_tet_volume`: measured on spheres whose
// triangles are not finer than that.
[[nodiscard]] constexpr double expected_tets(double volume, double max_tet_volume) { return 1.6 * volume / max_tet_volume; }

// More tets than this are no print but a mistake in units: half a minute of TetGen and gigabytes before the first layer.
constexpr double kMostTets = 5e6;

// The power of ten that brings a part of this size below half a metre, for messages about units.
[[nodiscard]] std::string scale_that_helps(double size_mm);

}  // namespace curvesup
