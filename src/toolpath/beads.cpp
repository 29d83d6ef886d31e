#include "toolpath/beads.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kChordTolerance = 0.01;     // mm
constexpr double kThicknessTolerance = 0.01; // relative, to the mean of the joined segments
constexpr double kNormalCosine = 0.9994;     // 2 degrees
constexpr double kShort = 0.02;              // mm; a shorter segment joins its neighbour whatever lies under it
constexpr double kLongest = 3.0;             // mm
constexpr int kMostJoined = 12;

// What lies under the segments that are joined into one.
struct Run {
  double length = 0.0, thickness = 0.0, width = 0.0;  // the last two are sums weighted with length
  double thinnest = 1e300, thickest = 0.0, narrowest = 1e300, widest = 0.0;

  void add(double l, double t, double w) {
    length += l;
    thickness += l * t;
    width += l * w;
    if (l < kShort) return;
    thinnest = std::min(thinnest, t), thickest = std::max(thickest, t);
    narrowest = std::min(narrowest, w), widest = std::max(widest, w);
  }
  [[nodiscard]] bool even() const {
    return thickest <= thinnest * (1.0 + 2.0 * kThicknessTolerance) && widest <= narrowest * 1.05;
  }
};

}  // namespace

double clipped_height(double thickness, const Vec3& position, const Vec3& normal) {
  return std::min(thickness, std::max(0.0, position.z() + 0.5 * thickness * normal.z()));
}

BeadPath lay_beads(const PieceMesh& mesh, const Track& track) {
  BeadPath path{.kind = track.kind, .closed = track.closed, .points = {}};
  const auto& points = track.points;
  if (points.size() < 2) return path;
  const auto segment_length = [&](std::size_t i) { return (points[i].position - points[i - 1].position).norm(); };
  const auto straight = [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from + 1; k < to; ++k) {
      const Vec3 on = closest_point_on_segment(points[k].position, points[from].position, points[to].position);
      if ((on - points[k].position).squaredNorm() > kChordTolerance * kChordTolerance) return false;
    }
    return points[from].normal.dot(points[to].normal) >= kNormalCosine;
  };

  path.points.push_back({.position = points[0].position, .normal = points[0].normal});
  for (std::size_t from = 0; from + 1 < points.size();) {
    Run run;
    std::size_t to = from + 1;
    run.add(segment_length(to), mesh.thickness[points[to].triangle], points[to].width);
    while (to + 1 < points.size() && to - from < kMostJoined) {
      const double step = segment_length(to + 1);
      Run longer = run;
      longer.add(step, mesh.thickness[points[to + 1].triangle], points[to + 1].width);
      const bool forced = run.length < kShort || step < 1e-6;
      if (!forced && (longer.length > kLongest || !longer.even() || !straight(from, to + 1))) break;
      run = longer;
      ++to;
    }
    const TrackPoint& end = points[to];
    const double length = (end.position - path.points.back().position).norm();
    from = to;
    if (length < 1e-6) continue;
    const double thickness = run.thickness / run.length, width = run.width / run.length;
    PathPoint point{.position = end.position, .normal = end.normal};
    point.width_mm = width;
    point.height_mm = clipped_height(thickness, end.position, end.normal);
    point.tip_offset_mm = 0.5 * thickness;
    point.volume_mm3 = point.height_mm * point.width_mm * length;
    path.points.push_back(point);
  }
  if (path.points.size() < 2) {
    path.points.clear();
    return path;
  }
  PathPoint& first = path.points.front();
  const PathPoint& like = path.closed ? path.points.back() : path.points[1];
  first.width_mm = like.width_mm;
  first.tip_offset_mm = like.tip_offset_mm;
  first.height_mm = clipped_height(2.0 * first.tip_offset_mm, first.position, first.normal);
  return path;
}

}  // namespace curvesup::toolpath
