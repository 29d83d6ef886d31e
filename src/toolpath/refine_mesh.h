#pragma once

#include <functional>

#include "toolpath/piece_mesh.h"

namespace curvesup::toolpath {

// Cuts edges of a mesh until none is to be cut any more, and the triangles with them.
//   border     whether edges of the border may be cut
//   most_cuts  of an edge, one after the other
//   cut        gives the vertex, which it adds to the mesh, where the edge between two others is cut; or kNone
// What becomes of an edge is settled once for both triangles beside it. Thickness and rise of a triangle are those of its
// parts. False when nothing was cut. O(triangles made).
bool refine_mesh(PieceMesh& mesh, EdgeTable& edges, bool border, int most_cuts, const std::function<Index(Index, Index)>& cut);

}  // namespace curvesup::toolpath
