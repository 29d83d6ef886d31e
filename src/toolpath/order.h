#pragma once

#include <span>

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

// The sheets that are laid without a change of material in between, in order.
struct Run {
  int group = 0;
  Material material = Material::model;
  std::vector<Index> sheets;
};
[[nodiscard]] std::vector<Run> order_runs(std::span<const Sheet> sheets, int support_batch_layers);

// A short open tour through points from `start`: greedy, then 2-opt and Or-opt. Returns the order. O(n^2) at worst, local
// moves only between neighbours.
[[nodiscard]] std::vector<Index> short_tour(std::span<const Vec3> points, const Vec3& start);

}  // namespace curvesup::toolpath
