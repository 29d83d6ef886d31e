#pragma once

#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/skeleton/skeleton.h"

namespace curvesup {

struct SupportCertificateOptions {
  Angle self_support = Angle::degrees(45);
  double leaf_radius_mm = 0.8;
  double bead_width_mm = 0.8;
  double top_gap_mm = 0.0;
  std::vector<Index> enforced_faces = {};  // of Model::boundary: overhang whatever their slope
  double samples_per_mm2 = 4.0;         // at least; every face has one
  double min_covered_fraction = 0.995;  // of the overhang's area
};

// What stands between the model and the air, found out anew from the model, the field and the printed layers. Shares no
// code with the stages that made the support.
//
// An overhang sample is covered when, looking along -d_p from it,
//   - printed support lies within 1.5 layers + top_gap_mm, and leaf_radius_mm sideways, or
//   - a layer of the model lies within 1.5 layers, and half a bead sideways, or
//   - the platform lies within one layer.
// A piece (face-connected part of a support sheet) rests when, under at least a fifth of its area, an earlier support
// sheet, an earlier model layer or the platform lies within 1.5 layers along -d_p.
// "A layer" is the local thickness 1 / (N m |grad G|), of the two that meet the thicker one.
struct SupportCertificate {
  struct UncoveredFace {
    Index face = kNone;  // of Model::boundary
    double area_mm2 = 0.0;
  };
  struct FloatingPiece {
    Index layer = 0;
    int pass = 0;
    Vec3 centroid = Vec3::Zero();
    double area_mm2 = 0.0;
  };

  Index samples = 0;
  double overhang_area_mm2 = 0.0;  // without what the user blocked
  double blocked_area_mm2 = 0.0;
  double covered_fraction = 1.0;  // of overhang_area_mm2
  double uncovered_area_mm2 = 0.0;
  double floor_fraction = 1.0;           // the same with no support at all: what model layers and platform cover
  std::vector<UncoveredFace> uncovered;  // ascending by face

  Index pieces = 0;  // of printed support
  std::vector<FloatingPiece> floating;

  double max_edge_angle_deg = 0.0;  // at upper ends, against -grad G of the tet entered
  std::vector<Index> steep_edges;
  std::vector<Index> edges_through_model;
  std::vector<Index> ungrounded_leaves;  // nodes
  std::vector<Index> miscounted_nodes;   // branch counts that do not add up here
  std::vector<Index> bad_ends;  // platform ends off z = 0, model ends off an upward face or under a layer from a leaf
  Index leaves = 0, leaf_count_at_ends = 0;

  std::vector<Check> checks;  // certificate.*
};

// `blocked_faces`: Overhang::blocked. `field` is the extended field on the whole domain; `printed` holds model layers
// and trimmed support. `skeleton` may be null when the support has none (method envelope or none); its checks are left
// out then. O(samples + triangles + edges) on grids; dome with 31 000 samples and 10^6 triangles well under a second.
[[nodiscard]] SupportCertificate certify_support(const Model& model, const std::vector<Index>& blocked_faces,
                                                 const Domain& domain, const ScalarField& field,
                                                 const LayerStack& printed, const Skeleton* skeleton,
                                                 const SupportCertificateOptions& options = {},
                                                 const RunContext& run = {});

}  // namespace curvesup
