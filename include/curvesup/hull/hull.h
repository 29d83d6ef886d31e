#pragma once

#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/overhang/overhang.h"

namespace curvesup {

struct HullOptions {
  Angle self_support = Angle::degrees(45);
  double edge_length_mm = 6.0;   // L of the remeshed hull
  double margin_mm = 3.0;        // delta, at least L / 2; grown by the stage when hull and model intersect
  double extra_margin_mm = 0.0;  // room for the solid's thickest strut around the trajectories
};

struct HullReport {
  Index trajectory_points = 0;
  Index vertices = 0, faces = 0;
  double margin_mm = 0.0;  // the one used in the end
  double edge_length_mm = 0.0;
  double model_clearance_mm = 0.0;       // smallest distance from a boundary vertex of the model to the hull
  double trajectory_clearance_mm = 0.0;  // the same from the trajectories widened by extra_margin; 0 without them
  double low_z_mm = 0.0;                 // of the hull: always below the platform
  int attempts = 1;
  std::vector<Check> checks;
};

// Trajectories of the overhang vertices and minima down to the platform, and a closed, outward-oriented, nearly convex
// triangle surface around them and the model, also below the platform (paper, section III-A, "conservative hull").
// A trajectory starts along -d_p in steps of one layer thickness (that of the model's median gradient) and turns by
// self_support/20 a step towards (0,0,-1), about a fixed axis, until it points there; it ends on the platform.
// The convex hull is enlarged by `margin` in all directions and remeshed to edges of length L, which rounds it inwards
// again: guaranteed is that hull and model do not intersect (exact test) and that the model, and the trajectories widened
// sideways by extra_margin, keep half the margin from the hull; when they do not, L shrinks, and the margin grows from the third attempt.
// Throws Error{geometry} when no attempt gives that, Error{usage} when edges of that length would be a million triangles. Same input, same result.
struct HullResult {
  TriangleMesh surface;
  HullReport report;
};

[[nodiscard]] HullResult build_hull(const Model& model, const ScalarField& field, const Overhang& overhang, int layer_count,
                                    const HullOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
