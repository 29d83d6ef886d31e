#include "toolpath/ridge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "toolpath/step.h"

namespace curvesup::toolpath {
namespace {

constexpr double kSlack = 0.01;          // mm: a strip just as wide as a limit is one line all along, whatever the distances' noise
constexpr double kMeetingCosine = -0.5;  // fronts that meet under more than 120 degrees
constexpr double kHandedDown = 3.0;      // widths
constexpr double kGap = 0.25;            // widths of the strip, from the end of a line to the border ...
constexpr double kLeastGap = 0.05;       // ... where else the line would have to be wider than it may be
constexpr double kSpikeCosine = -0.5;    // of the turn at a node that is off the line
constexpr double kLongestWay = 1.3;      // of the straight distance, past such a node
constexpr double kAlmost = 0.95;         // of the widest bead
constexpr double kRound = 0.75;          // widths of something round that has a line of its own ...
constexpr double kRoundReach = 0.25;     // ... so long to either side of its middle, as a part of its width
constexpr double kStretch = 1.5;         // widths at the end of a line that share what lies around the end

// Leaves out single points from which a line turns back: on an edge that runs along the medial line, they may lie anywhere.
std::vector<TrackPoint> cut_spikes(const PieceMesh& mesh, const std::vector<TrackPoint>& points) {
  std::vector<TrackPoint> kept{points[0]};
  for (std::size_t i = 1; i < points.size(); ++i) {
    TrackPoint from = kept.back();
    if (from.triangle == kNone) from.triangle = points[i].triangle;
    if (i + 1 < points.size()) {
      const Vec3 to = points[i].position - from.position, on = points[i + 1].position - points[i].position;
      const double straight = (points[i + 1].position - from.position).norm();
      if (to.dot(on) < kSpikeCosine * to.norm() * on.norm()) {
        const std::vector<TrackPoint> way = walk_to(mesh, from, points[i + 1], kLongestWay * straight);
        kept.insert(kept.end(), way.begin(), way.end());
        if (!way.empty()) {
          ++i;
          continue;
        }
      }
    }
    kept.push_back(points[i]);
  }
  return kept;
}

}  // namespace

Ridge::Ridge(const BorderDistance& distance, const BeadWidths& beads) : distance_(distance), beads_(beads) {
  find_nodes();
  if (nodes_.empty()) return;
  find_summits();
  cut_to_strips();
  chain_up();
  hand_down();
}

double Ridge::strip_width(double distance) const { return 2.0 * (distance - std::floor(distance / beads_.width) * beads_.width); }

bool Ridge::fits(double distance) const {
  const double left = strip_width(distance);
  const int rings = static_cast<int>(distance / beads_.width);
  return left <= beads_.widest_strip(rings) + kSlack && (rings == 0 || left >= beads_.min - kSlack);
}

void Ridge::find_nodes() {
  const PieceMesh& mesh = distance_.mesh();
  node_of_vertex_.assign(mesh.vertices.size(), kNone);
  for (const Meeting& m : distance_.meetings()) {
    const Front& own = distance_.front(m.vertex);
    if (own.way.dot(m.other.way) > kMeetingCosine * own.distance * m.other.distance) continue;
    node_of_vertex_[m.vertex] = static_cast<Index>(nodes_.size());
    nodes_.push_back({mesh.vertices[m.vertex], mesh.normals[m.vertex], own.distance});
  }
  if (nodes_.empty()) return;
  const auto& table = distance_.edges();
  std::vector<char> joined(table.edges.size(), 0);
  for (std::size_t e = 0; e < table.edges.size(); ++e) {
    const Edge& edge = table.edges[e];
    const Index a = node_of_vertex_[edge.from], b = node_of_vertex_[edge.to];
    if (a == kNone || b == kNone || edge.right == kNone || !distance_.meet_alike(edge.from, edge.to)) continue;
    joined[e] = 1;
    segments_.push_back({a, b, edge.left});
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) join_in_triangle(static_cast<Index>(t), joined);
}

// A triangle at whose corners fronts from three sides meet, two at each.
void Ridge::join_in_triangle(Index triangle, const std::vector<char>& joined) {
  const PieceMesh& mesh = distance_.mesh();
  std::array<Index, 3> found;
  int count = 0;
  for (const Index v : mesh.triangles[triangle]) {
    if (distance_.meeting_of(v) == kNone) return;
    if (node_of_vertex_[v] != kNone) found[count++] = node_of_vertex_[v];
  }
  for (const Index e : distance_.edges().of_triangle[triangle]) {
    if (joined[e]) return;
  }
  if (count == 2) segments_.push_back({found[0], found[1], triangle});
  if (count != 3) return;
  Node centre{Vec3::Zero(), Vec3::Zero(), 0.0};
  for (const Index n : found) {
    centre.position += nodes_[n].position / 3.0;
    centre.normal += nodes_[n].normal;
    centre.distance += nodes_[n].distance / 3.0;
  }
  centre.normal.normalize();
  nodes_.push_back(centre);
  for (const Index n : found) segments_.push_back({n, static_cast<Index>(nodes_.size()) - 1, triangle});
}

// Nodes that no other one follows, where the distance is greatest: the middles of something round.
void Ridge::find_summits() {
  const PieceMesh& mesh = distance_.mesh();
  std::vector<char> lone(nodes_.size());
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    lone[n] = fits(nodes_[n].distance) && strip_width(nodes_[n].distance) > kRound * beads_.width;
  }
  for (const Segment& s : segments_) lone[s.a] = lone[s.b] = 0;
  if (std::find(lone.begin(), lone.end(), 1) == lone.end()) return;
  for (const Edge& edge : distance_.edges().edges) {
    for (const auto& [low, high] : {std::pair(edge.from, edge.to), std::pair(edge.to, edge.from)}) {
      const Index node = node_of_vertex_[low];
      if (node != kNone && distance_.distance(high) > distance_.distance(low)) lone[node] = 0;
    }
  }
  for (const Meeting& m : distance_.meetings()) {
    const Index node = node_of_vertex_[m.vertex];
    if (node != kNone && lone[node]) summits_.push_back({m.vertex, node, {}});
  }
  for (Index t = 0; t < static_cast<Index>(mesh.triangles.size()) && !summits_.empty(); ++t) {
    for (const Index v : mesh.triangles[t]) {
      const auto at = std::lower_bound(summits_.begin(), summits_.end(), v, [](const Summit& s, Index vertex) { return s.vertex < vertex; });
      if (at != summits_.end() && at->vertex == v) at->around.push_back(t);
    }
  }
  for (const Summit& s : summits_) nodes_[s.node].filled = true;
}

// Keeps the parts of the segments that one centre line fits.
void Ridge::cut_to_strips() {
  std::vector<Segment> kept;
  cut_end_.assign(nodes_.size(), 0);
  const auto add_node = [&](const Segment& s, double part) {
    const Node a = nodes_[s.a], b = nodes_[s.b];
    nodes_.push_back({a.position + part * (b.position - a.position), (a.normal + part * (b.normal - a.normal)).normalized(),
                      a.distance + part * (b.distance - a.distance)});
    cut_end_.push_back(1);
    return static_cast<Index>(nodes_.size()) - 1;
  };
  std::vector<double> parts;
  for (const Segment& s : segments_) {
    const double from = nodes_[s.a].distance, to = nodes_[s.b].distance;
    parts.assign({0.0, 1.0});
    const double low = std::min(from, to), high = std::max(from, to);
    for (int n = static_cast<int>(low / beads_.width); n * beads_.width <= high; ++n) {
      for (const double limit : {n == 0 ? 0.0 : beads_.min, beads_.widest_strip(n)}) {
        const double at = n * beads_.width + 0.5 * limit;
        if (at > low && at < high) parts.push_back((at - from) / (to - from));
      }
    }
    std::sort(parts.begin(), parts.end());
    Index previous = s.a;
    for (std::size_t i = 1; i < parts.size(); ++i) {
      const double middle = from + 0.5 * (parts[i - 1] + parts[i]) * (to - from);
      const Index next = i + 1 == parts.size() ? s.b : (fits(middle) || fits(from + 0.5 * (parts[i] + parts[i + 1]) * (to - from))) ? add_node(s, parts[i]) : kNone;
      if (fits(middle)) kept.push_back({previous, next, s.triangle});
      previous = next;
    }
  }
  segments_ = std::move(kept);
}

void Ridge::chain_up() {
  std::vector<std::array<Index, 4>> arms(nodes_.size(), {kNone, kNone, kNone, kNone});
  std::vector<std::uint8_t> degree(nodes_.size(), 0);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    for (const Index v : {segments_[s].a, segments_[s].b}) {
      if (degree[v] < 4) arms[v][degree[v]++] = static_cast<Index>(s);
    }
  }
  const auto other_end = [&](Index s, Index v) { return segments_[s].a == v ? segments_[s].b : segments_[s].a; };
  // Where three arms meet, the shortest one goes if it is no longer than a bead and leads nowhere.
  const auto remove_arm = [&](Index v, Index s) {
    int kept = 0;
    for (int i = 0; i < degree[v]; ++i) {
      if (arms[v][i] != s) arms[v][kept++] = arms[v][i];
    }
    degree[v] = static_cast<std::uint8_t>(kept);
  };
  free_end_.assign(nodes_.size(), 0);
  std::vector<char> used(segments_.size(), 0);
  std::vector<Index> arm, shortest;
  for (Index v = 0; v < static_cast<Index>(nodes_.size()); ++v) {
    if (degree[v] < 3) continue;
    double least = beads_.width;
    shortest.clear();
    for (int i = 0; i < degree[v]; ++i) {
      arm.assign(1, arms[v][i]);
      Index at = other_end(arm.back(), v);
      double length = (nodes_[at].position - nodes_[v].position).norm();
      while (degree[at] == 2 && length < least) {
        const Index on = arms[at][0] == arm.back() ? arms[at][1] : arms[at][0];
        const Index to = other_end(on, at);
        length += (nodes_[to].position - nodes_[at].position).norm();
        arm.push_back(on);
        at = to;
      }
      if (degree[at] == 1 && length < least) least = length, shortest = arm;
    }
    for (const Index s : shortest) {
      used[s] = 1;
      remove_arm(segments_[s].a, s);
      remove_arm(segments_[s].b, s);
    }
  }
  // Of three arms the two straightest go on into each other.
  const auto mate = [&](Index v, Index s) -> Index {
    if (degree[v] == 2) return arms[v][0] == s ? arms[v][1] : arms[v][0];
    if (degree[v] < 2) return kNone;
    double straightest = 2.0;
    std::array<Index, 2> pair{kNone, kNone};
    for (int i = 0; i < degree[v]; ++i) {
      for (int j = i + 1; j < degree[v]; ++j) {
        const Vec3 x = (nodes_[other_end(arms[v][i], v)].position - nodes_[v].position).normalized();
        const Vec3 y = (nodes_[other_end(arms[v][j], v)].position - nodes_[v].position).normalized();
        if (x.dot(y) < straightest) straightest = x.dot(y), pair = {arms[v][i], arms[v][j]};
      }
    }
    return pair[0] == s ? pair[1] : pair[1] == s ? pair[0] : kNone;
  };
  const auto follow = [&](Index start, Index segment) {
    std::vector<Index> chain{start}, under{kNone};
    for (Index v = start, s = segment; s != kNone && !used[s];) {
      used[s] = 1;
      v = other_end(s, v);
      chain.push_back(v);
      under.push_back(segments_[s].triangle);
      s = mate(v, s);
    }
    double length = 0.0, distance = 0.0;
    for (std::size_t i = 1; i < chain.size(); ++i) {
      length += (nodes_[chain[i]].position - nodes_[chain[i - 1]].position).norm();
    }
    for (const Index v : chain) distance = std::max(distance, nodes_[v].distance);
    // A spur beside a longer line, or a short remainder in a corner, is left to the beads around it.
    const bool spur = degree[chain.front()] > 2 || degree[chain.back()] > 2;
    const bool cut = cut_end_[chain.front()] || cut_end_[chain.back()];
    if (length < 0.75 * beads_.width && (spur || cut) && distance > beads_.width) return;
    if (spur && length < distance) return;
    for (const Index v : {chain.front(), chain.back()}) free_end_[v] = degree[v] == 1 && !cut_end_[v];
    for (const Index v : chain) nodes_[v].filled = true;
    chains_.push_back(std::move(chain));
    chain_under_.push_back(std::move(under));
  };
  for (Index v = 0; v < static_cast<Index>(nodes_.size()); ++v) {
    for (int i = 0; i < degree[v]; ++i) {
      if (!used[arms[v][i]] && mate(v, arms[v][i]) == kNone) follow(v, arms[v][i]);
    }
  }
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    if (!used[s]) follow(segments_[s].a, static_cast<Index>(s));  // a loop
  }
}

double Ridge::slack(Index node, const Vec3& position, double distance) const {
  return (nodes_[node].position - position).norm() - (nodes_[node].distance - distance);
}

// Gives each vertex the ridge node that its steepest ascent leads to: the one that is reached with the least slack.
void Ridge::hand_down() {
  const PieceMesh& mesh = distance_.mesh();
  const auto& edges = distance_.edges().edges;
  const auto offer = [&](Index vertex, Index node) {
    const double here = distance_.distance(vertex);
    if (nodes_[node].distance - here > kHandedDown * beads_.width) return;
    Index& held = node_of_vertex_[vertex];
    const double now = slack(node, mesh.vertices[vertex], here);
    if (held == kNone || now < slack(held, mesh.vertices[vertex], here)) held = node;
  };
  // Downhill along the edges, highest vertex first.
  const Index n = static_cast<Index>(mesh.vertices.size());
  const auto upper_first = [&](const Edge& e) {
    return distance_.distance(e.from) < distance_.distance(e.to) ? std::pair(e.to, e.from) : std::pair(e.from, e.to);
  };
  std::vector<Index> first(n + 1, 0);
  for (const Edge& e : edges) ++first[upper_first(e).first + 1];
  for (Index v = 0; v < n; ++v) first[v + 1] += first[v];
  std::vector<Index> below(first[n]), fill(first.begin(), first.end() - 1);
  for (const Edge& e : edges) {
    const auto [up, down] = upper_first(e);
    below[fill[up]++] = down;
  }
  std::vector<std::pair<double, Index>> order;
  order.reserve(n);
  for (Index v = 0; v < n; ++v) {
    if (first[v] < first[v + 1]) order.push_back({-distance_.distance(v), v});
  }
  std::sort(order.begin(), order.end());
  for (const auto& [height, up] : order) {
    if (node_of_vertex_[up] == kNone) continue;
    for (Index k = first[up]; k < first[up + 1]; ++k) offer(below[k], node_of_vertex_[up]);
  }
}

double Ridge::rise(Index vertex) const {
  const Index node = nodes_.empty() ? kNone : node_of_vertex_[vertex];
  return node == kNone ? std::numeric_limits<double>::infinity() : nodes_[node].distance - distance_.distance(vertex);
}

double Ridge::ring_distance(int level, Index vertex) const {
  const double w = beads_.width, usual = (level + 0.5) * w, left = distance_.distance(vertex) + rise(vertex) - level * w;
  return left < w && 2.0 * left > beads_.widest_strip(level) + kSlack ? level * w + 0.5 * left : usual;
}

bool Ridge::replaces_ring(int level, Index from, Index to, const Vec3& position, double here) const {
  const double w = beads_.width;
  if (nodes_.empty()) return false;
  Index best = kNone;
  for (const Index vertex : {from, to}) {
    const Index node = node_of_vertex_[vertex];
    if (node != kNone && (best == kNone || slack(node, position, here) < slack(best, position, here))) best = node;
  }
  if (best == kNone || slack(best, position, here) > 0.8 * w) return false;
  return nodes_[best].filled && level >= static_cast<int>(std::floor(nodes_[best].distance / w));
}

std::vector<Track> Ridge::centre_lines() const {
  std::vector<Track> tracks;
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    Track track{.kind = PathKind::centre_line, .points = {}};
    for (std::size_t i = 0; i < chains_[c].size(); ++i) {
      const Node& node = nodes_[chains_[c][i]];
      track.points.push_back({.position = node.position, .normal = node.normal, .triangle = chain_under_[c][i]});
    }
    track.points = cut_spikes(distance_.mesh(), track.points);
    track.closed = chains_[c].size() > 3 && chains_[c].front() == chains_[c].back();
    if (!track.closed) {
      for (const Index end : {chains_[c].front(), chains_[c].back()}) {
        turn_round(track);
        if (free_end_[end] && track.points.size() > 1) draw_out(track, end);
      }
    }
    tracks.push_back(std::move(track));
  }
  for (const auto& [vertex, id, around] : summits_) {
    const Node& node = nodes_[id];
    const double reach = kRoundReach * strip_width(node.distance);
    tracks.push_back(straight_through(distance_, node.position, around, node.normal.cross(distance_.front(vertex).way), reach, reach));
  }
  return tracks;
}

// Lets a track go on from its last point, the node `end`.
void Ridge::draw_out(Track& track, Index end) const {
  const double distance = nodes_[end].distance, border = std::floor(distance / beads_.width) * beads_.width;
  const double width = strip_width(distance);
  if (width <= 0.0) return;
  const double reach = std::min(kStretch * beads_.width, 0.5 * (length_of(track) + width));
  const double roomy = std::clamp(reach * (1.0 - width / (kAlmost * beads_.max)), kLeastGap * width, kGap * width);
  const double gap = std::max(roomy, 0.5 * beads_.min);  // into a tip as far as a bead is as wide
  if (distance <= border + gap) return;
  const TrackPoint last = track.points.back();
  std::size_t before = track.points.size() - 2;
  while (before > 0 && (last.position - track.points[before].position).norm() < 0.5 * width) --before;
  const auto walk = [&](double length) {
    return walk_straight(distance_, {last.triangle, last.position}, last.position - track.points[before].position, length, border + gap);
  };
  Walk on = walk(width);
  if (!on.stopped) on = walk(std::max(0.0, on.length - gap));
  track.points.insert(track.points.end(), on.points.begin(), on.points.end());
}

}  // namespace curvesup::toolpath
