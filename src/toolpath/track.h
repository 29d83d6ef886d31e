#pragma once

#include <vector>

#include "curvesup/toolpath/toolpaths.h"
#include "toolpath/border_distance.h"

namespace curvesup::toolpath {

// A point of a track: on the triangle over which the segment that ends here runs, and the width of that segment, which
// share_area gives.
struct TrackPoint {
  Vec3 position = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  double width = 0.0;
  Index triangle = kNone;
  double thickness = 0.0, height = 0.0;  // mean under the segment that ends here, and height of its bead; set by thin_track
  double tip_offset = 0.0;               // at the point; set by thin_track
  bool step = false;  // the segment that ends here joins two tracks
};

// A path inside one piece, before it is cut into beads. A closed track repeats its first point at its end.
struct Track {
  PathKind kind = PathKind::contour;
  bool closed = false;
  int level = 0;  // of a ring: it runs at (level + 1/2) w from the border
  std::vector<TrackPoint> points;
};

struct SurfacePoint {
  Index triangle = kNone;
  Vec3 position = Vec3::Zero();
};

// Lets a track run the other way; what is told of a segment moves to its other end.
void turn_round(Track& track);

[[nodiscard]] double length_of(const Track& track);
[[nodiscard]] Vec3 normal_at(const PieceMesh& mesh, Index triangle, const Vec3& position);
[[nodiscard]] double tip_offset_at(const PieceMesh& mesh, Index triangle, const Vec3& position);
[[nodiscard]] double distance_at(const BorderDistance& distance, Index triangle, const Vec3& position);

// Walks straight over the surface. `points` gets each crossing of an edge and the end; a walk that meets the border or a
// degenerate triangle ends there. Stops early at the first place where the distance to the border is `stop_distance`.
struct Walk {
  std::vector<TrackPoint> points;  // without the start
  SurfacePoint end;
  Vec3 direction = Vec3::Zero();  // at the end
  double length = 0.0;
  bool stopped = false;  // at stop_distance
};
[[nodiscard]] Walk walk_straight(const BorderDistance& distance, const SurfacePoint& start, const Vec3& direction,
                                 double length, double stop_distance = -1.0);

// The same from a place where some triangles meet: over the one that the direction leads into, which is found by trying.
[[nodiscard]] Walk walk_from(const BorderDistance& distance, const Vec3& place, const std::vector<Index>& around, const Vec3& direction, double length);

// A straight line through such a place, so far to either side.
[[nodiscard]] Track straight_through(const BorderDistance& distance, const Vec3& place, const std::vector<Index>& around, const Vec3& direction,
                                     double back, double forth);

}  // namespace curvesup::toolpath
