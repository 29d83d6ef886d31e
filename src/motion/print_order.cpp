#include "motion/print_order.h"

#include <algorithm>
#include <numeric>

#include "curvesup/core/parallel.h"

namespace curvesup {
namespace {

constexpr double kSampleSpacing_mm = 1.0;   // of deposited beads
constexpr std::size_t kRunPaths = 512;      // paths that are planned together, at least
constexpr std::size_t kRunPoints = 200000;  // or points

}  // namespace

PrintOrder::PrintOrder(const Toolpaths& toolpaths, const PartPlacement& placement, const RunContext& run)
    : toolpaths_(toolpaths), placement_(placement), order_(toolpaths.paths.size()), deposit_(kSampleSpacing_mm) {
  const std::size_t count = order_.size();
  std::iota(order_.begin(), order_.end(), 0);
  first_points_.assign(count + 1, 0);
  std::vector<Deposit> parts(chunk_count(count, kRunPaths), Deposit(kSampleSpacing_mm));
  parallel_for(count, kRunPaths, run, [&](std::size_t begin, std::size_t end, std::size_t part) {
    for (std::size_t p = begin; p < end; ++p) {
      const PlacedPaths placed = place_paths(toolpaths_, placement_, std::span(order_).subspan(p, 1), 0, 0, 0);
      parts[part].add_path(placed.points, placed.tips);
      first_points_[p + 1] = static_cast<Index>(placed.points.size());
    }
  });
  for (Deposit& part : parts) deposit_.append(std::move(part));
  deposit_.finish();
  std::partial_sum(first_points_.begin(), first_points_.end(), first_points_.begin());
}

Index PrintOrder::path_of(Index point) const {
  return static_cast<Index>(std::upper_bound(first_points_.begin(), first_points_.end(), point) - first_points_.begin()) - 1;
}

std::size_t PrintOrder::run_end(std::size_t begin) const {
  std::size_t end = begin + 1;
  const auto same_piece = [&](std::size_t path) { return toolpaths_.paths[path].piece == toolpaths_.paths[path - 1].piece; };
  const auto points = [&] { return static_cast<std::size_t>(first_points_[end] - first_points_[begin]); };
  while (end < order_.size() && (same_piece(end) || (end - begin < kRunPaths && points() < kRunPoints))) ++end;
  return end;
}

PlacedPaths PrintOrder::place(std::size_t begin, std::size_t end) const {
  const std::span<const Index> order = std::span(order_).subspan(begin, end - begin);
  // Only paths of one run change places, so the run's points stay those of the toolpaths from here on.
  return place_paths(toolpaths_, placement_, order, static_cast<Index>(begin), first_points_[begin],
                     toolpaths_.paths[begin].first_point);
}

PlacedPaths PrintOrder::reorder(const PlacedPaths& run, std::span<const Index> order) {
  const auto begin = static_cast<std::size_t>(run.first_path), end = run.end_path();
  reordered_ = true;
  deposit_.reorder(begin, order);
  std::vector<Index> paths;
  for (const Index was : order) paths.push_back(order_[begin + static_cast<std::size_t>(was)]);
  std::copy(paths.begin(), paths.end(), order_.begin() + run.first_path);
  PlacedPaths anew = place(begin, end);
  for (std::size_t p = 0; p < anew.paths.size(); ++p) first_points_[begin + p] = anew.paths[p].first_point;
  return anew;
}

}  // namespace curvesup
