#pragma once

#include <vector>

#include "toolpath/track.h"

namespace curvesup::toolpath {

// Joins tracks of one piece end to end by short steps over its surface, so that the nozzle need not be lifted between
// them, and thins them all. A step is no longer than `reach` and never leaves the piece; a closed track is opened where a
// step meets it. The shortest steps are taken first, each end takes one. The triangles around steps become irregular: the
// beads there share the area with the step (share_area.h). Near linear in the points.
void chain_tracks(const PieceMesh& mesh, double reach, std::vector<Track>& tracks, std::vector<char>& irregular);

}  // namespace curvesup::toolpath
