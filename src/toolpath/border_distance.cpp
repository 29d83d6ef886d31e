#include "toolpath/border_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "toolpath/refine_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kGain = 1e-6;            // mm
constexpr double kLineSlack = 1e-3;       // mm
constexpr double kKinkCosine = 0.8;       // of the angle between ways to the border that do not belong to one front
constexpr double kSameSideCosine = -0.3;  // of that between ways from two meetings to one side
constexpr double kOtherSlope = 0.3;       // by which the slope in the middle of an edge is off the mean slope up to there, past a kink
constexpr double kHiddenKink = 0.25;      // of the tolerance, where two fronts meet nearer to one end than to the middle
constexpr double kStraight = 0.25;        // of the tolerance, for a front to reach a border vertex straight
constexpr double kEqual = 5e-4;           // mm, between distances to both sides of the medial line
constexpr double kLargestShift = 0.05;    // mm, by which one side may still come nearer
constexpr double kSnap = 0.04;            // of an edge: fronts that meet so near to its end meet there
constexpr double kShortest = 0.02;        // mm, of edges that are cut where fronts meet
constexpr int kMostSearches = 10;         // for that place
constexpr int kMostCuts = 6;              // of an edge, one after the other
constexpr int kMostSteps = 1000;

Vec3 middle_normal(const Vec3& a, const Vec3& b) {
  const Vec3 sum = a + b;
  const double length = sum.norm();
  return length > 1e-6 ? Vec3(sum / length) : a;
}

// The arc of a circle over its chord, where `lean` is how much more one normal at its ends leans along the chord than the other.
double arc_over_chord(double lean) {
  const double s = std::min(0.25 * lean * lean, 1.0);  // squared sine of half the angle between the normals
  if (s < 0.04) return 1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (15.0 / 336.0)));
  const double root = std::sqrt(s);
  return std::asin(root) / root;
}

// Whether another front than that in the middle of an edge comes to its end, so that they meet in between. `whole`: the edge,
// from that end.
bool hides_kink(const Front& end, const Front& middle, const Vec3& whole) {
  if (end.distance > 0.0) return end.way.dot(middle.way) < kKinkCosine * end.distance * middle.distance;
  return std::abs(-middle.way.dot(whole) / middle.distance - 2.0 * middle.distance) > kOtherSlope * whole.norm();
}

// Whether a front, seen from the other end of an edge, goes on straight to the border vertex that the edge comes from.
bool reaches_border(const Front& border, const Front& inner, const Vec3& whole, const DistanceOptions& options) {
  if (border.distance > 0.0 || !inner.inside) return false;
  const double bulge = 0.25 * (inner.distance + inner.way.dot(whole) / inner.distance);
  return std::abs(bulge) < kStraight * options.tolerance_mm;
}

// Adds the vertex on an edge that is so far along it, with what lies between the ends.
Index add_between(PieceMesh& mesh, Index a, Index b, double part) {
  const auto between = [part](const auto& from, const auto& to) { return ((1.0 - part) * from + part * to).eval(); };
  mesh.vertices.push_back(between(mesh.vertices[a], mesh.vertices[b]));
  mesh.normals.push_back(between(mesh.normals[a], mesh.normals[b]).normalized());
  mesh.tip_offset.push_back((1.0 - part) * mesh.tip_offset[a] + part * mesh.tip_offset[b]);
  return static_cast<Index>(mesh.vertices.size()) - 1;
}

void halve_long_edges(PieceMesh& mesh, EdgeTable& edges, double longest) {
  const auto is_long = [&](Index a, Index b) { return (mesh.vertices[a] - mesh.vertices[b]).squaredNorm() > longest * longest; };
  if (std::none_of(edges.edges.begin(), edges.edges.end(), [&](const Edge& e) { return is_long(e.from, e.to); })) return;
  refine_mesh(mesh, edges, true, std::numeric_limits<int>::max(),
              [&](Index a, Index b) { return is_long(a, b) ? add_between(mesh, a, b, 0.5) : kNone; });
}

}  // namespace

BorderDistance::BorderDistance(PieceMesh mesh, const DistanceOptions& options) : mesh_(std::move(mesh)) {
  edges_ = make_edges(mesh_);
  halve_long_edges(mesh_, edges_, options.max_edge_mm);
  collect_border();
  std::vector<Index> changed;
  for (Index v = 0; v < static_cast<Index>(fronts_.size()); ++v) {
    if (fronts_[v].distance == 0.0) changed.push_back(v);
  }
  hand_on(std::move(changed));
  // Until each edge tells the distance along it; once more where something nearer than what both ends knew is heard of then.
  const std::vector<char> heard = refine(options, {});
  if (!heard.empty()) refine(options, heard);
  put_meetings_in_order();
}

// Cuts edges, or only those at vertices of a list. By vertex: whether a nearer border edge came from a neighbour then; empty when
// there was nothing to cut.
std::vector<char> BorderDistance::refine(const DistanceOptions& options, const std::vector<char>& at) {
  const std::size_t before = fronts_.size();
  const auto is_left = [&](Index v) { return !at.empty() && v < static_cast<Index>(at.size()) && !at[v]; };
  const auto cut = [&](Index a, Index b) { return is_left(a) && is_left(b) ? kNone : cut_edge(a, b, options); };
  if (!refine_mesh(mesh_, edges_, false, kMostCuts, cut)) return {};
  std::vector<Index> added(fronts_.size() - before);
  std::iota(added.begin(), added.end(), static_cast<Index>(before));
  return hand_on(std::move(added));
}

void BorderDistance::put_meetings_in_order() {
  std::erase_if(meetings_, [](const Meeting& m) { return m.vertex == kNone; });
  std::sort(meetings_.begin(), meetings_.end(), [](const Meeting& x, const Meeting& y) { return x.vertex < y.vertex; });
  for (std::size_t m = 0; m < meetings_.size(); ++m) meeting_of_[meetings_[m].vertex] = static_cast<Index>(m);
}

void BorderDistance::collect_border() {
  fronts_.assign(mesh_.vertices.size(), Front{.distance = kFar});
  meeting_of_.assign(mesh_.vertices.size(), kNone);
  std::vector<Index> starts, follower(mesh_.vertices.size(), kNone);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      if (mesh_.neighbours[t][i] != kNone) continue;
      starts.push_back(mesh_.triangles[t][i]);
      follower[starts.back()] = mesh_.triangles[t][next3(i)];
    }
  }
  // Loop by loop, so that edges that follow each other lie beside each other.
  border_.reserve(starts.size());
  for (const Index start : starts) {
    const Index first = static_cast<Index>(border_.size());
    for (Index from = start; fronts_[from].edge == kNone; from = follower[from]) {
      const Index id = static_cast<Index>(border_.size()), to = follower[from];
      const Vec3 along = mesh_.vertices[to] - mesh_.vertices[from];
      const double squared = along.squaredNorm();
      fronts_[from] = {.distance = 0.0, .edge = id};
      border_.push_back({.from = from, .to = to, .next = id + 1, .previous = id - 1, .start = mesh_.vertices[from], .along = along,
                         .inverse_squared_length = squared > 1e-18 ? 1.0 / squared : 0.0});
    }
    if (first == static_cast<Index>(border_.size())) continue;
    border_.back().next = first;
    border_[first].previous = static_cast<Index>(border_.size()) - 1;
  }
  if (border_.empty()) {  // a closed surface: rings around its first vertex
    border_.push_back({.from = 0, .to = 0, .next = 0, .previous = 0, .start = mesh_.vertices[0]});
    fronts_[0] = {.distance = 0.0, .edge = 0};
  }
}

BorderDistance::Place BorderDistance::on_edge(Index edge, const Vec3& point) const {
  const BorderEdge& e = border_[edge];
  const Vec3 offset = point - e.start;
  const double part = std::clamp(offset.dot(e.along) * e.inverse_squared_length, 0.0, 1.0);
  return {edge, part, (offset - part * e.along).squaredNorm()};
}

// Follows the border from an edge, the way that leads nearer, while it does.
BorderDistance::Place BorderDistance::nearest_along(Index edge, const Vec3& point) const {
  Place best = on_edge(edge, point);
  if (best.part > 0.0 && best.part < 1.0) return best;
  const bool forward = best.part > 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    const Place here = on_edge(forward ? border_[best.edge].next : border_[best.edge].previous, point);
    if (here.squared >= best.squared) break;
    best = here;
  }
  return best;
}

Front BorderDistance::front_at(const Place& place, const Vec3& point, const Vec3& normal) const {
  const BorderEdge& e = border_[place.edge];
  Front front{.edge = place.edge, .inside = place.part > 0.0 && place.part < 1.0};
  const double chord = std::sqrt(place.squared);
  if (chord < 1e-9) return front;
  const Vec3 way = e.start + place.part * e.along - point;
  const Vec3 there = (1.0 - place.part) * mesh_.normals[e.from] + place.part * mesh_.normals[e.to];
  const double rise = normal.dot(way);
  front.distance = chord * arc_over_chord((rise - there.dot(way)) / chord);
  front.way = way - rise * normal;
  const double length = front.way.norm();
  front.way = length > 1e-9 ? Vec3(front.way * (front.distance / length)) : Vec3(front.distance * normal.unitOrthogonal());
  return front;
}

BorderDistance::Place BorderDistance::nearest_from(const Front& front, const Vec3& point) const {
  const BorderEdge& edge = border_[front.edge];
  const Place place = nearest_along(front.edge, point);
  // A border vertex has an edge on either side; the one before it is seen already where the way leads back.
  if (front.distance > 0.0 || (point - edge.start).dot(edge.along) <= 0.0) return place;
  const Place before = nearest_along(edge.previous, point);
  return before.squared < place.squared ? before : place;
}

Front BorderDistance::seen_along(const Front& front, const Vec3& point, const Vec3& normal) const {
  return front_at(nearest_from(front, point), point, normal);
}

Front BorderDistance::seen_from(Index vertex, const Vec3& offset, const Vec3& normal) const {
  return seen_along(fronts_[vertex], mesh_.vertices[vertex] + offset, normal);
}

const Front& BorderDistance::most_along(Index vertex, const Vec3& way) const {
  const Front& own = fronts_[vertex];
  if (meeting_of_[vertex] == kNone) return own;
  const Front& other = meetings_[meeting_of_[vertex]].other;
  return other.way.dot(way) > own.way.dot(way) ? other : own;
}

std::pair<const Front*, const Front*> BorderDistance::alike(Index a, Index b) const {
  const Vec3 whole = mesh_.vertices[b] - mesh_.vertices[a];
  if (meeting_of_[a] == kNone) return {&fronts_[a], &most_along(b, fronts_[a].distance > 0.0 ? fronts_[a].way : Vec3(-whole))};
  if (meeting_of_[b] == kNone) return {&most_along(a, fronts_[b].distance > 0.0 ? fronts_[b].way : whole), &fronts_[b]};
  const Front &own = fronts_[a], &other = meetings_[meeting_of_[a]].other;
  const Front &to_own = most_along(b, own.way), &to_other = most_along(b, other.way);
  if (own.way.dot(to_own.way) >= other.way.dot(to_other.way)) return {&own, &to_own};
  return {&other, &to_other};
}

bool BorderDistance::meet_alike(Index a, Index b) const {
  const Front &a0 = fronts_[a], &a1 = meetings_[meeting_of_[a]].other, &b0 = fronts_[b], &b1 = meetings_[meeting_of_[b]].other;
  const auto both = [](const Front& x, const Front& y, const Front& u, const Front& v) {
    return x.way.dot(y.way) > kSameSideCosine * x.distance * y.distance && u.way.dot(v.way) > kSameSideCosine * u.distance * v.distance;
  };
  return both(a0, b0, a1, b1) || both(a0, b1, a1, b0);
}

// Where fronts meet, a nearer place on one side takes the place of that side's front; a nearer third side ends the meeting.
void BorderDistance::take(Index vertex, const Front& front) {
  Front& own = fronts_[vertex];
  const double gain = own.distance - front.distance;
  const auto same_side = [&](const Front& f) { return f.way.dot(front.way) > kKinkCosine * f.distance * front.distance; };
  if (meeting_of_[vertex] != kNone) {
    Meeting& meeting = meetings_[meeting_of_[vertex]];
    if (gain > kLargestShift || !(same_side(own) || same_side(meeting.other))) {
      meeting.vertex = meeting_of_[vertex] = kNone;
    } else if (same_side(meeting.other)) {
      meeting.other = own;
    }
  }
  own = front;
}

// Lets each vertex of the list take the nearest border edge that its neighbours know and offer its own to them, and those that
// gain by it in turn. By vertex: whether it gained.
std::vector<char> BorderDistance::hand_on(std::vector<Index> changed) {
  const Index n = static_cast<Index>(mesh_.vertices.size());
  std::vector<Index> first(n + 1, 0);
  for (const Edge& e : edges_.edges) ++first[e.from + 1], ++first[e.to + 1];
  for (Index v = 0; v < n; ++v) first[v + 1] += first[v];
  std::vector<Index> around(first[n]), fill(first.begin(), first.end() - 1);
  for (const Edge& e : edges_.edges) around[fill[e.from]++] = e.to, around[fill[e.to]++] = e.from;

  std::vector<char> gained(n, 0);
  const auto gains = [&](Index w, const Front& offered, const Vec3& offered_at) {
    Front& held = fronts_[w];
    const Index edge = offered.edge;
    if (held.edge == edge || held.distance == 0.0) return false;
    // The line on which the offered edge lies may be too far already.
    const double to_line = offered.inside ? offered.distance - offered.way.dot(mesh_.vertices[w] - offered_at) / offered.distance : 0.0;
    if (to_line > held.distance + kLineSlack) return false;
    const Place place = nearest_along(edge, mesh_.vertices[w]);
    if (place.edge == held.edge || place.squared >= held.distance * held.distance) return false;
    const Front front = front_at(place, mesh_.vertices[w], mesh_.normals[w]);
    if (front.distance >= held.distance - (meeting_of_[w] == kNone ? kGain : 2.0 * kEqual)) return false;
    take(w, front);
    gained[w] = 1;
    return true;
  };
  std::vector<char> waits(n, 0);
  for (const Index v : changed) {
    waits[v] = 1;
    for (Index k = first[v]; k < first[v + 1]; ++k) gains(v, fronts_[around[k]], mesh_.vertices[around[k]]);
  }
  std::vector<Index> next;
  while (!changed.empty()) {
    next.clear();
    for (const Index v : changed) {
      waits[v] = 0;
      for (Index k = first[v]; k < first[v + 1]; ++k) {
        const Index w = around[k];
        if (!gains(w, fronts_[v], mesh_.vertices[v]) || waits[w]) continue;
        waits[w] = 1;
        next.push_back(w);
      }
    }
    changed.swap(next);
  }
  return gained;
}

Index BorderDistance::add_vertex(Index a, Index b, double part, const Front& front) {
  fronts_.push_back(front);
  meeting_of_.push_back(kNone);
  return add_between(mesh_, a, b, part);
}

// Of three fronts that come to a vertex from equally far, those two stay that come most from opposite sides.
void BorderDistance::add_meeting(Index vertex, const Front& other) {
  Front& own = fronts_[vertex];
  if (own.distance == 0.0) return;
  if (other.distance < own.distance - kLargestShift) return take(vertex, seen_along(other, mesh_.vertices[vertex], mesh_.normals[vertex]));
  Index& meeting = meeting_of_[vertex];
  if (meeting == kNone) {
    meeting = static_cast<Index>(meetings_.size());
    meetings_.push_back({vertex, other});
    return;
  }
  Front& held = meetings_[meeting].other;
  const double with_own = own.way.dot(other.way), with_held = held.way.dot(other.way);
  if (std::min(with_own, with_held) >= own.way.dot(held.way)) return;
  Front& replaced = with_own < with_held ? held : own;
  const double distance = own.distance;
  replaced = other;
  replaced.distance = distance;
}

// Whether a straight way from a front's point to a vertex has its nearest places on one border edge.
bool BorderDistance::stays_on_edge(const Front& from, const Front& to, Index vertex) const {
  if (!from.inside) return false;
  if (to.distance == 0.0) return border_[from.edge].from == vertex || border_[from.edge].to == vertex;
  return from.edge == to.edge && to.inside;
}

// A vertex on an edge, where else the distance along it would not be that between its ends; else kNone.
Index BorderDistance::cut_edge(Index a, Index b, const DistanceOptions& options) {
  const auto [at_a, at_b] = alike(a, b);
  if (stays_on_edge(*at_a, *at_b, b) || stays_on_edge(*at_b, *at_a, a)) return kNone;
  const Vec3 whole = mesh_.vertices[b] - mesh_.vertices[a], middle = mesh_.vertices[a] + 0.5 * whole;
  const Vec3 normal = middle_normal(mesh_.normals[a], mesh_.normals[b]);
  const double length = whole.norm(), likeness = at_a->way.dot(at_b->way);
  if (likeness > 0.0 && likeness > kKinkCosine * at_a->distance * at_b->distance) {  // one front
    const double bulge = 0.125 * (at_b->way.dot(whole) / at_b->distance - at_a->way.dot(whole) / at_a->distance);
    if (length < options.min_edge_mm || std::abs(bulge) <= options.tolerance_mm) return kNone;
    return add_vertex(a, b, 0.5, seen_along(*at_a, middle, normal));
  }
  if (length < kShortest || reaches_border(*at_a, *at_b, whole, options) || reaches_border(*at_b, *at_a, -whole, options)) return kNone;
  const Place place_a = nearest_from(*at_a, middle), place_b = nearest_from(*at_b, middle);
  const Front from_a = front_at(place_a, middle, normal);
  const Front from_b = place_a.edge == place_b.edge ? from_a : front_at(place_b, middle, normal);
  if (from_a.way.dot(from_b.way) < kKinkCosine * from_a.distance * from_b.distance) return cut_at_kink(a, b, from_a, from_b);
  if (length < options.min_edge_mm) return kNone;
  const Front& nearer = from_a.distance < from_b.distance ? from_a : from_b;
  const bool kink = hides_kink(*at_a, nearer, whole) || hides_kink(*at_b, nearer, -whole);
  const double off = nearer.distance - 0.5 * (at_a->distance + at_b->distance);
  return std::abs(off) > (kink ? kHiddenKink : 1.0) * options.tolerance_mm ? add_vertex(a, b, 0.5, nearer) : kNone;
}

// Cuts an edge where the fronts of its ends are equally far; from how they are seen from its middle. By Newton's method,
// which a straight border needs one step of, inside a bracket.
Index BorderDistance::cut_at_kink(Index a, Index b, Front from_a, Front from_b) {
  const Vec3 whole = mesh_.vertices[b] - mesh_.vertices[a];
  const Vec3 normal = middle_normal(mesh_.normals[a], mesh_.normals[b]);
  double low = 0.0, high = 1.0, at = 0.5;
  for (int i = 0; i < kMostSearches; ++i) {
    const double lead = from_a.distance - from_b.distance;
    if (std::abs(lead) < kEqual) break;
    (lead < 0.0 ? low : high) = at;
    const double slope = from_b.way.dot(whole) / std::max(from_b.distance, 1e-9) - from_a.way.dot(whole) / std::max(from_a.distance, 1e-9);
    const double next = slope > 0.0 ? at - lead / slope : low;
    at = next > low && next < high ? next : 0.5 * (low + high);
    const Vec3 point = mesh_.vertices[a] + at * whole;
    from_a = seen_along(from_a, point, normal);
    from_b = seen_along(from_b, point, normal);
  }
  if (at < kSnap) return add_meeting(a, from_b), kNone;
  if (at > 1.0 - kSnap) return add_meeting(b, from_a), kNone;
  from_a.distance = from_b.distance = 0.5 * (from_a.distance + from_b.distance);
  const Index vertex = add_vertex(a, b, at, from_a);
  add_meeting(vertex, from_b);
  return vertex;
}

}  // namespace curvesup::toolpath
