#pragma once

#include "toolpath/track.h"

namespace curvesup::toolpath {

// Joins the closed rings of a piece into as few closed tracks as possible: where a ring lies one bead inside another, both
// are opened over somewhat less than a bead and joined by two steps across, which are marked as such: the beads around them
// share the area (share_area.h). Then a centre line that ends beside a track becomes its tail. Steps run straight over the
// surface of the piece and never across a gap. Open tracks stay as they are.
void link_tracks(const BorderDistance& distance, double width, std::vector<Track>& tracks);

}  // namespace curvesup::toolpath
