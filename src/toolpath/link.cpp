#include "toolpath/link.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/step.h"

namespace curvesup::toolpath {
namespace {

constexpr double kOpening = 0.75;  // of the widest opening: its outer half is out of reach of the steps
constexpr int kOpeningRounds = 4;
constexpr double kLongestStep = 1.5;  // widths, from a ring to the next one
constexpr double kLongestWay = 1.3;   // of that, over the surface
constexpr std::array kMostUneven = {0.1, 0.3};  // of what is left out to what should be; places of the first kind come first

// Rings as cyclic lists over one pool of points; rings of odd level run the other way, so that joined ones agree.
class Linker {
 public:
  Linker(const BorderDistance& distance, double width, std::vector<Track>& tracks)
      : distance_(distance), width_(width), tracks_(tracks) {}

  void run() {
    load_rings();
    std::vector<Index> rings;
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      if (head_[t] != kNone) rings.push_back(t);
    }
    std::stable_sort(rings.begin(), rings.end(), [&](Index x, Index y) { return tracks_[x].level < tracks_[y].level; });
    for (const Index ring : rings) {
      if (tracks_[ring].level > 0) join_outwards(ring);
    }
    add_tails_and_store();
  }

 private:
  struct Node {
    TrackPoint point;
    Index next = kNone, previous = kNone;
    Index ring = kNone;  // kNone on a step between rings
    bool live = true;
  };

  void load_rings() {
    head_.assign(tracks_.size(), kNone);
    parent_.resize(tracks_.size());
    std::iota(parent_.begin(), parent_.end(), 0);
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      Track& track = tracks_[t];
      if (track.kind != PathKind::contour || !track.closed || track.points.size() < 4) continue;
      if (track.level % 2 == 1) turn_round(track);
      const Index first = static_cast<Index>(nodes_.size()), n = static_cast<Index>(track.points.size()) - 1;
      for (Index i = 0; i < n; ++i) {
        nodes_.push_back({track.points[i + 1], first + (i + 1) % n, first + (i + n - 1) % n, t, true});
        lookup_.push_back({nodes_.back().point.triangle, track.level, first + i});
      }
      head_[t] = first;
    }
    std::sort(lookup_.begin(), lookup_.end());
  }

  Index root(Index ring) {
    while (parent_[ring] != ring) ring = parent_[ring] = parent_[parent_[ring]];
    return ring;
  }
  const Vec3& at(Index node) const { return nodes_[node].point.position; }

  // The live node whose incoming segment holds a point of a triangle; kNone if no ring of that level runs there any more.
  Index segment_at(const SurfacePoint& place, int level) const {
    const Key from{place.triangle, level, 0};
    Index best = kNone;
    double nearest = 0.05;
    for (auto it = std::lower_bound(lookup_.begin(), lookup_.end(), from);
         it != lookup_.end() && it->triangle == place.triangle && it->level == level; ++it) {
      for (Index node = it->node; nodes_[node].live && nodes_[node].ring != kNone; node = nodes_[node].previous) {
        const Index before = nodes_[node].previous;
        const double d = (closest_point_on_segment(place.position, at(before), at(node)) - place.position).norm();
        if (d < nearest) nearest = d, best = node;
        if (nodes_[before].point.triangle != place.triangle || before == it->node) break;
      }
    }
    return best;
  }

  Index insert_before(Index node, const Vec3& position) {
    const Index before = nodes_[node].previous, id = static_cast<Index>(nodes_.size());
    Node fresh = nodes_[node];
    fresh.point.position = position;
    fresh.point.normal = normal_at(distance_.mesh(), fresh.point.triangle, position);
    fresh.previous = before;
    fresh.next = node;
    nodes_.push_back(fresh);
    nodes_[before].next = id;
    nodes_[node].previous = id;
    return id;
  }

  // The place `length` further along the list, on the way to the node `next`; kNone when a step or the start comes first.
  struct Ahead {
    Index next = kNone;
    double part = 0.0;  // of the segment to `next`
  };
  [[nodiscard]] Ahead ahead(Index node, double length) const {
    const Index start = node;
    while (true) {
      const Index next = nodes_[node].next;
      if (next == start || nodes_[next].ring == kNone || nodes_[node].ring == kNone) return {};
      const double step = (at(next) - at(node)).norm();
      if (step >= length) return {next, step > 0.0 ? length / step : 0.0};
      length -= step;
      node = next;
    }
  }
  [[nodiscard]] Vec3 position(const Ahead& place) const {
    const Vec3& from = at(nodes_[place.next].previous);
    return from + place.part * (at(place.next) - from);
  }
  // The same as a node, new if there is none.
  Index forward(Index node, double length) {
    const Ahead place = ahead(node, length);
    return place.next == kNone || place.part > 0.999 ? place.next : insert_before(place.next, position(place));
  }

  // The place on a ring nearest to `from`, found downhill from the segment that ends at `node`.
  struct Foot {
    Index node = kNone;  // where its segment ends
    Vec3 position = Vec3::Zero();
    double distance = 1e300;
  };
  [[nodiscard]] Foot foot_near(Index node, const Vec3& from) const {
    Foot best;
    const auto look_at = [&](Index n) {
      const Vec3 place = closest_point_on_segment(from, at(nodes_[n].previous), at(n));
      const double distance = (place - from).norm();
      if (distance < best.distance) best = {n, place, distance};
    };
    const auto is_step = [&](Index n) { return nodes_[n].ring == kNone || nodes_[nodes_[n].previous].ring == kNone; };
    const double reach = 2.0 * width_;
    double way = 0.0;
    for (Index n = node; way < reach && !is_step(n); n = nodes_[n].next) {
      look_at(n);
      way += (at(nodes_[n].next) - at(n)).norm();
    }
    way = 0.0;
    for (Index n = nodes_[node].previous; way < reach && !is_step(n); n = nodes_[n].previous) {
      look_at(n);
      way += (at(n) - at(nodes_[n].previous)).norm();
    }
    return best;
  }

  // Where a step leads back from the outer ring that one from `q1` leads to: nothing wider than a bead is left out of either
  // ring, and of both no more than the two steps are long.
  struct Opening {
    double length = 0.0;  // on the inner ring
    Foot foot;
    double error = 1e300;  // relative
  };
  [[nodiscard]] Opening opening(Index q1, const Foot& foot1) const {
    Opening best;
    double length = width_;
    for (int i = 0; i < kOpeningRounds; ++i) {
      const Ahead q2 = ahead(q1, length);
      if (q2.next == kNone) break;
      const Foot foot = foot_near(foot1.node, position(q2));
      if (foot.node == kNone) break;
      const double outside = (foot.position - foot1.position).norm();
      const double part = kOpening * std::min((foot1.distance + foot.distance) / (length + outside), width_ / std::max(length, outside));
      const double error = std::abs(part - 1.0);
      if (error < best.error) best = {length, foot, error};
      length = std::clamp(length * part, 0.3 * width_, 1.5 * width_);
    }
    return best;
  }

  Walk descend(Index node, int to_level) const {
    const TrackPoint& p = nodes_[node].point;
    return descend(p, to_level);
  }
  Walk descend(const TrackPoint& p, int to_level) const {
    // Towards the nearest place of the border, as the nearest corner of the triangle sees it.
    const PieceMesh& mesh = distance_.mesh();
    Index corner = mesh.triangles[p.triangle][0];
    for (const Index v : mesh.triangles[p.triangle]) {
      if ((mesh.vertices[v] - p.position).squaredNorm() < (mesh.vertices[corner] - p.position).squaredNorm()) corner = v;
    }
    const Front front = distance_.seen_from(corner, p.position - mesh.vertices[corner], p.normal);
    return walk_straight(distance_, {p.triangle, p.position}, front.way, 1.6 * width_,
                         (to_level + 0.5) * width_);
  }

  // The straight way from a node to a place on a ring outside of its own.
  [[nodiscard]] std::vector<TrackPoint> way_down(Index node, const Foot& foot) const {
    TrackPoint to = nodes_[foot.node].point;
    to.position = foot.position;
    to.normal = normal_at(distance_.mesh(), to.triangle, foot.position);
    return walk_to(distance_.mesh(), nodes_[node].point, to, kLongestWay * foot.distance);
  }

  // Length along the list from one node to another; negative when it is longer than `limit` or a step lies between.
  double arc(Index from, Index to, double limit) const {
    double sum = 0.0;
    for (Index node = from; node != to;) {
      const Index next = nodes_[node].next;
      sum += (at(next) - at(node)).norm();
      if (sum > limit || nodes_[next].ring == kNone) return -1.0;
      node = next;
    }
    return sum;
  }

  // Rings one level farther out that are not joined yet.
  Index open_outside(Index ring) {
    Index open = 0;
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      open += head_[t] != kNone && tracks_[t].level == tracks_[ring].level - 1 && root(t) != root(ring);
    }
    return open;
  }

  void join_outwards(Index ring) {
    Index open = open_outside(ring);
    for (const double most_uneven : kMostUneven) {
      Index node = head_[ring];
      double since = width_;
      for (Index left = static_cast<Index>(tracks_[ring].points.size()); left > 0 && open > 0; --left) {
        const Index next = nodes_[node].next;
        if (nodes_[node].live && nodes_[node].ring == ring && since >= width_) {
          since = 0.0;
          if (bridge(ring, node, most_uneven)) open = open_outside(ring);
        }
        since += (at(next) - at(node)).norm();
        node = next;
      }
    }
  }

  bool bridge(Index ring, Index q1, double most_uneven) {
    const int outer = tracks_[ring].level - 1;
    const Walk down = descend(q1, outer);
    if (!down.stopped) return false;
    const Index below = segment_at(down.end, outer);
    if (below == kNone || root(nodes_[below].ring) == root(ring)) return false;
    const Foot foot1 = foot_near(below, at(q1));
    if (foot1.node == kNone || foot1.distance > kLongestStep * width_) return false;
    const Opening gap = opening(q1, foot1);
    if (!(gap.error <= most_uneven) || gap.foot.distance > kLongestStep * width_) return false;
    const Index q2 = forward(q1, gap.length);
    if (q2 == kNone) return false;
    const std::vector<TrackPoint> down1 = way_down(q1, foot1), down2 = way_down(q2, gap.foot);
    if (down1.empty() || down2.empty()) return false;
    const Index seg1 = foot1.node, seg2 = gap.foot.node;
    // The outer ring runs the other way: it meets the end of the second step first.
    const Index a2 = insert_before(seg2, gap.foot.position);
    if (seg1 == seg2 && (at(a2) - at(nodes_[a2].previous)).norm() > (foot1.position - at(nodes_[a2].previous)).norm()) {
      return false;
    }
    const Index a1 = insert_before(seg1, foot1.position);
    const double opened = arc(a2, a1, 2.0 * width_);
    if (opened < 0.3 * width_) return false;

    for (Index node = nodes_[a2].next; node != a1; node = nodes_[node].next) nodes_[node].live = false;
    for (Index node = nodes_[q1].next; node != q2; node = nodes_[node].next) nodes_[node].live = false;
    const Index outer_ring = nodes_[a1].ring;
    Index tail = a2;
    const auto append = [&](const TrackPoint& point) {
      const Index id = static_cast<Index>(nodes_.size());
      nodes_.push_back({point, kNone, tail, kNone, true});
      nodes_.back().point.step = true;
      nodes_[tail].next = id;
      tail = id;
    };
    // a2 -> q2 against the second walk; its segments' triangles move to their other ends.
    const auto& up = down2;
    for (std::size_t i = up.size() - 1; i-- > 0;) {
      TrackPoint point = up[i];
      point.triangle = up[i + 1].triangle;
      append(point);
    }
    nodes_[tail].next = q2;
    nodes_[q2].previous = tail;
    nodes_[q2].point.triangle = up.front().triangle;
    nodes_[q2].point.step = true;
    tail = q1;
    for (std::size_t i = 0; i + 1 < down1.size(); ++i) append(down1[i]);
    nodes_[tail].next = a1;
    nodes_[a1].previous = tail;
    nodes_[a1].point.triangle = down1.back().triangle;
    nodes_[a1].point.step = true;
    parent_[root(ring)] = root(outer_ring);
    return true;
  }

  void add_tails_and_store() {
    std::vector<Track> result;
    std::vector<Index> start(tracks_.size(), kNone);
    for (Index node = 0; node < static_cast<Index>(nodes_.size()); ++node) {
      if (!nodes_[node].live || nodes_[node].ring == kNone) continue;
      Index& first = start[root(nodes_[node].ring)];
      if (first == kNone) first = node;
    }
    std::vector<Index> tail_of(tracks_.size(), kNone);  // per root: the centre line at its end
    std::vector<Walk> tail_walk(tracks_.size());        // from the line's end down to the ring
    std::vector<char> absorbed(tracks_.size(), 0);
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      Track& line = tracks_[t];
      if (line.kind != PathKind::centre_line || line.closed || line.points.size() < 2) continue;
      for (int side = 0; side < 2 && !absorbed[t]; ++side) {
        TrackPoint end = side == 0 ? line.points.front() : line.points.back();
        if (side == 0) end.triangle = line.points[1].triangle;
        const double d = distance_at(distance_, end.triangle, end.position);
        const int level = static_cast<int>(std::floor(d / width_ - 0.5));
        if (level < 0) continue;
        Walk walk = descend(end, level);
        if (!walk.stopped) continue;
        const Index segment = segment_at(walk.end, level);
        if (segment == kNone) continue;
        const Index r = root(nodes_[segment].ring);
        if (tail_of[r] != kNone) continue;
        start[r] = insert_before(segment, walk.end.position);
        tail_of[r] = t;
        tail_walk[r] = std::move(walk);
        absorbed[t] = 1;
        if (side == 1) turn_round(line);
      }
    }
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      if (absorbed[t]) continue;
      if (head_[t] == kNone) {
        result.push_back(std::move(tracks_[t]));
        continue;
      }
      if (root(t) != t) continue;
      Track track{.kind = PathKind::contour, .closed = true, .level = tracks_[t].level, .points = {}};
      Index node = start[t];
      track.points.push_back(nodes_[node].point);
      do {
        node = nodes_[node].next;
        track.points.push_back(nodes_[node].point);
      } while (node != start[t]);
      if (tail_of[t] != kNone) {
        track.closed = false;
        const auto& down = tail_walk[t].points;
        for (std::size_t i = down.size() - 1; i-- > 0;) {
          track.points.push_back(down[i]);
          track.points.back().triangle = down[i + 1].triangle;
          track.points.back().step = true;
        }
        const auto& line = tracks_[tail_of[t]].points;
        track.points.push_back(line.front());
        track.points.back().triangle = down.front().triangle;
        track.points.back().step = true;
        track.points.insert(track.points.end(), line.begin() + 1, line.end());
      }
      result.push_back(std::move(track));
    }
    tracks_ = std::move(result);
  }

  struct Key {
    Index triangle;
    int level;
    Index node;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  const BorderDistance& distance_;
  double width_;
  std::vector<Track>& tracks_;
  std::vector<Node> nodes_;
  std::vector<Key> lookup_;
  std::vector<Index> head_, parent_;
};

}  // namespace

void link_tracks(const BorderDistance& distance, double width, std::vector<Track>& tracks) {
  Linker(distance, width, tracks).run();
}

}  // namespace curvesup::toolpath
