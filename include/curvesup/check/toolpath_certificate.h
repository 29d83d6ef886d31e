#pragma once

#include <array>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

struct ToolpathCertificateOptions {
  double bead_width_mm = 0.8;
  // False for a material that is filled sparsely on purpose: it is left out of coverage, overlap and volume sums.
  std::array<bool, kMaterialCount> dense{true, true};
  // Of a material that is filled by lines with room between them: their spacing. 0: it is not looked at.
  std::array<double, kMaterialCount> line_spacing_mm{};
  // The number of rings around the lines of a material. A single one has no neighbour; 0: rings run all over.
  std::array<int, kMaterialCount> perimeters{};
  int interface_layers = 1;       // support that near under the model is dense all the same ...
  double interface_gap_mm = 0.0;  // ... with that gap between them

  double samples_per_mm2 = 4.0;  // of coverage; thinned evenly over all sheets beyond most_samples
  double most_samples = 400e3;
  double samples_per_mm = 1.0;  // of the spacing, along contours; thinned beyond most_spacing_samples
  double most_spacing_samples = 150e3;

  double min_covered_fraction = 0.98;
  double max_overlap = 0.08;
  double max_spacing_median = 0.03;  // |median / width - 1|
  double max_spacing_spread = 0.15;  // the same of the 5th and the 95th percentile
  double max_volume_error = 1e-9;    // of a segment, relative
  double max_height_error = 0.02;    // of a segment, relative
  double max_material_volume_error = 0.01;
  double max_layer_volume_error = 0.05;
  double max_distance_mm = 0.05;  // of points and segments from their sheet
};

// What the paths do with the printed layers, measured anew on the triangles; shares no code with the planner.
//
// Coverage: points spread evenly over the triangles of a sheet; one is covered when a path of the same sheet (layer,
//   pass, passes, material) passes within 0.55 w, or within half the width of its bead.
// Coverage of sparse sheets: a place is covered when a path passes within 0.6 of the spacing of lines; but within 0.55 w where
//   it lies no farther from the border than the rings go, or, in support, right under a layer of the model.
// Overlap: sum of width * length over the covered area, less 1.
// Spacing: from points of rings, at right angles to the path along the layer and to both sides, the distance to the
//   first path within 1.75 w, where that is a ring that runs parallel within 25 degrees. A ring is a part of a contour
//   whose bead is w wide within 10 %; the rest of a contour fills what rings leave, as wide as that is, or joins them. Two
//   rings are as far apart as their beads are wide in the mean. Nothing is said of fewer than 20 places, nor where
//   rings lie beside less than 5 % of the sides of all paths, nor where a material has a single ring around its lines.
// Local height: 1 / (N m |grad G|) of the triangle, or the height of the tip above the platform where that is less. A
//   segment across several triangles may have any height between those of the triangles that it touches.
// Volume of a layer: what is missing or too much beyond the volume of its pieces smaller than w^2, against the whole; a
//   bead cannot be fitted to those.
// A piece (face-connected part of a sheet) of at least w^2 / 2 has a path when a path of its sheet touches it.
struct ToolpathCertificate {
  struct PlaceOnLayer {
    Index layer = 0;
    Material material = Material::model;
    Vec3 position = Vec3::Zero();
    double value = 0.0;
  };

  Index samples = 0;
  double area_mm2 = 0.0;               // of dense sheets
  double covered_fraction = 1.0;       // within 0.55 w
  double bead_covered_fraction = 1.0;  // within 0.55 of the width that the bead has there
  double overlap = 0.0;
  Index sparse_samples = 0;
  double sparse_covered_fraction = 1.0;
  std::vector<PlaceOnLayer> uncovered;  // some uncovered points, value 0; at most 20

  Index spacing_samples = 0;
  double spacing_p5_mm = 0.0, spacing_median_mm = 0.0, spacing_p95_mm = 0.0;
  double spacing_median_over_width = 1.0, spacing_off_width = 0.0;  // over the mean width of both beads; of 5 and 95 %, the farther from 1

  Index segments = 0;
  double max_volume_error = 0.0, max_height_error = 0.0;
  PlaceOnLayer worst_height;
  Index wrong_volumes = 0, wrong_heights = 0;  // segments
  double wrong_height_length_mm = 0.0, length_mm = 0.0;
  std::array<double, kMaterialCount> bead_volume_mm3{}, layer_volume_mm3{};
  double max_layer_volume_error = 0.0;
  PlaceOnLayer worst_layer;
  double worst_layer_mm3 = 0.0;  // area times thickness

  double max_point_distance_mm = 0.0;  // 0.5 stands for more than that, or for a sheet that is not there
  PlaceOnLayer farthest_point;
  Index points_off_layer = 0, segments_off_layer = 0;
  std::vector<PlaceOnLayer> leaving;            // the first segments that leave, value in mm; at most 20
  std::vector<PlaceOnLayer> pieces_without_path;  // value is the area
  Index pieces = 0;                               // of at least w^2 / 2

  Index order_violations = 0;
  std::vector<Check> checks;  // certificate.toolpath_*
};

// Uniform grids a sheet, sheets in parallel, the same result for any number of threads. Linear in triangles, segments
// and samples; memory that of the largest sheets in work, about 400 bytes a triangle or segment.
[[nodiscard]] ToolpathCertificate certify_toolpaths(const Domain& domain, const ScalarField& field,
                                                    const LayerStack& printed, const Toolpaths& toolpaths,
                                                    const ToolpathCertificateOptions& options = {},
                                                    const RunContext& run = {});

}  // namespace curvesup
