#pragma once

#include <array>
#include <vector>

#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

// Face `face` of tet `tet`, with its vertices in ascending order.
struct FaceUse {
  std::array<Index, 3> sorted{};
  Index tet = kNone;
  int face = 0;
};

// All faces of all tets, ascending by (sorted, tet): the tets of one face follow one another. O(tets): bucketed by the lowest
// vertex, so only the few faces of a bucket are sorted.
[[nodiscard]] std::vector<FaceUse> sorted_face_uses(const TetMesh& mesh);

}  // namespace curvesup
