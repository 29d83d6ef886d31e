#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "curvesup/layers/layer_stack.h"

namespace curvesup {

// Ascending indices of the points to keep, the first and the last among them: every dropped point is within `tolerance`
// of the chord over it, and must_keep(kept, candidate) was false for all points up to the next kept one.
[[nodiscard]] std::vector<Index> thin_polyline(std::span<const Vec3> points, double tolerance,
                                               const std::function<bool(Index kept, Index candidate)>& must_keep = {});

// A sheet in few triangles: vertices within one cell of a grid become their mean, or that of those on the border, so that the
// sheet reaches as far as before.
struct CoarseSheet {
  std::vector<Vec3> vertices;
  std::vector<std::array<Index, 3>> triangles;
};

// Works on one sheet after another with scratch as large as the stack.
class SheetReader {
 public:
  explicit SheetReader(const LayerStack& stack);

  void read(const Sheet& sheet);
  [[nodiscard]] CoarseSheet coarse(double cell_mm) const;
  // Chains of border edges; a closed one repeats its first point.
  [[nodiscard]] std::vector<std::vector<Vec3>> borders() const;

 private:
  void find_border();

  const LayerStack& stack_;
  std::vector<Index> local_;     // by vertex of the stack, kNone outside the sheet
  std::vector<Index> vertices_;  // of the sheet, in order of first use
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<std::array<Index, 2>> border_;  // directed edges in ascending order
  std::vector<char> on_border_;               // by vertex
};

}  // namespace curvesup
