#pragma once

#include <span>
#include <vector>

#include "curvesup/toolpath/toolpaths.h"
#include "motion/deposit.h"
#include "motion/placed_paths.h"

namespace curvesup {

// The paths of a print in the order in which they are laid, the numbers of their placed points, and the beads in that order.
// Paths are planned in runs of whole pieces, so that only the points of one run are in memory; inside a run they may change
// places.
class PrintOrder {
 public:
  // The order of the toolpaths. Both must outlive this. O(points), on all threads.
  PrintOrder(const Toolpaths& toolpaths, const PartPlacement& placement, const RunContext& run);

  [[nodiscard]] const Deposit& deposit() const { return deposit_; }
  [[nodiscard]] std::size_t path_count() const { return order_.size(); }
  [[nodiscard]] Index point_count() const { return first_points_.back(); }
  [[nodiscard]] const Path& path(Index number) const { return toolpaths_.paths[order_[number]]; }
  [[nodiscard]] Index path_of(Index point) const;
  [[nodiscard]] Index end_point(Index path) const { return first_points_[path + 1]; }

  // The run of paths that begins with one; and its points.
  [[nodiscard]] std::size_t run_end(std::size_t begin) const;
  [[nodiscard]] PlacedPaths place(std::size_t begin, std::size_t end) const;
  // Path i of a run becomes the one that was order[i]; the run is placed anew.
  [[nodiscard]] PlacedPaths reorder(const PlacedPaths& run, std::span<const Index> order);

  // For each path its index in the toolpaths; empty where nothing changed places.
  [[nodiscard]] std::vector<Index> changed_order() const { return reordered_ ? order_ : std::vector<Index>(); }

 private:
  const Toolpaths& toolpaths_;
  const PartPlacement& placement_;
  std::vector<Index> order_;         // of the toolpaths' paths
  std::vector<Index> first_points_;  // placed points before each path, and all at the end
  bool reordered_ = false;
  Deposit deposit_;
};

}  // namespace curvesup
