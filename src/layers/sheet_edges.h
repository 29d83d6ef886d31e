#pragma once

#include <array>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// An undirected edge of some triangles: low < high are its vertices, `uses` how many triangles have it, `balance` how many
// of them run low -> high less those that run high -> low, `triangle` the first of them.
struct SheetEdge {
  Index low = kNone, high = kNone;
  Index uses = 0;
  Index balance = 0;
  Index triangle = kNone;

  [[nodiscard]] bool border() const { return uses == 1; }
  // Two triangles that agree on which side is up, or one alone.
  [[nodiscard]] bool manifold() const { return uses == 1 || (uses == 2 && balance == 0); }
};

// All edges of the triangles, ascending by (low, high). Linear in the triangles and in the span of their vertex ids.
[[nodiscard]] std::vector<SheetEdge> sheet_edges(std::span<const std::array<Index, 3>> triangles);

}  // namespace curvesup
