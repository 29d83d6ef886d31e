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

// By triangle of a sheet, counted from its first: the triangle beyond the side from each corner to the next, kNone where
// there is none, kSeveral where there are several.
using Neighbours = std::vector<std::array<Index, 3>>;
inline constexpr Index kSeveral = -2;

// Face-connected parts of a sheet, ascending by their first triangle.
[[nodiscard]] std::vector<Piece> pieces_of(const LayerStack& stack, Index sheet_index, Neighbours* neighbours = nullptr);

}  // namespace curvesup::certificate
