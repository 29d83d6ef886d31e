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
    end.height_mm = other.height_mm;
    end.feed_mm_s = other.feed_mm_s;
    end.volume_mm3 = end.height_mm * end.width_mm * (end.position - other.position).norm();
  }
  path.points.front().volume_mm3 = 0.0;
  if (path.points.size() > 1) path.points.front().feed_mm_s = path.points[1].feed_mm_s;
}

void start_at(BeadPath& path, std::size_t point) {
  if (!path.closed || point == 0 || point + 1 >= path.points.size()) return;
  path.points.erase(path.points.begin());  // the last one repeats it, with the values of the segment that ends there
  std::rotate(path.points.begin(), path.points.begin() + (point - 1), path.points.end());
  path.points.insert(path.points.end(), path.points.front());
  path.points.front().volume_mm3 = 0.0;
}

namespace {

constexpr double kTipSpacing = 0.4;  // mm between the tips of a bead that are looked at

// Calls visit(point) for points of the paths that are no nearer than kTipSpacing to the last one.
template <class Visit>
void visit_points(std::span<const PieceBeads> pieces, const Visit& visit) {
  for (const PieceBeads& piece : pieces) {
    for (const BeadPath& path : piece.paths) {
      double since = kTipSpacing;
      for (std::size_t i = 0; i < path.points.size(); ++i) {
        if (i > 0) since += (path.points[i].position - path.points[i - 1].position).norm();
        if (since < kTipSpacing) continue;
        since = 0.0;
        visit(path.points[i]);
      }
    }
  }
}

Vec3 tip_of(const PathPoint& point) { return point.position + point.tip_offset_mm * point.normal; }

}  // namespace

// Cells in a row along x have consecutive numbers.
std::uint64_t BeadTops::cell(double x, double y, double z) const {
  const auto index = [&](double c) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(c / reach_)) + (1 << 20)) & 0x1fffff;
  };
  return index(x) | index(y) << 21 | index(z) << 42;
}

void BeadTops::add(std::span<const PieceBeads> pieces) {
  visit_points(pieces, [&](const PathPoint& point) {
    const Vec3 tip = tip_of(point);
    tips_.emplace_back(cell(tip.x(), tip.y(), tip.z()), tip);
  });
}

void BeadTops::finish() {
  std::sort(tips_.begin(), tips_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
}

bool BeadTops::rise_beside(std::span<const PieceBeads> pieces) const {
  bool found = false;
  visit_points(pieces, [&](const PathPoint& point) { found = found || rises_beside(point); });
  return found;
}

template <class Test>
bool BeadTops::any_near(const Vec3& place, const Test& test) const {
  for (int y = -1; y <= 1; ++y) {
    for (int z = -1; z <= 1; ++z) {
      const std::uint64_t first = cell(place.x() - reach_, place.y() + y * reach_, place.z() + z * reach_);
      auto at = std::lower_bound(tips_.begin(), tips_.end(), first, [](const auto& a, std::uint64_t c) { return a.first < c; });
      for (; at != tips_.end() && at->first <= first + 2; ++at) {
        const Vec3 offset = at->second - place;
        if (offset.squaredNorm() <= reach_ * reach_ && test(offset)) return true;
      }
    }
  }
  return false;
}

bool BeadTops::rises_beside(const PathPoint& point) const {
  return any_near(tip_of(point), [&](const Vec3& offset) { return offset.dot(point.normal) > point.tip_offset_mm; });
}

bool BeadTops::carries(const PathPoint& point) const {
  return any_near(point.position - point.tip_offset_mm * point.normal, [](const Vec3&) { return true; });
}

std::vector<Run> order_runs(std::span<const Sheet> sheets, int support_batch_layers, std::span<const char> must_be_first,
                            const std::function<bool(Index first, Index layer)>& may_wait) {
  std::vector<Run> runs;
  const int batch = std::max(1, support_batch_layers);
  bool support_first = true;
  int group = 0;
  for (std::size_t begin = 0; begin < sheets.size(); ++group) {
    const Index first = sheets[begin].layer;
    std::size_t end = begin;
    for (Index layer = first; end < sheets.size() && sheets[end].layer < first + batch;) {
      if (sheets[end].layer != layer) {
        layer = sheets[end].layer;
        if (may_wait && !may_wait(first, layer)) break;
      }
      ++end;
    }
    std::array<Run, 2> of_material{Run{group, Material::model, {}}, Run{group, Material::support, {}}};
    bool forced = sheets[end - 1].layer > first;
    for (std::size_t s = begin; s < end; ++s) {
      of_material[static_cast<int>(sheets[s].material)].sheets.push_back(static_cast<Index>(s));
      forced = forced || (s < must_be_first.size() && must_be_first[s]);
    }
    for (Run& run : of_material) {
      std::stable_sort(run.sheets.begin(), run.sheets.end(),
                       [&](Index a, Index b) { return top_of(sheets[a]) < top_of(sheets[b]); });
    }
    // ... S M | M S | S M ...: what was laid last goes on first. A batch always starts with its support.
    const bool both = !of_material[0].sheets.empty() && !of_material[1].sheets.empty();
    if (both && forced) support_first = true;
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
