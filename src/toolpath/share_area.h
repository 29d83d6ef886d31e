#pragma once

#include <vector>

#include "toolpath/ridge.h"
#include "toolpath/track.h"

namespace curvesup::toolpath {

// The triangles near the medial line, where rings do not fit in evenly; all of a small piece. By triangle.
[[nodiscard]] std::vector<char> irregular_triangles(const PieceMesh& mesh, const Ridge& ridge, const BeadWidths& beads);

// Sets the widths of the tracks of one piece. Between two rings that run beside each other a bead is `width` wide. On
// irregular triangles and on centre lines every place belongs to the track that passes nearest, and a bead is as wide as
// the volume that belongs to it divided by its length and height: no place is filled twice, none is left out, whatever way the
// tracks take. Tracks must have their heights (thin_track). A track that next to nothing belongs to is dropped, unless all
// are; such an end of an open one is cut off. Widths stay within `min` and `max`; they are even over stretches of about a
// bead's width and a half. What is too much for one goes to those beside it on its track.
// Triangles are cut along the line between two tracks, and halved before where more than that goes on. O(triangles).
void share_area(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks);

}  // namespace curvesup::toolpath
