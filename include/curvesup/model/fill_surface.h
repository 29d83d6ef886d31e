#pragma once

#include <string>

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

struct FillOptions {
  double max_tet_volume_mm3 = 20.0;  // in the units of the surface
};

// Fills a closed surface with tets: what lies inside an odd number of its shells, so that a shell within a shell is a
// cavity, whichever way triangles are turned. Vertices of the surface come first, in their order, and its triangles are
// the boundary of the result; collapsed ones (two corners equal) are left out. `where` is the file that errors name.
// Throws Error{input} naming the first place when diagnose_surface refuses the surface, Error{geometry} when TetGen
// cannot fill it. Same input, same result. Cost: of TetGen.
[[nodiscard]] TetMesh fill_surface(const TriangleMesh& surface, const std::string& where, const FillOptions& options = {});

}  // namespace curvesup
