#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>

#include "curvesup/toolpath/plan_toolpaths.h"
#include "toolpath/beads.h"

namespace curvesup::toolpath {

// What is printed of one piece.
struct PieceBeads {
  Index sheet = 0;
  double area = 0.0;
  Vec3 centre = Vec3::Zero();
  std::vector<BeadPath> paths;
};

void reverse(BeadPath& path);
void start_at(BeadPath& closed_path, std::size_t point);

// The nozzle's tips over beads that are laid, to be asked for higher ones beside a lower one.
class BeadTops {
 public:
  // Neighbours are sought within `reach`.
  explicit BeadTops(double reach) : reach_(reach) {}
  void add(std::span<const PieceBeads> pieces);
  void finish();  // after the last add, before the first question
  // True when the nozzle, laying one of these beads, would cut into the upper half bead of one that is there.
  [[nodiscard]] bool rise_beside(std::span<const PieceBeads> pieces) const;
  // Whether one ends within the reach of the lower side of a bead.
  [[nodiscard]] bool carries(const PathPoint& point) const;

 private:
  [[nodiscard]] std::uint64_t cell(double x, double y, double z) const;
  template <class Test>
  [[nodiscard]] bool any_near(const Vec3& place, const Test& test) const;
  [[nodiscard]] bool rises_beside(const PathPoint& point) const;

  double reach_;
  std::vector<std::pair<std::uint64_t, Vec3>> tips_;  // by cell
};

// How far the middle of a sheet's beads' upper face has risen, in layers: what is lower is laid first.
[[nodiscard]] inline double top_of(const Sheet& sheet) {
  return sheet.layer + (sheet.pass + 1.0) / sheet.passes;
}

// The sheets that are laid without a change of material in between, in order of their tops.
struct Run {
  int group = 0;
  Material material = Material::model;
  std::vector<Index> sheets;
};
//   support_first  by sheet: what it belongs to is a layer whose support must not be laid after its model
//   may_wait       whether the model of layers `first` to `layer` - 1 may be laid after the support of `layer`; asked only
//                  where support is laid in batches, for ascending layers
[[nodiscard]] std::vector<Run> order_runs(std::span<const Sheet> sheets, int support_batch_layers,
                                          std::span<const char> support_first = {},
                                          const std::function<bool(Index first, Index layer)>& may_wait = {});

// A short open tour through points from `start`: greedy, then 2-opt and Or-opt. Returns the order. O(n^2) at worst, local
// moves only between neighbours.
[[nodiscard]] std::vector<Index> short_tour(std::span<const Vec3> points, const Vec3& start);

}  // namespace curvesup::toolpath
