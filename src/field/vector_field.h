#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

struct IntegratedField {
  std::vector<double> value;  // 0 at unreferenced vertices
  double relative_residual = 0.0;
};

// Values whose gradient is nearest to one vector a tet: smallest sum of volume * |grad G - v|^2 (equation 1). Each
// connected part has one free constant; it is fixed so that the part's first vertex x has the value mean(v) . x, which
// makes a constant vector field one linear function over all parts. Throws Error{solver}.
[[nodiscard]] IntegratedField integrate_vector_field(const TetMesh& mesh, const std::vector<Vec3>& tet_vector,
                                                     const RunContext& run);

}  // namespace curvesup
