#include "toolpath/border_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr int kMostHalvings = 4;
constexpr double kLittleTurn = 0.5;      // cosine of the angle between border edges that make one front
constexpr double kOneFrontCosine = 0.5;  // vertices whose ways to the border differ by less lie on one front
constexpr double kKinkCosine = 0.8;      // two that meet at more than this angle have a kink between them
constexpr double kKinkSlack = 0.02;      // of the edge's length
constexpr double kSmoothSlope = 0.5;     // slopes at an edge's ends that are farther off its mean slope are not believed

// The smallest rotation that takes the unit vector a to the unit vector b, of vectors perpendicular to a.
class Turn {
 public:
  Turn(const Vec3& a, const Vec3& b) : to_(b) {
    const double c = 1.0 + a.dot(b);
    shift_ = c < 0.1 ? b : Vec3((a + b) / c);  // a fold of the surface: no smooth frame exists
  }
  [[nodiscard]] Vec3 operator()(const Vec3& x) const { return x - to_.dot(x) * shift_; }

 private:
  Vec3 to_, shift_;
};

// The length of an edge's image in the plane across `normal`.
double flat_length(const Vec3& edge, const Vec3& normal) {
  const double rise = normal.dot(edge);
  return std::sqrt(std::max(edge.squaredNorm() - rise * rise, 1e-24));
}

// The edge vector laid flat into the plane across `normal`, its length kept.
Vec3 laid_flat(const Vec3& edge, const Vec3& normal) {
  const Vec3 flat = edge - normal * normal.dot(edge);
  const double length = flat.norm();
  return length > 1e-12 ? Vec3(flat * (edge.norm() / length)) : Vec3(flat);
}

Vec3 middle_normal(const Vec3& a, const Vec3& b) {
  const Vec3 sum = a + b;
  const double length = sum.norm();
  return length > 1e-6 ? Vec3(sum / length) : a;
}

// Vertices by distance, the nearest first; of equal ones the lower id.
class NearestFirst {
 public:
  struct Entry {
    double distance;
    Index vertex;
  };
  void push(double distance, Index vertex) {
    heap_.push_back({distance, vertex});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  Entry pop() {
    std::pop_heap(heap_.begin(), heap_.end(), later);
    const Entry entry = heap_.back();
    heap_.pop_back();
    return entry;
  }
  [[nodiscard]] bool empty() const { return heap_.empty(); }

 private:
  static bool later(const Entry& x, const Entry& y) {
    return x.distance != y.distance ? x.distance > y.distance : x.vertex > y.vertex;
  }
  std::vector<Entry> heap_;
};

}  // namespace

BorderDistance::BorderDistance(PieceMesh mesh, const DistanceOptions& options) : mesh_(std::move(mesh)) {
  fronts_.resize(mesh_.vertices.size());
  collect_border();
  near_ = options.unrolled_mm;
  propagate(true);
  march();
  if (refine(options)) {
    propagate(false);
    march();
  }
  edges_ = make_edges(mesh_);
}

void BorderDistance::collect_border() {
  for (Front& front : fronts_) front = Front{.distance = kFar};
  std::vector<Index> leaving(mesh_.vertices.size(), kNone), from, to;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      if (mesh_.neighbours[t][i] != kNone) continue;
      leaving[mesh_.triangles[t][i]] = static_cast<Index>(from.size());
      from.push_back(mesh_.triangles[t][i]);
      to.push_back(mesh_.triangles[t][next3(i)]);
    }
  }
  const std::size_t n = from.size();
  if (n == 0) {  // a closed surface: rings around its first vertex
    border_ = {{0}, {0}, {0}, {0}, {0.0}, {1.0}, {0.0}};
    fronts_[0] = {.start = Vec3::Zero(), .tangent = Vec3::UnitX(), .distance = 0.0, .edge = 0};
    return;
  }
  border_.from = from;
  border_.to = to;
  border_.next.resize(n);
  border_.previous.resize(n);
  border_.length.resize(n);
  border_.turn_cos.resize(n);
  border_.turn_sin.resize(n);
  std::vector<Vec3> tangent(n);
  for (std::size_t e = 0; e < n; ++e) {
    const Vec3 along = mesh_.vertices[to[e]] - mesh_.vertices[from[e]];
    border_.length[e] = along.norm();
    border_.next[e] = leaving[to[e]];
    border_.previous[border_.next[e]] = static_cast<Index>(e);
    tangent[e] = laid_flat(along, mesh_.normals[from[e]]);
  }
  // An edge of no length takes over the direction of the one before it.
  for (std::size_t e = 0; e < n; ++e) {
    Index source = static_cast<Index>(e);
    for (int step = 0; step < 8 && border_.length[source] < 1e-9; ++step) source = border_.previous[source];
    const Vec3& normal = mesh_.normals[from[e]];
    Vec3 direction = tangent[source] - normal * normal.dot(tangent[source]);
    const double length = direction.norm();
    direction = length > 1e-12 ? Vec3(direction / length) : Vec3(normal.unitOrthogonal());
    fronts_[from[e]] = {.start = Vec3::Zero(), .tangent = direction, .distance = 0.0, .edge = static_cast<Index>(e)};
  }
  for (std::size_t e = 0; e < n; ++e) {
    const Vec3& normal = mesh_.normals[to[e]];
    const Vec3 before = Turn(mesh_.normals[from[e]], normal)(fronts_[from[e]].tangent);
    const Vec3& after = fronts_[to[e]].tangent;
    const double c = before.dot(after), s = normal.dot(before.cross(after)), length = std::hypot(c, s);
    border_.turn_cos[e] = length > 0.0 ? c / length : 1.0;
    border_.turn_sin[e] = length > 0.0 ? s / length : 0.0;
  }
}

Vec3 BorderDistance::to_border(const Front& front) const {
  if (front.wave) return front.distance * front.tangent;
  const double along = std::clamp(-front.start.dot(front.tangent), 0.0, border_.length[front.edge]);
  return front.start + along * front.tangent;
}

// Follows the border from the front's edge, the way that leads nearer, while it does. In the tangent plane, whose axes are
// the front's tangent and what is on its left.
void BorderDistance::slide(Front& front, const Vec3& normal) const {
  constexpr int kPatience = 2;  // steps that need not pay, so that a notch does not stop the search
  const double along = -front.start.dot(front.tangent), length = border_.length[front.edge];
  front.distance = (front.start + std::clamp(along, 0.0, length) * front.tangent).norm();
  if (along > 0.0 && along < length) return;
  struct Place {
    double x, y, cos, sin;  // where the edge starts, and which way it runs
    Index edge;
  };
  const auto squared_distance = [&](const Place& p) {
    const double part = std::clamp(-(p.x * p.cos + p.y * p.sin), 0.0, border_.length[p.edge]);
    const double x = p.x + part * p.cos, y = p.y + part * p.sin;
    return x * x + y * y;
  };
  const auto advance = [](Place& p, double length) {
    p.x += length * p.cos;
    p.y += length * p.sin;
  };
  const auto turn = [](Place& p, double c, double s) {
    const double cos = p.cos;
    p.cos = c * cos - s * p.sin;
    p.sin = s * cos + c * p.sin;
  };
  const bool forward = along >= length && length > 0.0;
  const Vec3 left = normal.cross(front.tangent);
  Place walk{-along, front.start.dot(left), 1.0, 0.0, front.edge}, best = walk;
  double least = front.distance * front.distance;
  for (int wait = 0, step = 0; wait <= kPatience && step < 1000; ++step) {
    if (forward) {
      advance(walk, border_.length[walk.edge]);
      turn(walk, border_.turn_cos[walk.edge], border_.turn_sin[walk.edge]);
      walk.edge = border_.next[walk.edge];
    } else {
      walk.edge = border_.previous[walk.edge];
      turn(walk, border_.turn_cos[walk.edge], -border_.turn_sin[walk.edge]);
      advance(walk, -border_.length[walk.edge]);
    }
    const double squared = squared_distance(walk);
    if (squared < least) {
      least = squared;
      best = walk;
      wait = 0;
    } else {
      ++wait;
    }
  }
  if (best.edge == front.edge) return;
  front.start = best.x * front.tangent + best.y * left;
  front.tangent = best.cos * front.tangent + best.sin * left;
  front.edge = best.edge;
  front.distance = std::sqrt(least);
}

Front BorderDistance::seen_from(Index vertex, const Vec3& offset, const Vec3& normal) const {
  const Vec3 between = middle_normal(mesh_.normals[vertex], normal);
  const Vec3 step = Turn(between, normal)(laid_flat(offset, between));
  const Turn turn(mesh_.normals[vertex], normal);
  Front front = fronts_[vertex];
  front.tangent = turn(front.tangent);
  if (front.wave) {
    front.distance -= front.tangent.dot(step);
    return front;
  }
  front.start = turn(front.start) - step;
  slide(front, normal);
  return front;
}

bool BorderDistance::on_one_front(Index a, Index b) const {
  const Index one = fronts_[a].edge, other = fronts_[b].edge;
  if (one == kNone || other == kNone || one == other) return one == other && one != kNone;
  const auto runs_on = [&](Index e, Index f) { return border_.next[e] == f && border_.turn_cos[e] > kLittleTurn; };
  return runs_on(one, other) || runs_on(other, one);
}

// Whether the nearest place lies on the border edge, not at an end of it.
bool BorderDistance::faces_edge(const Front& front) const {
  const double along = -front.start.dot(front.tangent);
  return !front.wave && along >= 0.0 && along <= border_.length[front.edge];
}

// No way along the surface is shorter than the straight line in space to the same border edge.
void BorderDistance::keep_above_chord(Front& front, Index vertex) const {
  const Vec3 &a = mesh_.vertices[border_.from[front.edge]], &b = mesh_.vertices[border_.to[front.edge]];
  const Vec3& here = mesh_.vertices[vertex];
  const double chord = (closest_point_on_segment(here, a, b) - here).norm();
  if (chord <= front.distance + 1e-9 || front.distance <= 0.0) return;
  front.start += to_border(front) * (chord / front.distance - 1.0);
  front.distance = chord;
}

void BorderDistance::propagate(bool from_border) {
  const Index n = static_cast<Index>(mesh_.vertices.size());
  std::vector<Index> first(n + 1, 0);
  const auto for_edges = [&](const auto& visit) {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (int i = 0; i < 3; ++i) {
        if (mesh_.neighbours[t][i] == kNone || mesh_.neighbours[t][i] > static_cast<Index>(t)) {
          visit(mesh_.triangles[t][i], mesh_.triangles[t][next3(i)]);
        }
      }
    }
  };
  for_edges([&](Index a, Index b) { ++first[a + 1], ++first[b + 1]; });
  for (Index v = 0; v < n; ++v) first[v + 1] += first[v];
  std::vector<Index> around(first[n]), fill(first.begin(), first.end() - 1);
  for_edges([&](Index a, Index b) { around[fill[a]++] = b, around[fill[b]++] = a; });

  NearestFirst queue;
  const auto push = [&](Index v) { queue.push(fronts_[v].distance, v); };
  // A frame that is handed round a fold or a needle can shrink a little with every turn, so a vertex may be set only
  // once in the first pass and improved a few times in the second.
  std::vector<std::uint8_t> changes_left(n, from_border ? 255 : 3);
  const auto relax_from = [&](Index v) {
    if (fronts_[v].wave || fronts_[v].distance > near_) return;
    for (Index k = first[v]; k < first[v + 1]; ++k) {
      const Index w = around[k];
      if (!from_border && on_one_front(v, w)) continue;
      // No neighbour can be nearer than by the length of the edge; the slack covers what curvature adds.
      const Vec3 offset = mesh_.vertices[w] - mesh_.vertices[v];
      const double reach = offset.norm() * 1.05 + 1e-9;
      if (changes_left[w] == 0 || fronts_[w].distance <= fronts_[v].distance - reach || fronts_[w].distance == 0.0) continue;
      Front front = seen_from(v, offset, mesh_.normals[w]);
      keep_above_chord(front, w);
      if (fronts_[w].wave && front.distance <= near_) fronts_[w] = Front{.distance = kFar};
      if (front.distance < fronts_[w].distance - 1e-6 && (front.distance >= fronts_[v].distance - reach || fronts_[w].edge == kNone)) {
        fronts_[w] = front;
        --changes_left[w];
        push(w);
      }
    }
  };
  if (from_border) {
    for (Index v = 0; v < n; ++v) {
      if (fronts_[v].distance == 0.0) push(v);
    }
  } else {
    for (Index v = 0; v < n; ++v) relax_from(v);
  }
  while (!queue.empty()) {
    const NearestFirst::Entry entry = queue.pop();
    if (entry.distance != fronts_[entry.vertex].distance) continue;
    if (from_border) changes_left[entry.vertex] = 0;
    relax_from(entry.vertex);
  }
}

// Distances beyond `near_`, handed on across triangles: along an edge between two vertices of one front the distance is the
// cubic through their values and slopes, and the third corner lies at the end of the straight line that comes first.
// A value is never below those that it was made from, so no error grows, however rough the surface.
void BorderDistance::march() {
  const Index n = static_cast<Index>(mesh_.vertices.size());
  std::vector<char> fixed(n, 0);
  for (Index v = 0; v < n; ++v) {
    fixed[v] = !fronts_[v].wave && fronts_[v].distance <= near_;
    if (!fixed[v]) fronts_[v] = Front{.distance = kFar, .wave = true};
  }
  std::vector<Index> first(n + 1, 0);
  const auto open = [&](const std::array<Index, 3>& corners) { return !fixed[corners[0]] || !fixed[corners[1]] || !fixed[corners[2]]; };
  for (const auto& corners : mesh_.triangles) {
    if (!open(corners)) continue;
    for (const Index v : corners) ++first[v + 1];
  }
  for (Index v = 0; v < n; ++v) first[v + 1] += first[v];
  if (first[n] == 0) return;
  std::vector<Index> around(first[n]), fill(first.begin(), first.end() - 1);  // open triangles
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (!open(mesh_.triangles[t])) continue;
    for (const Index v : mesh_.triangles[t]) around[fill[v]++] = static_cast<Index>(t);
  }
  NearestFirst queue;
  constexpr std::uint8_t kMostChanges = 20;
  constexpr double kGain = 1e-5;  // mm
  std::vector<std::uint8_t> changes(n, 0);
  int clock = 0;  // tells what came first
  std::vector<int> changed(n, 0), handed_on(n, 0);
  const auto offer = [&](Index vertex, double distance, const Vec3& from, Index source) {
    Front& held = fronts_[vertex];
    if (fixed[vertex] || changes[vertex] == kMostChanges || !(distance < held.distance - kGain)) return;
    const Vec3& normal = mesh_.normals[vertex];
    Vec3 direction = from - normal * normal.dot(from);
    // So near the source that its own direction is better than that of the step.
    if (from.norm() < 100.0 * kGain || direction.norm() < 1e-9) direction = Turn(mesh_.normals[source], normal)(to_border(fronts_[source]));
    const double length = direction.norm();
    held.tangent = length > 1e-9 ? Vec3(direction / length) : Vec3(normal.unitOrthogonal());
    held.distance = distance;
    ++changes[vertex];
    changed[vertex] = ++clock;
    queue.push(distance, vertex);
  };
  const auto cross = [&](Index a, Index b, Index c, bool on_border) {
    const Front &at_a = fronts_[a], &at_b = fronts_[b];
    if (fixed[c] || fronts_[c].distance <= std::min(at_a.distance, at_b.distance)) return;
    const Vec3 edge = mesh_.vertices[b] - mesh_.vertices[a], side = mesh_.vertices[c] - mesh_.vertices[a];
    offer(c, at_a.distance + side.norm(), -side, a);
    if (at_b.distance == kFar || handed_on[b] > std::max(changed[a], changed[b])) return;  // in the latter case b has crossed it
    const double length = edge.norm();
    if (length < 1e-9) return;
    if (at_a.distance == 0.0 && at_b.distance == 0.0 && !on_border) return;  // a chord, along which the distance is not 0
    const double along = side.dot(edge) / length, height = std::sqrt(std::max(0.0, side.squaredNorm() - along * along));
    // The shortest way from c to the part of the edge in [low, high], where the distance is value + slope x + p x^2 + q x^3.
    const auto shoot = [&](double value, double slope, double p, double q, double low, double high) {
      if (low >= high) return;
      const double chord = slope + (high + low) * p + (high * high + high * low + low * low) * q;
      if (std::abs(chord) >= 1.0) return;
      double x = std::clamp(along - chord * height / std::sqrt(1.0 - chord * chord), low, high);
      for (int i = 0; i < 3 && (p != 0.0 || q != 0.0); ++i) {
        const double reach = std::sqrt((x - along) * (x - along) + height * height);
        if (reach < 1e-12) return;
        const double bend = 2.0 * p + 6.0 * q * x + height * height / (reach * reach * reach);
        if (bend <= 0.0) break;
        x = std::clamp(x - (slope + x * (2.0 * p + 3.0 * q * x) + (x - along) / reach) / bend, low, high);
      }
      const double there = value + x * (slope + x * (p + x * q));
      if (there >= std::min(at_a.distance, at_b.distance)) {
        offer(c, there + std::sqrt((x - along) * (x - along) + height * height), edge * (x / length) - side, a);
      }
    };
    const double mean_slope = (at_b.distance - at_a.distance) / length;
    if (at_a.distance == 0.0 || at_b.distance == 0.0) return shoot(at_a.distance, mean_slope, 0.0, 0.0, 0.0, length);
    const Vec3 to_a = to_border(at_a) / at_a.distance, to_b = to_border(at_b) / at_b.distance;
    const double slope_a = -to_a.dot(edge) / flat_length(edge, mesh_.normals[a]);
    const double slope_b = -to_b.dot(edge) / flat_length(edge, mesh_.normals[b]);
    const double reach = kKinkSlack * length;  // an end may lie on the kink itself
    const double kink = (at_b.distance - at_a.distance - slope_b * length) / (slope_a - slope_b);
    if (to_a.dot(to_b) < kKinkCosine && slope_a > slope_b && kink > -reach && kink < length + reach) {  // two fronts meet
      shoot(at_a.distance, slope_a, 0.0, 0.0, 0.0, std::min(kink, length));
      shoot(at_b.distance - slope_b * length, slope_b, 0.0, 0.0, std::max(kink, 0.0), length);
    } else if (std::abs(slope_a - mean_slope) + std::abs(slope_b - mean_slope) < kSmoothSlope) {
      const double p = (3.0 * mean_slope - 2.0 * slope_a - slope_b) / length;
      const double q = (slope_a + slope_b - 2.0 * mean_slope) / (length * length);
      shoot(at_a.distance, slope_a, p, q, 0.0, length);
    } else if (slope_a < slope_b) {  // fronts that part: the chord lies above the distance
      shoot(at_a.distance, mean_slope, 0.0, 0.0, 0.0, length);
    }
  };
  const auto hand_on = [&](Index v) {
    handed_on[v] = ++clock;
    for (Index k = first[v]; k < first[v + 1]; ++k) {
      const auto& corners = mesh_.triangles[around[k]];
      const int i = corners[0] == v ? 0 : corners[1] == v ? 1 : 2;
      const auto& across = mesh_.neighbours[around[k]];
      cross(v, corners[next3(i)], corners[prev3(i)], across[i] == kNone);
      cross(v, corners[prev3(i)], corners[next3(i)], across[prev3(i)] == kNone);
    }
  };
  for (Index v = 0; v < n; ++v) {
    if (fixed[v]) hand_on(v);
  }
  while (!queue.empty()) {
    const NearestFirst::Entry entry = queue.pop();
    if (entry.distance == fronts_[entry.vertex].distance) hand_on(entry.vertex);
  }
}

// A vertex in the middle of an edge where the distance there is not that between its ends; else kNone.
Index BorderDistance::add_middle(Index a, Index b, const DistanceOptions& options) {
  const Vec3 half = 0.5 * (mesh_.vertices[b] - mesh_.vertices[a]);
  if (4.0 * half.squaredNorm() < options.min_edge_mm * options.min_edge_mm) return kNone;
  if (fronts_[a].edge == fronts_[b].edge && faces_edge(fronts_[a]) && faces_edge(fronts_[b])) return kNone;
  const Vec3 normal = middle_normal(mesh_.normals[a], mesh_.normals[b]);
  Front front = seen_from(a, half, normal);
  const Front other = seen_from(b, -half, normal);
  const double linear = 0.5 * (fronts_[a].distance + fronts_[b].distance);
  const bool unrolled = !front.wave && !other.wave;
  const Vec3 to_front = to_border(front), to_other = to_border(other);
  const bool one_front = unrolled || to_front.dot(to_other) > kKinkCosine * front.distance * other.distance;
  if (!unrolled && to_front.dot(to_other) > kOneFrontCosine * front.distance * other.distance) {
    const double middle_value = linear + 0.5 * (0.5 * (front.distance + other.distance) - linear);
    front = {.tangent = (to_front + to_other).normalized(), .distance = middle_value, .wave = true};
  } else if (other.distance < front.distance) {
    front = other;
  }
  if (one_front && std::abs(front.distance - linear) <= options.tolerance_mm) return kNone;
  mesh_.vertices.push_back(mesh_.vertices[a] + half);
  mesh_.normals.push_back(normal);
  mesh_.tip_offset.push_back(0.5 * (mesh_.tip_offset[a] + mesh_.tip_offset[b]));
  fronts_.push_back(front);
  return static_cast<Index>(mesh_.vertices.size()) - 1;
}

// Halves edges until each tells its middle, and the triangles with them. What becomes of an edge depends on its ends
// alone, so each triangle is cut to the end before the next one.
bool BorderDistance::refine(const DistanceOptions& options) {
  constexpr Index kUnknown = -2;
  struct Halved {
    Index from, to;
    int generation = 0;
    Index middle = kUnknown;
    Index first_half = kNone;  // from `from`; the other one, to `to`, comes next
    std::array<Index, 2> triangles = {kNone, kNone};
  };
  struct Part {
    std::array<Index, 3> corners, edges;
  };
  const EdgeTable table = make_edges(mesh_);
  std::vector<Halved> edges;
  edges.reserve(3 * table.edges.size());
  for (const Edge& e : table.edges) edges.push_back({.from = e.from, .to = e.to, .middle = e.right == kNone ? kNone : kUnknown});
  const std::size_t before = mesh_.vertices.size();
  const auto middle_of = [&](Index e) {
    const auto [from, to, generation, known, first_half, beside] = edges[e];
    if (known != kUnknown) return known;
    const Index middle = generation < kMostHalvings ? add_middle(from, to, options) : kNone;
    edges[e].middle = middle;
    if (middle != kNone) {
      edges[e].first_half = static_cast<Index>(edges.size());
      edges.push_back({.from = from, .to = middle, .generation = generation + 1});
      edges.push_back({.from = middle, .to = to, .generation = generation + 1});
    }
    return middle;
  };
  const auto half_at = [&](Index e, Index corner) { return edges[e].first_half + (edges[e].from == corner ? 0 : 1); };
  int generation = 0;  // of the edges inside the triangle that is cut
  const auto new_edge = [&](Index from, Index to) {
    edges.push_back({.from = from, .to = to, .generation = generation});
    return static_cast<Index>(edges.size()) - 1;
  };

  std::vector<std::array<Index, 3>> triangles, edges_of;
  std::vector<double> thickness, rise;
  for (auto* values : {&thickness, &rise}) values->reserve(2 * mesh_.triangles.size());
  for (auto* rows : {&triangles, &edges_of}) rows->reserve(2 * mesh_.triangles.size());
  std::vector<Part> parts;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    parts.assign(1, {mesh_.triangles[t], table.of_triangle[t]});
    while (!parts.empty()) {
      const auto [corner, edge] = parts.back();
      parts.pop_back();
      std::array<Index, 3> cut;
      int count = 0;
      generation = 0;
      for (int i = 0; i < 3; ++i) {
        cut[i] = middle_of(edge[i]);
        if (cut[i] == kNone) continue;
        ++count;
        generation = std::max(generation, edges[edge[i]].generation + 1);
      }
      if (count == 0) {
        triangles.push_back(corner);
        edges_of.push_back(edge);
        thickness.push_back(mesh_.thickness[t]);
        rise.push_back(mesh_.rise[t]);
      } else if (count == 3) {
        std::array<Index, 3> inner;  // cuts off corner i
        for (int i = 0; i < 3; ++i) {
          inner[i] = new_edge(cut[i], cut[prev3(i)]);
          parts.push_back({{corner[i], cut[i], cut[prev3(i)]}, {half_at(edge[i], corner[i]), inner[i], half_at(edge[prev3(i)], corner[i])}});
        }
        parts.push_back({cut, {inner[1], inner[2], inner[0]}});
      } else if (count == 1) {
        int i = 0;
        while (cut[i] == kNone) ++i;
        const Index a = corner[i], b = corner[next3(i)], c = corner[prev3(i)], inner = new_edge(cut[i], c);
        parts.push_back({{a, cut[i], c}, {half_at(edge[i], a), inner, edge[prev3(i)]}});
        parts.push_back({{cut[i], b, c}, {half_at(edge[i], b), edge[next3(i)], inner}});
      } else {
        int i = 0;  // edges i and i + 1 are cut: corner i + 1 goes, a quadrilateral stays
        while (cut[i] == kNone || cut[next3(i)] == kNone) ++i;
        const Index a = corner[i], b = corner[next3(i)], c = corner[prev3(i)], ab = cut[i], bc = cut[next3(i)];
        const Index across = new_edge(ab, bc);
        const Index at_a = half_at(edge[i], a), at_c = half_at(edge[next3(i)], c), ca = edge[prev3(i)];
        parts.push_back({{ab, b, bc}, {half_at(edge[i], b), half_at(edge[next3(i)], b), across}});
        if ((mesh_.vertices[a] - mesh_.vertices[bc]).squaredNorm() <= (mesh_.vertices[ab] - mesh_.vertices[c]).squaredNorm()) {
          const Index diagonal = new_edge(a, bc);
          parts.push_back({{a, ab, bc}, {at_a, across, diagonal}});
          parts.push_back({{a, bc, c}, {diagonal, at_c, ca}});
        } else {
          const Index diagonal = new_edge(ab, c);
          parts.push_back({{a, ab, c}, {at_a, diagonal, ca}});
          parts.push_back({{ab, bc, c}, {across, at_c, diagonal}});
        }
      }
    }
  }
  if (mesh_.vertices.size() == before) return false;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (const Index e : edges_of[t]) edges[e].triangles[edges[e].triangles[0] == kNone ? 0 : 1] = static_cast<Index>(t);
  }
  mesh_.neighbours.resize(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const auto& [one, other] = edges[edges_of[t][i]].triangles;
      mesh_.neighbours[t][i] = one == static_cast<Index>(t) ? other : one;
    }
  }
  mesh_.triangles = std::move(triangles);
  mesh_.thickness = std::move(thickness);
  mesh_.rise = std::move(rise);
  return true;
}

}  // namespace curvesup::toolpath
