#pragma once

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace make_models {

// Fills a closed surface with tets no larger than max_volume_mm3; the surface's triangles are kept as they are, its
// vertices come first in the result. All tets are positively oriented. Throws Error{geometry}.
[[nodiscard]] curvesup::TetMesh fill_with_tets(const curvesup::TriangleMesh& surface, double max_volume_mm3);

}  // namespace make_models
