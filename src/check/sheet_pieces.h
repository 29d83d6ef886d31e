#pragma once

#include <array>
#include <vector>

#include "curvesup/layers/layer_stack.h"

namespace curvesup::certificate {

struct Piece {
  Index sheet = kNone;
  std::vector<Index> triangles;  // of the stack, ascending
  double area = 0.0;
  Vec3 centroid = Vec3::Zero();
};

[[nodiscard]] inline std::array<Vec3, 3> corners_of(const LayerStack& stack, Index triangle) {
  const auto& v = stack.triangles[triangle];
  return {stack.vertices[v[0]], stack.vertices[v[1]], stack.vertices[v[2]]};
}

// Face-connected parts of a sheet, ascending by their first triangle.
[[nodiscard]] std::vector<Piece> pieces_of(const LayerStack& stack, Index sheet_index);

}  // namespace curvesup::certificate
