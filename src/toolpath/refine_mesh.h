#pragma once

#include <functional>

#include "toolpath/piece_mesh.h"

namespace curvesup::toolpath {

// Cuts edges of a mesh until none is to be cut any more, and the triangles with them; an edge of the border is never cut.
//   cut        gives the vertex, which it adds to the mesh, where the edge between two others is cut; or kNone
//   most_cuts  of an edge, one after the other
// What becomes of an edge is settled once for both triangles beside it. Thickness and rise of a triangle are those of its
// parts. False when nothing was cut. O(triangles made).
bool refine_mesh(PieceMesh& mesh, EdgeTable& edges, int most_cuts, const std::function<Index(Index, Index)>& cut);

}  // namespace curvesup::toolpath
