#pragma once

#include <array>
#include <string>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/core/types.h"
#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

// A volume given by its triangles: closed surfaces that do not meet one another, and a point inside each volume that is
// to stay empty.
struct PiecewiseComplex {
  std::vector<Vec3> vertices;
  std::vector<std::array<Index, 3>> facets;
  std::vector<Vec3> holes;
};

struct TetrahedralizeOptions {
  double max_tet_volume_mm3 = 20.0;
  double radius_edge_ratio = 1.414;
  std::string where = "meshing";  // stage or file that errors name
};

// Fills the complex with tets by TetGen. Guarantees: the first vertices are those of the complex in the same order; every
// facet is a face of the result (the switch Y keeps TetGen from dividing them); every tet is positively oriented; further
// vertices are used by some tet. Throws Error{geometry} with TetGen's reason; a failure leaves nothing behind and the
// next call works as if it had not been. Same input, same result. About 0.3 million tets a second.
// Throws Error{interrupted} at once when a stop is asked for. TetGen itself cannot be told to end: its thread goes on until it
// is through or the process ends, so a program that was stopped should end by _exit().
[[nodiscard]] TetMesh tetrahedralize(const PiecewiseComplex& complex, const TetrahedralizeOptions& options = {}, const RunContext& run = {});

// Removes vertices past the first `kept` that no tet uses; the order of the others stays.
void drop_unused_vertices(TetMesh& mesh, Index kept);

}  // namespace curvesup
