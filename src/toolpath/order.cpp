#include "toolpath/order.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace curvesup::toolpath {

void reverse(BeadPath& path) {
  std::reverse(path.points.begin(), path.points.end());
  // What belongs to a segment now stands at its other end.
  for (std::size_t i = path.points.size() - 1; i > 0; --i) {
    PathPoint& end = path.points[i];
    const PathPoint& other = path.points[i - 1];
    end.width_mm = other.width_mm;
    end.tip_offset_mm = other.tip_offset_mm;
    end.height_mm = clipped_height(2.0 * end.tip_offset_mm, end.position, end.normal);
    end.volume_mm3 = end.height_mm * end.width_mm * (end.position - other.position).norm();
  }
  path.points.front().volume_mm3 = 0.0;
}

void start_at(BeadPath& path, std::size_t point) {
  if (!path.closed || point == 0 || point + 1 >= path.points.size()) return;
  path.points.erase(path.points.begin());  // the last one repeats it, with the values of the segment that ends there
  std::rotate(path.points.begin(), path.points.begin() + (point - 1), path.points.end());
  path.points.insert(path.points.end(), path.points.front());
  path.points.front().volume_mm3 = 0.0;
}

std::vector<Run> order_runs(std::span<const Sheet> sheets, int support_batch_layers) {
  std::vector<Run> runs;
  const int batch = std::max(1, support_batch_layers);
  bool support_first = true;
  int group = 0;
  for (std::size_t begin = 0; begin < sheets.size(); ++group) {
    std::size_t end = begin;
    while (end < sheets.size() && sheets[end].layer < sheets[begin].layer + batch) ++end;
    std::array<Run, 2> of_material{Run{group, Material::model, {}}, Run{group, Material::support, {}}};
    for (std::size_t s = begin; s < end; ++s) {
      of_material[static_cast<int>(sheets[s].material)].sheets.push_back(static_cast<Index>(s));
    }
    // ... S M | M S | S M ...: what was laid last goes on first. A batch always starts with its support.
    const bool both = !of_material[0].sheets.empty() && !of_material[1].sheets.empty();
    if (batch > 1) support_first = true;
    for (const int m : {support_first ? 1 : 0, support_first ? 0 : 1}) {
      if (!of_material[m].sheets.empty()) runs.push_back(std::move(of_material[m]));
    }
    if (both) {
      support_first = !support_first;
    } else if (!runs.empty()) {
      support_first = runs.back().material == Material::support;
    }
    begin = end;
  }
  return runs;
}

std::vector<Index> short_tour(std::span<const Vec3> points, const Vec3& start) {
  const Index n = static_cast<Index>(points.size());
  std::vector<Index> tour;
  std::vector<Index> left(n);
  std::iota(left.begin(), left.end(), 0);
  Vec3 at = start;
  while (!left.empty()) {
    std::size_t best = 0;
    double nearest = 1e300;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const double d = (points[left[i]] - at).squaredNorm();
      if (d < nearest) nearest = d, best = i;
    }
    tour.push_back(left[best]);
    at = points[left[best]];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
  }
  const auto place = [&](Index i) -> const Vec3& { return i < 0 ? start : points[tour[i]]; };
  const auto leg = [&](Index i, Index j) { return (place(i) - place(j)).norm(); };
  // An open tour: nothing follows its last point. Windows keep long tours cheap.
  constexpr Index kWindow = 60;
  for (int round = 0; round < 8; ++round) {
    bool improved = false;
    for (Index i = 0; i < n; ++i) {
      for (Index j = i + 1; j < std::min(n, i + kWindow); ++j) {  // 2-opt: turn i..j round
        const double before = leg(i - 1, i) + (j + 1 < n ? leg(j, j + 1) : 0.0);
        const double after = leg(i - 1, j) + (j + 1 < n ? leg(i, j + 1) : 0.0);
        if (after < before - 1e-9) {
          std::reverse(tour.begin() + i, tour.begin() + j + 1);
          improved = true;
        }
      }
      for (Index j = i + 1; j < std::min(n, i + kWindow); ++j) {  // Or-opt: point i between j and j + 1
        const double before = leg(i - 1, i) + leg(i, i + 1) + (j + 1 < n ? leg(j, j + 1) : 0.0);
        const double after = leg(i - 1, i + 1) + leg(j, i) + (j + 1 < n ? leg(i, j + 1) : 0.0);
        if (after < before - 1e-9) {
          std::rotate(tour.begin() + i, tour.begin() + i + 1, tour.begin() + j + 1);
          improved = true;
        }
      }
    }
    if (!improved) break;
  }
  return tour;
}

}  // namespace curvesup::toolpath
