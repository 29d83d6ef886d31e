#include "motion/waypoints.h"

#include <algorithm>
#include <cmath>

#include "core/angle_between.h"
#include "motion/nozzle_axis.h"

namespace curvesup {
namespace {

// Whether two directions are farther apart than the acute angle of that tangent; lengths do not matter.
bool turned_more(const Vec3& a, const Vec3& b, double tangent) {
  const double cosine = a.dot(b);
  return cosine <= 0.0 || a.cross(b).squaredNorm() > tangent * tangent * cosine * cosine;
}

// Running sums along a path, with points nearer than programs may state as one.
struct Merged {
  std::vector<std::size_t> index;  // into the path
  std::vector<Vec3> tip, axis, normal;
  std::vector<double> volume, duration;  // up to each

  void drop_last() {
    index.pop_back();
    tip.pop_back();
    axis.pop_back();
    normal.pop_back();
    volume.pop_back();
    duration.pop_back();
  }
};

// Points that are one, so far.
struct Cluster {
  Vec3 low, high;
  double from_first = 0.0;  // of the farthest

  explicit Cluster(const Vec3& first) : low(first), high(first) {}
  void add(const Vec3& tip, const Vec3& first) {
    low = low.cwiseMin(tip);
    high = high.cwiseMax(tip);
    from_first = std::max(from_first, (tip - first).norm());
  }
};

// The points of one path, with the axes chosen for them.
struct PathView {
  std::span<const PathPoint> points;
  std::span<const Vec3> tips, axes;
};

// Puts the last merged point at `middle`, with the normal of the path's place nearest to it and the axis between those of
// its points there, as far as the normal allows it.
void move_to_middle(const PathView& path, const Vec3& middle, std::size_t end, double most_deviation, Merged& merged) {
  double nearest = 1e300;
  for (std::size_t i = merged.index.back() + 1; i < end; ++i) {
    const Vec3 along = path.tips[i] - path.tips[i - 1];
    const double squared = along.squaredNorm();
    const double t = squared > 0.0 ? std::clamp((middle - path.tips[i - 1]).dot(along) / squared, 0.0, 1.0) : 0.0;
    const double distance = (path.tips[i - 1] + t * along - middle).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    merged.normal.back() = ((1.0 - t) * path.points[i - 1].normal + t * path.points[i].normal).normalized();
    merged.axis.back() = ((1.0 - t) * path.axes[i - 1] + t * path.axes[i]).normalized();
  }
  merged.axis.back() = limited_axis(merged.axis.back(), merged.normal.back(), most_deviation);
  merged.tip.back() = middle;
}

// Where the first point of a cluster, which ends before `end`, would leave another one out of the chord tolerance, their
// middle stands for them.
void settle(const PathView& path, const Cluster& cluster, std::size_t end, const Tolerances& tolerances, Merged& merged) {
  if (cluster.from_first <= tolerances.chord_mm || merged.index.size() < 2) return;
  const Vec3 middle = 0.5 * (cluster.low + cluster.high);
  const Vec3 &before = merged.tip[merged.tip.size() - 2], &next = path.tips[end];
  const double nearest = tolerances.min_segment_mm;
  const bool apart = (next - middle).norm() >= nearest && (before - middle).norm() >= nearest;
  if (!apart || 0.5 * (cluster.high - cluster.low).norm() > tolerances.chord_mm) return;
  move_to_middle(path, middle, end, tolerances.max_tilt_deviation.radians(), merged);
}

Merged merge_near_points(const PathView& path, double max_flow, const Tolerances& tolerances) {
  const auto& [points, tips, axes] = path;
  const double nearest = tolerances.min_segment_mm;
  Merged merged;
  Cluster cluster(tips[0]);
  double volume = 0.0, duration = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) {
      const double length = (tips[i] - tips[i - 1]).norm();
      const double feed = std::max(points[i].feed_mm_s, 1e-3);
      volume += points[i].volume_mm3;
      duration += std::max(length / feed, points[i].volume_mm3 / max_flow);
    }
    const bool last = i + 1 == points.size();
    if (i > 0 && (tips[i] - merged.tip.back()).norm() < nearest) {
      if (!last) {
        cluster.add(tips[i], merged.tip.back());
        continue;
      }
      // The end stays where it is: the point before it gives way.
      while (merged.index.size() > 1 && (tips[i] - merged.tip.back()).norm() < nearest) {
        merged.drop_last();
      }
      cluster = Cluster(merged.tip.back());
    }
    if (i > 0) settle(path, cluster, i, tolerances, merged);
    cluster = Cluster(tips[i]);
    merged.index.push_back(i);
    merged.tip.push_back(tips[i]);
    merged.axis.push_back(axes[i]);
    merged.normal.push_back(points[i].normal);
    merged.volume.push_back(volume);
    merged.duration.push_back(duration);
  }
  return merged;
}

// A bead whose ends are nearer than programs may state is laid over that least length around its middle.
void stretch_short_bead(DraftPoint& a, DraftPoint& b, double nearest) {
  const Vec3 along = b.tip - a.tip;
  if (along.norm() >= nearest) return;
  const Vec3 direction = along.norm() > 1e-9 ? Vec3(along.normalized()) : a.axis.unitOrthogonal();
  const Vec3 middle = 0.5 * (a.tip + b.tip);
  a.tip = middle - 0.505 * nearest * direction;
  b.tip = middle + 0.505 * nearest * direction;
  b.axis = a.axis;
  b.duration_s = std::max(b.duration_s, 1e-3);
}

}  // namespace

std::vector<DraftPoint> thin_waypoints(std::span<const PathPoint> points, std::span<const Vec3> tips,
                                       std::span<const Vec3> axes, Index first_point, double max_flow_mm3_s,
                                       const Tolerances& tolerances) {
  if (points.empty()) return {};
  const double chord = tolerances.chord_mm, turn_tangent = tolerances.axis.tan();
  const Merged merged = merge_near_points({points, tips, axes}, max_flow_mm3_s, tolerances);
  // One segment may stand for the points between two of them.
  const auto serves = [&](std::size_t from, std::size_t to) {
    const Vec3& a = merged.tip[from];
    const Vec3 along = merged.tip[to] - a;
    const double squared = along.squaredNorm();
    if (squared < tolerances.min_segment_mm * tolerances.min_segment_mm) return false;
    double progress = 0.0;
    for (std::size_t m = from + 1; m < to; ++m) {
      const Vec3 offset = merged.tip[m] - a;
      const double t = offset.dot(along) / squared;
      if (t < progress || t > 1.0) return false;
      progress = t;
      for (std::size_t i = merged.index[m]; i < merged.index[m + 1]; ++i) {
        const Vec3 apart = tips[i] - a;
        if (apart.squaredNorm() * squared - std::pow(apart.dot(along), 2) > chord * chord * squared) return false;
      }
      const Vec3 axis = (1.0 - t) * merged.axis[from] + t * merged.axis[to];
      if (turned_more(axis, merged.axis[m], turn_tangent)) return false;
      const double even = (1.0 - t) * merged.volume[from] + t * merged.volume[to];
      if (std::abs(merged.volume[m] - even) > tolerances.bead_mm3) return false;
    }
    return true;
  };
  std::vector<DraftPoint> kept;
  const auto keep = [&](std::size_t at, std::size_t before) {
    kept.push_back({merged.tip[at], merged.axis[at], merged.normal[at], merged.volume[at] - merged.volume[before],
                    merged.duration[at] - merged.duration[before], first_point + static_cast<Index>(merged.index[at])});
  };
  keep(0, 0);
  std::size_t from = 0;
  while (from + 1 < merged.index.size()) {
    std::size_t to = from + 1;
    // Doubling, then bisection: near linear for long straight runs. Not every prefix of a good run need be good.
    std::size_t step = 1;
    while (to + step < merged.index.size() && serves(from, to + step)) {
      to += step;
      step *= 2;
    }
    for (; step > 0; step /= 2) {
      if (to + step < merged.index.size() && serves(from, to + step)) to += step;
    }
    keep(to, from);
    from = to;
  }
  if (kept.size() == 2) stretch_short_bead(kept[0], kept[1], tolerances.min_segment_mm);
  return kept;
}

void set_blends(std::span<Waypoint> chain, const Tolerances& tolerances, double acceleration_mm_s2) {
  if (chain.empty()) return;
  chain.front().blend_mm = chain.back().blend_mm = 0.0;
  for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
    const Vec3 in = chain[i].tip_mm - chain[i - 1].tip_mm, out = chain[i + 1].tip_mm - chain[i].tip_mm;
    const double turn = angle_between(in, out);
    double radius = tolerances.blend_fraction * std::min(in.norm(), out.norm());
    const double cut = std::tan(turn / 4.0);
    if (radius * cut > tolerances.corner_mm) radius = tolerances.corner_mm / cut;
    radius = std::floor(radius * 1e3) / 1e3;  // micrometres, as programs state it
    const double speed = std::max(in.norm() / chain[i].duration_s, out.norm() / chain[i + 1].duration_s);
    const double circle = radius / std::max(1e-9, std::tan(turn / 2.0));
    const bool blends = turn < tolerances.max_blend_turn.radians() && radius >= tolerances.min_blend_mm &&
                        speed * speed <= acceleration_mm_s2 * circle;
    chain[i].blend_mm = blends ? radius : 0.0;
  }
}

}  // namespace curvesup
