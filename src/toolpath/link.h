#pragma once

#include "toolpath/track.h"

namespace curvesup::toolpath {

// Joins the closed rings of a piece into as few closed tracks as possible: where a ring lies one bead inside another, both
// are opened over one bead and joined by two steps across, so that no length is added. Then a centre line that ends
// beside a track becomes its tail. Steps run over the surface of the piece, down the distance to the border, and never
// across a gap. Open tracks stay as they are.
void link_tracks(const BorderDistance& distance, double width, std::vector<Track>& tracks);

}  // namespace curvesup::toolpath
