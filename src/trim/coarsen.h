#pragma once

#include <span>

#include "trim/trimmed_sheet.h"

namespace curvesup {

struct CoarsenOptions {
  double border_mm = 0.018;   // farthest that the border moves
  double surface_mm = 0.010;  // farthest that a corner lies from the plane of the tet that its triangle is told to be in
  double height_mm = 0.10;    // triangles less high than this are made only in place of ones still less high
  double step_volume = 0.01;  // largest change of the volume under the triangles around one step, relative to it
  double volume = 5e-4;       // and of that under the whole sheet
};

struct CoarsenReport {
  double area_before_mm2 = 0.0, area_after_mm2 = 0.0;
  // Area times 1 / |grad G|: up to one factor what the sheet fills.
  double volume_before = 0.0, volume_after = 0.0;
};

// Merges vertices of a sheet where that hardly changes what is printed. All triangles of a tet lie in one plane, the layer's;
// `gradient` is that of G, per tet.
//
// Two neighbours on the border become one vertex, placed so that the border encloses the same area: in their plane, on
// the line in which two planes meet, or at the one of them that is in more than two. Vertices inside, most of them corners of
// needles that the layer got from the tets, move to a neighbour. Never moved: vertices that the untrimmed stack has too and
// that are on the border, their neighbours there (so the border to the model stays), and where the sheet is no manifold.
//
// The border stays within border_mm of what it was, loops keep three vertices or more, each triangle keeps the
// direction of its normal, its tet and, within surface_mm, its plane; pieces stay what they are. Linear: one sweep
// over the vertices of the border, and one over the others. Unused vertices stay in the list until `compact`.
CoarsenReport coarsen(TrimmedSheet& sheet, std::span<const Vec3> gradient, const CoarsenOptions& options = {});

}  // namespace curvesup
