#pragma once

#include <span>
#include <vector>

#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

// Vertices of equal value that mesh edges connect, as groups: each vertex that a tet uses is in exactly one. A group is
// a local minimum when no mesh edge leads from it to a lower value; a field that falls anywhere in the star of a vertex
// has a lower neighbour there, so these are all minima of a piecewise linear field.
class VertexPlateaus {
 public:
  VertexPlateaus(const TetMesh& mesh, std::span<const double> value);

  // Groups that are local minima, ascending by their lowest vertex.
  [[nodiscard]] std::span<const Index> minima() const { return minima_; }
  // Vertices of a group, ascending.
  [[nodiscard]] std::span<const Index> members(Index group) const {
    return {members_.data() + first_[group], static_cast<std::size_t>(first_[group + 1] - first_[group])};
  }

 private:
  std::vector<Index> minima_, members_, first_;
};

}  // namespace curvesup
