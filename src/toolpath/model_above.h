#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "toolpath/piece_mesh.h"

namespace curvesup::toolpath {

// The model's layers, to be asked what lies right under them.
class ModelAbove {
 public:
  explicit ModelAbove(const LayerStack& stack);

  // Whether the model stands over at least `area` of a piece of that sheet: one of its next `layers` layers, and as many more
  // as a gap of `gap_mm` takes. O(triangles of the piece, log of those of the model's layer).
  [[nodiscard]] bool stands_over(const PieceMesh& piece, const Sheet& sheet, int layers, double gap_mm, double area) const;

 private:
  using Entry = std::pair<std::uint64_t, Index>;  // cell, triangle
  [[nodiscard]] bool lies_at(Index layer, const Vec3& place, double reach) const;

  const LayerStack& stack_;
  Index first_layer_ = 0;
  std::vector<std::vector<Entry>> layers_;  // triangles by cell
};

}  // namespace curvesup::toolpath
