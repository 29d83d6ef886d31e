#pragma once

#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

enum class PathKind : std::uint8_t { contour = 0, centre_line = 1, infill = 2 };

// A point of a path. `volume_mm3`, `feed_mm_s` belong to the segment that ends here (a path's first point has volume 0).
struct PathPoint {
  Vec3 position = Vec3::Zero();    // on the layer, the middle of the bead
  Vec3 normal = Vec3::UnitZ();     // unit, along +grad G
  double height_mm = 0.0;          // local thickness, or the height of the tip above the platform where that is less
  double width_mm = 0.0;
  double volume_mm3 = 0.0;         // height * width * length of the segment that ends here, exactly
  double tip_offset_mm = 0.0;      // half the full local thickness, smoothed over neighbours: the nozzle tip is position + tip_offset * normal
  double feed_mm_s = 0.0;
};

// One continuous extrusion. A closed path repeats its first point at its end.
struct Path {
  Index layer = 0;
  int pass = 0;
  int passes = 1;
  Material material = Material::model;
  PathKind kind = PathKind::contour;
  bool closed = false;
  Index piece = 0;  // over all sheets, in print order of the sheets
  Index first_point = 0;
  Index point_count = 0;
  int group = 0;       // printed group: one k, or one batch of layers; the number behind ;LAYER:
};

// In print order; the points of path i are the range first_point .. first_point + point_count - 1, ranges in order.
struct Toolpaths {
  std::vector<Path> paths;
  std::vector<PathPoint> points;
};

}  // namespace curvesup
