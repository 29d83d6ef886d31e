#pragma once

#include <vector>

#include "check/support_parts.h"
#include "curvesup/check/toolpath_certificate.h"

// The measurements of the toolpath certificate on one sheet.
namespace curvesup::certificate {

// A distance that stands for "farther than anything looked at".
inline constexpr double kFarMm = 0.5;

struct SheetTask {
  const ScalarField& field;
  const LayerStack& printed;
  const Toolpaths& toolpaths;
  const ToolpathCertificateOptions& options;
  double samples_per_mm2 = 0.0;  // after thinning
  double samples_per_mm = 0.0;
};

struct SheetFindings {
  double area = 0.0, volume = 0.0, small_piece_volume = 0.0;
  Index samples = 0, covered = 0, bead_covered = 0;
  Index sparse_samples = 0, sparse_covered = 0;
  std::vector<Vec3> uncovered;
  std::vector<float> spacing, spacing_over_width;
  double spacing_sides = 0.0;  // that many would there be if each side of all paths had a ring beside it

  double bead_area = 0.0, bead_volume = 0.0, length = 0.0;
  Index segments = 0, wrong_volumes = 0, wrong_heights = 0;
  double max_volume_error = 0.0, max_height_error = 0.0, wrong_height_length = 0.0;
  Vec3 worst_height = Vec3::Zero();

  double max_point_distance = 0.0;
  Vec3 farthest_point = Vec3::Zero();
  Index points_off = 0, segments_off = 0;
  struct Leaving {
    Vec3 position;
    double distance;
  };
  std::vector<Leaving> leaving;

  struct MissingPiece {
    Vec3 centroid;
    double area;
  };
  Index pieces = 0;
  std::vector<MissingPiece> missing;
};

inline constexpr std::size_t kPlacesKept = 20;

// `paths`: indices of the paths that belong to the sheet.
[[nodiscard]] SheetFindings measure_sheet(const SheetTask& task, Index sheet, const std::vector<Index>& paths);

}  // namespace curvesup::certificate
