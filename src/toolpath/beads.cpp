#include "toolpath/beads.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kChordTolerance = 0.02;     // mm
constexpr double kClippedChordTolerance = 0.0015;  // mm; where the height follows from that above the platform
constexpr double kMostUneven = 0.05;          // relative, of the thicknesses under the joined segments to their mean
constexpr double kThicknessTolerance = 0.019; // relative, of the mean to some stretch that is really so thick
constexpr double kStretch = 0.31;             // mm; what is shorter is no stretch
constexpr double kNormalTolerance = 0.0175;   // 1 degree between a normal that is left out and the interpolated one
constexpr double kLargestTurn = 0.94;         // cosine of the angle between the normals at a segment's ends: 20 degrees
constexpr double kShort = 0.005;              // mm; a shorter segment joins its neighbour whatever lies under it
constexpr double kLongest = 5.0;              // mm
constexpr double kLongestIrregular = 1.2;     // mm
constexpr double kEqual = 1e-3;               // relative, between thicknesses taken as one
constexpr int kMostJoined = 64;

struct Range {
  double low = 1e300, high = 0.0;
  void add(double x) { low = std::min(low, x), high = std::max(high, x); }
  // Whether x is inside, or off by no more than the part `tolerance` of it.
  [[nodiscard]] bool holds(double x, double tolerance) const { return low <= x * (1.0 + tolerance) && high >= x * (1.0 - tolerance); }
  [[nodiscard]] bool within(double x, double tolerance) const { return high <= x * (1.0 + tolerance) && low >= x * (1.0 - tolerance); }
};

// What lies under the segments that are joined into one. Short ones have no say unless all are short, or several in a row lie on
// triangles equally thick: across the narrow triangles of a fan.
struct Run {
  double length = 0.0, thickness = 0.0, rise = 0.0, weight = 0.0;  // middle two: sums by weight
  Range all, stretches;
  bool irregular = false, clipped = false;  // clipped: by the platform
  double together = 0.0, last_thickness = 0.0;  // of the segments in a row that are equally thick

  void add(double l, double t, double r, bool is_clipped, bool is_irregular) {
    clipped = clipped || is_clipped;
    together = std::abs(t - last_thickness) <= kEqual * t ? together + l : l;
    last_thickness = t;
    const bool counts = together >= kShort;
    if (counts && all.high == 0.0) thickness = rise = weight = 0.0;
    if (counts || all.high == 0.0) thickness += l * t, rise += l * r, weight += l;
    length += l;
    irregular = irregular || is_irregular;
    if (counts) all.add(t);
    if (l >= kStretch) stretches.add(t);
  }
  // One height may stand for the run: near to all that lies under it, or between stretches that are lower and higher.
  [[nodiscard]] bool even() const {
    const double mean = thickness / weight;
    return all.within(mean, kThicknessTolerance) || (all.within(mean, kMostUneven) && stretches.holds(mean, kThicknessTolerance));
  }
  [[nodiscard]] double tolerance() const { return clipped ? kClippedChordTolerance : kChordTolerance; }
  [[nodiscard]] double longest() const { return irregular ? kLongestIrregular : kLongest; }
};

// Whether one segment may stand for the points between two.
bool straight(const std::vector<TrackPoint>& points, std::size_t from, std::size_t to, double tolerance) {
  const TrackPoint &first = points[from], &last = points[to];
  if (first.normal.dot(last.normal) < kLargestTurn) return false;
  const Vec3 chord = last.position - first.position;
  const double squared = chord.squaredNorm();
  for (std::size_t k = from + 1; k < to; ++k) {
    const Vec3 out = points[k].position - first.position;
    const double part = squared > 0.0 ? std::clamp(out.dot(chord) / squared, 0.0, 1.0) : 0.0;
    if ((out - part * chord).squaredNorm() > tolerance * tolerance) return false;
    const Vec3 normal = first.normal + part * (last.normal - first.normal);
    if (normal.cross(points[k].normal).squaredNorm() > kNormalTolerance * kNormalTolerance * normal.squaredNorm()) return false;
  }
  return true;
}

// The mean over a triangle of what is positive of a function that is linear between its values at the corners, ascending.
double mean_of_positive(const std::array<double, 3>& f) {
  if (f[2] <= 0.0) return 0.0;
  if (f[0] >= 0.0) return (f[0] + f[1] + f[2]) / 3.0;
  if (f[1] <= 0.0) return f[2] * f[2] * f[2] / (3.0 * (f[2] - f[0]) * (f[2] - f[1]));
  return (f[0] + f[1] + f[2] - f[0] * f[0] * f[0] / ((f[1] - f[0]) * (f[2] - f[0]))) / 3.0;
}

}  // namespace

double clipped_height(double thickness, double z, double rise) {
  return std::min(thickness, std::max(0.0, z + 0.5 * thickness * rise));
}

double mean_clipped_height(double thickness, std::array<double, 3> z, double rise) {
  std::sort(z.begin(), z.end());
  if (z[0] + 0.5 * thickness * rise >= thickness) return thickness;
  std::array<double, 3> height, excess;
  for (int i = 0; i < 3; ++i) {
    height[i] = z[i] + 0.5 * thickness * rise;
    excess[i] = height[i] - thickness;
  }
  return mean_of_positive(height) - mean_of_positive(excess);
}

void thin_track(const PieceMesh& mesh, const std::vector<char>& irregular, Track& track) {
  const auto& points = track.points;
  if (points.size() < 2) return;
  std::vector<TrackPoint> kept{points[0]};
  kept[0].tip_offset = tip_offset_at(mesh, points[1].triangle, points[0].position);
  const auto add = [&](Run& run, std::size_t to) {
    const Index under = points[to].triangle;
    const Vec3 &a = points[to - 1].position, &b = points[to].position;
    const double thickness = mesh.thickness[under], rise = mesh.rise[under];
    const bool clipped = clipped_height(thickness, 0.5 * (a.z() + b.z()), rise) < thickness;
    run.add((b - a).norm(), thickness, rise, clipped, irregular[under]);
  };
  for (std::size_t from = 0; from + 1 < points.size();) {
    Run run;
    std::size_t to = from + 1;
    add(run, to);
    while (to + 1 < points.size() && to - from < kMostJoined) {
      Run longer = run;
      add(longer, to + 1);
      const bool forced = run.length < kShort || longer.length - run.length < 1e-6;
      if (!forced && (longer.length > longer.longest() || !longer.even() || !straight(points, from, to + 1, longer.tolerance()))) break;
      run = longer;
      ++to;
    }
    from = to;
    if ((points[to].position - kept.back().position).norm() < 1e-6) continue;
    const double middle = 0.5 * (kept.back().position.z() + points[to].position.z());
    kept.push_back(points[to]);
    kept.back().thickness = run.thickness / run.weight;
    kept.back().height = clipped_height(kept.back().thickness, middle, run.rise / run.weight);
    kept.back().tip_offset = tip_offset_at(mesh, points[to].triangle, points[to].position);
  }
  track.points = std::move(kept);
}

BeadPath lay_beads(const Track& track) {
  BeadPath path{.kind = track.kind, .closed = track.closed, .points = {}};
  if (track.points.size() < 2) return path;
  path.points.reserve(track.points.size());
  // The bead of the segment between two points, kept with the second; the first point of a path is like what adjoins it.
  const auto lay = [&](const TrackPoint& from, const TrackPoint& to, const TrackPoint& segment) {
    PathPoint point{.position = to.position, .normal = to.normal};
    point.width_mm = segment.width;
    point.height_mm = segment.height;
    point.tip_offset_mm = to.tip_offset;
    point.volume_mm3 = point.height_mm * point.width_mm * (to.position - from.position).norm();
    path.points.push_back(point);
  };
  const auto& points = track.points;
  lay(points[0], points[0], track.closed ? points.back() : points[1]);
  for (std::size_t i = 1; i < points.size(); ++i) lay(points[i - 1], points[i], points[i]);
  return path;
}

}  // namespace curvesup::toolpath
