#pragma once

#include <string>

#include "curvesup/core/run_context.h"
#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

struct FillOptions {
  double max_tet_volume_mm3 = 20.0;  // after scaling
  double scale = 1.0;                // from the units of the surface to millimetres
};

// Fills a closed surface with tets: what lies inside an odd number of its shells, so that a shell within a shell is a
// cavity, whichever way triangles are turned. Vertices of the surface come first, in their order, and its triangles are
// the boundary of the result; collapsed ones (two corners equal) and repeated ones are left out. `where` is the file that errors name.
// Throws Error{input} naming the first place when diagnose_surface refuses the surface, Error{geometry} when TetGen
// cannot fill it, Error{usage} when the surface is so large that millions of tets would fill it: its units are wrong then.
// The result is in the units of the surface. Same input, same result. Cost: of TetGen, which a stop does not wait for.
[[nodiscard]] TetMesh fill_surface(const TriangleMesh& surface, const std::string& where, const FillOptions& options = {},
                                   const RunContext& run = {});

}  // namespace curvesup
