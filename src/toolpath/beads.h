#pragma once

#include <array>

#include "toolpath/track.h"

namespace curvesup::toolpath {

// A path with its beads, still by itself.
struct BeadPath {
  PathKind kind = PathKind::contour;
  bool closed = false;
  std::vector<PathPoint> points;
};

// Height of a bead in a layer of the given thickness whose middle is at z and whose print direction rises by `rise`: down
// to the platform where that is nearer.
[[nodiscard]] double clipped_height(double thickness, double z, double rise);

// The mean of the same over a triangle with corners at these heights above the platform; exact.
[[nodiscard]] double mean_clipped_height(double thickness, std::array<double, 3> z, double rise);

// Joins segments while the track stays straight, the layer equally thick and the normal turns evenly, and notes the mean
// thickness and height under each. On irregular triangles segments stay short, so that their widths can follow the piece.
void thin_track(const PieceMesh& mesh, const std::vector<char>& irregular, Track& track);

// Gives each segment of a thinned track its height and volume.
[[nodiscard]] BeadPath lay_beads(const Track& track);

}  // namespace curvesup::toolpath
