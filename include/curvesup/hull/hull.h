#pragma once

#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/overhang/overhang.h"

namespace curvesup {

struct HullOptions {
  Angle self_support = Angle::degrees(45);
  double edge_length_mm = 5.0;   // L of the remeshed hull
  double margin_mm = 3.0;        // delta, >= 0.6 L; grown by the stage when hull and model intersect
  double extra_margin_mm = 0.0;  // room for the solid's thickest strut around the trajectories
};

struct HullReport {
  Index trajectory_points = 0;
  Index vertices = 0, faces = 0;
  double margin_mm = 0.0;  // the one used in the end
  double edge_length_mm = 0.0;
  int attempts = 1;
};

// Trajectories of the overhang vertices down to the platform and a closed, outward-oriented triangle surface around them and
// the model, at least `margin` away from both, also below the platform (paper, section III-A, "conservative hull").
struct HullResult {
  TriangleMesh surface;
  HullReport report;
};

[[nodiscard]] HullResult build_hull(const Model& model, const ScalarField& field, const Overhang& overhang, int layer_count,
                                    const HullOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
