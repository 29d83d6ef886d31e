#pragma once

#include "toolpath/ridge.h"

namespace curvesup::toolpath {

struct ZigzagOptions {
  double spacing = 0.8;       // of neighbouring lines, along the surface
  double inset = 1.2;         // lines end that far from the border
  double narrowest = 0.0;     // lines are left out under a medial line that is lower than this: a centre line runs there
  double shortest = 0.6;      // shorter lines are left out
  double angle = 0.0;         // radians, of the lines' normal, from the x axis
};

// Parallel lines over a piece as open tracks (closed where one runs in a circle): curves of equal distance, along the
// surface, from the section of the piece by one plane, so that neighbours are `spacing` apart however the layer is bent. The
// planes of all pieces with one normal are multiples of the spacing apart: lines of layers stand over each other.
[[nodiscard]] std::vector<Track> trace_lines(const BorderDistance& distance, const Ridge& ridge, const ZigzagOptions& options);

// Signed distance of each vertex, along the surface, from the section by the plane through `origin` across `direction`.
[[nodiscard]] std::vector<double> distance_from_section(const PieceMesh& mesh, const Vec3& origin, const Vec3& direction);

}  // namespace curvesup::toolpath
