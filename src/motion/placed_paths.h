#pragma once

#include <span>
#include <vector>

#include "curvesup/toolpath/toolpaths.h"
#include "motion/placement.h"
#include "motion/waypoints.h"

namespace curvesup {

// A run of paths as they lie on the platform, with long segments divided, so that what is true at points is nearly true
// between them. Paths and points have numbers over the whole print, in print order; the arrays hold the run's part.
struct PlacedPaths {
  Index first_path = 0, first_point = 0;
  std::vector<Path> paths;
  std::vector<PathPoint> points;
  std::vector<Vec3> tips, axes;
  std::vector<double> raises;       // of the tips above where the toolpaths have them, along the normal
  std::vector<Index> laid_before;   // what lies before this point is printed and hard when the nozzle gets here
  std::vector<Index> sources;       // point of the toolpaths, kNone for one that divides a segment
  std::vector<char> known_free;     // the head at this point touches nothing, with the axis as it is now
  std::vector<std::vector<DraftPoint>> drafts;  // of each path

  [[nodiscard]] std::size_t end_path() const { return static_cast<std::size_t>(first_path) + paths.size(); }
  [[nodiscard]] std::size_t row(Index point) const { return static_cast<std::size_t>(point - first_point); }
  template <class Value>
  [[nodiscard]] std::span<Value> of(std::vector<Value>& values, const Path& path) {
    return std::span(values).subspan(row(path.first_point), static_cast<std::size_t>(path.point_count));
  }
  template <class Value>
  [[nodiscard]] std::span<const Value> of(const std::vector<Value>& values, const Path& path) const {
    return std::span(values).subspan(row(path.first_point), static_cast<std::size_t>(path.point_count));
  }
  // Raises the tips of the points of a path that are marked, and of the toolpath's points around each, by `by`, but none
  // by more than `most` in all.
  void raise(const Path& path, std::span<const char> marked, double by, double most);
  // Takes back all raises of a path.
  void lower(const Path& path);
  // Whether a waypoint stands at its point as that one was found free.
  [[nodiscard]] bool knows_free(const DraftPoint& draft) const {
    if (draft.point == kNone || !known_free[row(draft.point)]) return false;
    return draft.tip == tips[row(draft.point)] && draft.axis == axes[row(draft.point)];
  }
  // The toolpath point at or behind a divided one.
  [[nodiscard]] Index source_of(Index point) const {
    while (point != kNone && sources[row(point)] == kNone) ++point;
    return point == kNone ? kNone : sources[row(point)];
  }
};

// Places the paths order[0], order[1], ... of `toolpaths`, which become paths first_path, first_path + 1, ... of the print.
// Their points in the toolpaths follow each other in that order too, from first_source on.
[[nodiscard]] PlacedPaths place_paths(const Toolpaths& toolpaths, const PartPlacement& placement,
                                      std::span<const Index> order, Index first_path, Index first_point,
                                      Index first_source);

}  // namespace curvesup
