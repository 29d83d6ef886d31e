#pragma once

#include <vector>

#include "toolpath/track.h"

namespace curvesup::toolpath {

// The way over the surface from one point of tracks to another: the section of the piece by the plane through both and the
// normal between them. Each point lies on the triangle that it names; without the start, with the end. Empty where the
// section leaves the piece or gets longer than `longest`.
[[nodiscard]] std::vector<TrackPoint> walk_to(const PieceMesh& mesh, const TrackPoint& from, const TrackPoint& to, double longest);

// Such a way as a thinned track from `from` to `to`, each point marked as step; only `from` where both are one place. No
// points where there is none, or where a bead on it would not have the height of the layer. `triangles` gets those under it.
[[nodiscard]] Track lay_step(const PieceMesh& mesh, const std::vector<char>& irregular, const TrackPoint& from, const TrackPoint& to,
                             double longest, std::vector<Index>& triangles);

}  // namespace curvesup::toolpath
