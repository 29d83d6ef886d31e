#pragma once

#include <vector>

#include "toolpath/track.h"

namespace curvesup::toolpath {

// Joins tracks of one piece end to end by short steps over its surface, so that the nozzle need not be lifted between
// them. A step is straight, no longer than `reach` and never leaves the piece. The triangles around steps become
// irregular: the beads there share the area with the step (share_area.h). Tracks are thinned. Greedy, the nearest first.
void chain_tracks(const BorderDistance& distance, double reach, std::vector<Track>& tracks, std::vector<char>& irregular);

}  // namespace curvesup::toolpath
