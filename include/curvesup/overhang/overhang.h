#pragma once

#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/model/model.h"
#include "curvesup/overhang/region.h"

namespace curvesup {

struct OverhangOptions {
  Angle self_support = Angle::degrees(45);
  std::vector<Region> enforce =
      {};  // faces in here count as overhang whatever their slope, unless they lie on the platform
  std::vector<Region> block = {};  // faces and minima in here never count; stronger than enforce
};

// A boundary face with outward normal n overhangs if n . d_p + sin(alpha) <= 0 (d_p: unit gradient of G in the face's
// tet) and it does not lie on the platform (three |z| below 1e-6 of the bounding-box diagonal).
struct Overhang {
  std::vector<Index> faces;     // indices into Model::boundary, ascending
  std::vector<Index> vertices;  // of those faces, ascending
  std::vector<Index> minima;  // boundary vertices that are local minima of G, not on the platform, in no overhang face
  // Unit -d_p for vertices and then minima: area-weighted mean over the overhang faces around a vertex, over all
  // boundary faces around a minimum.
  std::vector<Vec3> vertex_direction;
  std::vector<Vec3> minimum_direction;
  double area_mm2 = 0.0;
  std::vector<Index> enforced;  // those of `faces` that only a region made overhang
  std::vector<Index> blocked;   // faces that would overhang but for a region; not in `faces`
  double enforced_area_mm2 = 0.0, blocked_area_mm2 = 0.0;
};

// Linear time (O(n log n) with regions). Throws Error{usage} on an angle outside [0, 90) degrees or a region without
// sense.
[[nodiscard]] Overhang find_overhang(const Model& model, const ScalarField& field, const OverhangOptions& options = {},
                                     const RunContext& run = {});

}  // namespace curvesup
