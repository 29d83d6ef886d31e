#include "toolpath/rings.h"

#include <algorithm>
#include <cmath>

namespace curvesup::toolpath {
namespace {

struct Ring {
  Track track;
  std::vector<char> keep;  // by point: 0 where a centre line takes the ring's place
};

// How many rings run nearer to the border than each vertex or through it.
std::vector<int> rings_below(const BorderDistance& distance, const Ridge& ridge, double width, int max_rings) {
  std::vector<int> count(distance.mesh().vertices.size());
  for (std::size_t v = 0; v < count.size(); ++v) {
    const auto vertex = static_cast<Index>(v);
    const double here = distance.distance(vertex);
    int rings = static_cast<int>(here / width + 0.5);
    while (rings > 0 && ridge.ring_distance(rings - 1, vertex) > here) --rings;
    while (ridge.ring_distance(rings, vertex) <= here) ++rings;
    count[v] = std::min(rings, max_rings);
  }
  return count;
}

// Where the distance reaches a value, which runs from one at `a` to one at `b`, on the edge between them, as a part of its length:
// by the cubic through the values and slopes at its ends, or by the line where those do not belong to one front.
double crossing(const BorderDistance& distance, Index a, Index b, double value_a, double value_b) {
  constexpr int kNewtonSteps = 2;
  constexpr double kOneFront = 0.35;  // by which slopes may be off the mean slope
  const double to_a = distance.distance(a), to_b = distance.distance(b), drift = value_b - value_a;
  const double from = to_a - value_a, rise = to_b - to_a - drift;
  const double linear = -from / rise;
  const Vec3 edge = distance.mesh().vertices[b] - distance.mesh().vertices[a];
  const double length = edge.norm();
  if (length < 1e-6) return linear;
  const auto [at_a, at_b] = distance.alike(a, b);
  double slope_a = -at_a->way.dot(edge) / std::max(to_a, 1e-9) - drift;
  double slope_b = -at_b->way.dot(edge) / std::max(to_b, 1e-9) - drift;
  if (to_a < 1e-6) slope_a = 2.0 * rise - slope_b;  // on the border: the parabola through the rest
  if (to_b < 1e-6) slope_b = 2.0 * rise - slope_a;
  if (std::abs(slope_a - rise) + std::abs(slope_b - rise) > 2.0 * kOneFront * length) return linear;
  const double p = 3.0 * rise - 2.0 * slope_a - slope_b, q = slope_a + slope_b - 2.0 * rise;
  double x = linear;
  for (int i = 0; i < kNewtonSteps; ++i) {
    const double bend = slope_a + x * (2.0 * p + 3.0 * q * x);
    if (bend * rise < 0.1 * rise * rise) return linear;
    x -= (from + x * (slope_a + x * (p + x * q))) / bend;
  }
  return x > 0.0 && x < 1.0 ? x : linear;
}

// Sets `keep` of runs shorter than `length` to that of the ring around them.
void drop_short_runs(const std::vector<TrackPoint>& ring, std::vector<char>& keep, char value, double length) {
  const std::size_t n = ring.size();
  if (std::find(keep.begin(), keep.end(), !value) == keep.end()) return;
  std::size_t begin = 0;
  while (keep[begin] == value) ++begin;  // starts outside of any run
  for (std::size_t i = 0; i < n;) {
    if (keep[(begin + i) % n] != value) {
      ++i;
      continue;
    }
    double run = 0.0;
    std::size_t j = i;
    for (; j < n && keep[(begin + j) % n] == value; ++j) {
      run += (ring[(begin + j + 1) % n].position - ring[(begin + j) % n].position).norm();
    }
    if (run < length) {
      for (std::size_t k = i; k < j; ++k) keep[(begin + k) % n] = !value;
    }
    i = j;
  }
}

// Joins arcs of one level end to start where they face each other closely, over the surface.
void close_arcs(const BorderDistance& distance, std::vector<Track>& arcs, double reach) {
  const auto gap = [&](const Track& a, const Track& b) {
    return (a.points.back().position - b.points.front().position).norm();
  };
  const auto join = [&](Track& a, const Track& b) {
    const TrackPoint from = a.points.back();
    const TrackPoint to = b.points.front();  // copies: a and b may be the same
    const Vec3 heading = to.position - from.position;
    if (heading.norm() < 1e-6) return true;
    const Walk walk = walk_straight(distance, {from.triangle, from.position}, heading, heading.norm());
    if ((walk.end.position - to.position).norm() > 0.15) return false;
    for (std::size_t i = 0; i + 1 < walk.points.size(); ++i) a.points.push_back(walk.points[i]);
    TrackPoint last = to;
    last.triangle = walk.points.empty() ? from.triangle : walk.points.back().triangle;
    a.points.push_back(last);
    return true;
  };
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    while (!arcs[i].closed) {
      std::size_t best = i;
      for (std::size_t j = i; j < arcs.size(); ++j) {
        if (!arcs[j].closed && !arcs[j].points.empty() && gap(arcs[i], arcs[j]) < gap(arcs[i], arcs[best])) best = j;
      }
      if (gap(arcs[i], arcs[best]) > reach || !join(arcs[i], arcs[best])) break;
      if (best == i) {
        arcs[i].closed = true;
      } else {
        arcs[i].points.insert(arcs[i].points.end(), arcs[best].points.begin() + 1, arcs[best].points.end());
        arcs.erase(arcs.begin() + best);
      }
    }
  }
}

// Every place where the distance is (i + 1/2) w, as one closed line each, marked where a centre line takes its place.
std::vector<Ring> trace_levels(const BorderDistance& distance, const Ridge& ridge, double width, int max_rings) {
  const PieceMesh& mesh = distance.mesh();
  const std::size_t n = mesh.triangles.size();
  // One slot for each pair of a triangle and a level that crosses it.
  const std::vector<int> below = rings_below(distance, ridge, width, max_rings);
  std::vector<Index> slot(n + 1, 0);
  const auto lowest = [&](Index t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return std::min({below[a], below[b], below[c]});
  };
  for (std::size_t t = 0; t < n; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const auto [low, high] = std::minmax({below[a], below[b], below[c]});
    slot[t + 1] = slot[t] + high - low;
  }
  std::vector<char> done(slot[n], 0);
  std::vector<Ring> rings;
  const auto trace = [&](Index seed, int level) {
    Ring ring{{.kind = PathKind::contour, .closed = true, .level = level, .points = {}}, {}};
    for (Index t = seed; t != kNone;) {
      char& mark = done[slot[t] + level - lowest(t)];
      if (mark) return ring;
      mark = 1;
      const auto& corner = mesh.triangles[t];
      int exit = 0;  // the edge that rises through the level
      while (below[corner[exit]] > level || below[corner[next3(exit)]] <= level) ++exit;
      // Seen from both triangles alike: always from the lower vertex id.
      const auto [a, b] = std::minmax(corner[exit], corner[next3(exit)]);
      const double at_a = ridge.ring_distance(level, a), at_b = ridge.ring_distance(level, b);
      const double part = crossing(distance, a, b, at_a, at_b);
      TrackPoint point;
      point.position = mesh.vertices[a] + part * (mesh.vertices[b] - mesh.vertices[a]);
      point.normal = (mesh.normals[a] + part * (mesh.normals[b] - mesh.normals[a])).normalized();
      point.triangle = t;
      ring.track.points.push_back(point);
      ring.keep.push_back(!ridge.replaces_ring(level, a, b, point.position, at_a + part * (at_b - at_a)));
      t = mesh.neighbours[t][exit];
    }
    ring.track.closed = false;
    return ring;
  };
  for (std::size_t seed = 0; seed < n; ++seed) {
    for (Index s = slot[seed]; s < slot[seed + 1]; ++s) {
      if (done[s]) continue;
      const auto t = static_cast<Index>(seed);
      Ring ring = trace(t, lowest(t) + (s - slot[seed]));
      if (ring.track.points.size() >= 3) rings.push_back(std::move(ring));
    }
  }
  return rings;
}

// Adds what stays of a ring, where runs shorter than `shortest` go as what is around them does: all of it, or arcs.
void add_kept(Ring ring, double shortest, std::vector<Track>& whole, std::vector<Track>& arcs) {
  auto& [track, keep] = ring;
  std::vector<TrackPoint>& points = track.points;
  drop_short_runs(points, keep, 0, shortest);
  drop_short_runs(points, keep, 1, shortest);
  const auto dropped = std::find(keep.begin(), keep.end(), 0);
  if (dropped == keep.end()) {
    points.push_back(points.front());
    whole.push_back(std::move(track));
    return;
  }
  const std::size_t n = points.size(), start = dropped - keep.begin();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t at = (start + i) % n;
    if (!keep[at]) continue;
    if (arcs.empty() || !keep[(at + n - 1) % n]) arcs.push_back({.kind = PathKind::contour, .closed = false, .level = track.level, .points = {}});
    arcs.back().points.push_back(points[at]);
  }
}

}  // namespace

std::vector<Track> trace_rings(const BorderDistance& distance, const Ridge& ridge, double width, int max_rings) {
  std::vector<Ring> rings = trace_levels(distance, ridge, width, max_rings);
  std::stable_sort(rings.begin(), rings.end(), [](const Ring& x, const Ring& y) { return x.track.level < y.track.level; });
  std::vector<Track> result, arcs;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const int level = rings[i].track.level;
    add_kept(std::move(rings[i]), 0.75 * width, result, arcs);
    if (i + 1 < rings.size() && rings[i + 1].track.level == level) continue;
    std::erase_if(arcs, [](const Track& arc) { return arc.points.size() < 2; });
    close_arcs(distance, arcs, 1.2 * width);
    for (Track& arc : arcs) result.push_back(std::move(arc));
    arcs.clear();
  }
  return result;
}

}  // namespace curvesup::toolpath
