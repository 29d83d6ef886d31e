#include "motion/placed_paths.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace curvesup {
namespace {

constexpr double kLongestSegment_mm = 3.0;  // longer ones are divided
constexpr double kSoftBeads = 3.0;          // bead widths behind the nozzle

// Appends a point; a long segment to it is divided.
void append_point(const PathPoint& point, Index source, bool joined, PlacedPaths& placed) {
  const Vec3 tip = point.position + point.tip_offset_mm * point.normal;
  const double length = joined ? (tip - placed.tips.back()).norm() : 0.0;
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / kLongestSegment_mm)));
  const PathPoint from = joined ? placed.points.back() : point;
  const Vec3 from_tip = joined ? placed.tips.back() : tip;
  for (int s = 1; s <= pieces; ++s) {
    const double t = static_cast<double>(s) / pieces;
    PathPoint between = point;
    between.volume_mm3 = point.volume_mm3 / pieces;
    if (s < pieces) {
      between.position = (1.0 - t) * from.position + t * point.position;
      between.normal = ((1.0 - t) * from.normal + t * point.normal).normalized();
      between.tip_offset_mm = (1.0 - t) * from.tip_offset_mm + t * point.tip_offset_mm;
    }
    placed.points.push_back(between);
    placed.tips.push_back((1.0 - t) * from_tip + t * tip);
    placed.sources.push_back(s < pieces ? kNone : source);
  }
}

// What was laid before the nozzle reaches a point: all of it but the bead's own last stretch, which still hangs on
// the nozzle and is soft.
void find_laid_before(PlacedPaths& placed) {
  placed.laid_before.resize(placed.points.size());
  for (const Path& path : placed.paths) {
    const std::span<const Vec3> tips = placed.of(std::as_const(placed.tips), path);
    const std::span<const PathPoint> points = placed.of(std::as_const(placed.points), path);
    const std::span<Index> before = placed.of(placed.laid_before, path);
    std::size_t back = 0;
    double behind = 0.0;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      if (i > 0) behind += (tips[i] - tips[i - 1]).norm();
      while (back < i && behind - (tips[back + 1] - tips[back]).norm() > kSoftBeads * points[i].width_mm) {
        behind -= (tips[back + 1] - tips[back]).norm();
        ++back;
      }
      before[i] = path.first_point + static_cast<Index>(back);
    }
  }
}

// The tips of one path as its points are raised; those that divide a segment stay on it.
void place_tips(PlacedPaths& placed, const Path& path) {
  const std::size_t begin = placed.row(path.first_point), end = begin + static_cast<std::size_t>(path.point_count);
  std::size_t before = begin;
  for (std::size_t i = begin; i < end; ++i) {
    if (placed.sources[i] == kNone) continue;
    const PathPoint& point = placed.points[i];
    placed.tips[i] = point.position + (point.tip_offset_mm + placed.raises[i]) * point.normal;
    for (std::size_t between = before + 1; between < i; ++between) {
      const double t = static_cast<double>(between - before) / static_cast<double>(i - before);
      placed.tips[between] = (1.0 - t) * placed.tips[before] + t * placed.tips[i];
    }
    before = i;
  }
}

}  // namespace

void PlacedPaths::raise(const Path& path, std::span<const char> marked, double by, double most) {
  const std::size_t begin = row(path.first_point), last = marked.size() - 1;
  std::vector<char> wanted(marked.size(), 0);
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (!marked[i]) continue;
    std::size_t from = i > 0 ? i - 1 : 0, to = std::min(i + 1, last);
    while (from > 0 && sources[begin + from] == kNone) --from;
    while (to < last && sources[begin + to] == kNone) ++to;
    std::fill(wanted.begin() + static_cast<std::ptrdiff_t>(from), wanted.begin() + static_cast<std::ptrdiff_t>(to) + 1, 1);
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (wanted[i] && sources[begin + i] != kNone) raises[begin + i] = std::min(most, raises[begin + i] + by);
  }
  place_tips(*this, path);
}

void PlacedPaths::lower(const Path& path) {
  const std::span<double> raised = of(raises, path);
  std::fill(raised.begin(), raised.end(), 0.0);
  place_tips(*this, path);
}

PlacedPaths place_paths(const Toolpaths& toolpaths, const PartPlacement& placement, std::span<const Index> order,
                        Index first_path, Index first_point, Index first_source) {
  PlacedPaths placed;
  placed.first_path = first_path;
  placed.first_point = first_point;
  const Mat3 turn = Eigen::AngleAxisd(placement.rotation_rad, Vec3::UnitZ()).toRotationMatrix();
  Index next_source = first_source;
  for (const Index index : order) {
    const Path& source = toolpaths.paths[index];
    Path path = source;
    path.first_point = first_point + static_cast<Index>(placed.points.size());
    for (Index i = source.first_point; i < source.first_point + source.point_count; ++i) {
      PathPoint point = toolpaths.points[i];
      if (placement.rotation_rad != 0.0) {
        point.position = turn * point.position;
        point.normal = turn * point.normal;
      }
      point.position += placement.offset_mm;
      append_point(point, next_source++, i > source.first_point, placed);
    }
    path.point_count = first_point + static_cast<Index>(placed.points.size()) - path.first_point;
    placed.paths.push_back(path);
  }
  placed.axes.resize(placed.points.size());
  placed.raises.assign(placed.points.size(), 0.0);
  placed.known_free.assign(placed.points.size(), 0);
  placed.drafts.resize(placed.paths.size());
  find_laid_before(placed);
  return placed;
}

}  // namespace curvesup
