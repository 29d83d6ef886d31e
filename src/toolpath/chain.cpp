#include "toolpath/chain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "core/disjoint_sets.h"
#include "toolpath/beads.h"
#include "toolpath/step.h"

namespace curvesup::toolpath {
namespace {

constexpr double kLongestWay = 1.3;   // of the straight distance, that a step may take over the surface
constexpr double kPortSpacing = 0.2;  // mm between the places of a closed track where a step may meet it
constexpr int kMostRefused = 12;      // steps to one end

// A place where a step may meet a track: an end, or any point of a closed track.
struct Port {
  Index track = 0, point = 0;
  friend auto operator<=>(const Port&, const Port&) = default;
};

struct Joint {
  double distance = 0.0;
  Port a, b;
  // The queue gives the shortest first; of equal ones that of the lower ports.
  friend bool operator<(const Joint& x, const Joint& y) {
    return x.distance != y.distance ? x.distance > y.distance : std::pair(x.a, x.b) > std::pair(y.a, y.b);
  }
};

// Places by the cells of a cubic grid.
class PortGrid {
 public:
  explicit PortGrid(double cell) : cell_(cell) {}
  void add(const Vec3& place, const Port& port) { entries_.push_back({key(place, 0, 0, 0), place, port}); }
  void finish() {
    std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& x, const Entry& y) { return x.key < y.key; });
  }
  // Calls use(place, port) for all places within a cell's size of `place`, and some others.
  template <class Use>
  void visit(const Vec3& place, const Use& use) const {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        const std::uint64_t first = key(place, x, y, -1);
        auto at = std::lower_bound(entries_.begin(), entries_.end(), first, [](const Entry& e, std::uint64_t k) { return e.key < k; });
        for (; at != entries_.end() && at->key <= first + 2; ++at) use(at->place, at->port);
      }
    }
  }

 private:
  struct Entry {
    std::uint64_t key;
    Vec3 place;
    Port port;
  };
  // Cells in a column along z have consecutive keys.
  [[nodiscard]] std::uint64_t key(const Vec3& p, int x, int y, int z) const {
    const auto index = [&](double c, int off) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(c / cell_)) + off + (1 << 20)) & 0x1fffff;
    };
    return index(p.x(), x) << 42 | index(p.y(), y) << 21 | index(p.z(), z);
  }

  double cell_;
  std::vector<Entry> entries_;
};

// Makes a closed track start and end at one of its points.
void start_at(Track& track, Index point) {
  auto& points = track.points;
  track.closed = false;
  if (point == 0 || point + 1 >= static_cast<Index>(points.size())) return;
  points.erase(points.begin());  // the last one repeats it, with the values of the segment that ends there
  std::rotate(points.begin(), points.begin() + (point - 1), points.end());
  points.push_back(TrackPoint(points.front()));
}

class Chainer {
 public:
  Chainer(const PieceMesh& mesh, double reach, std::vector<Track>& tracks, std::vector<char>& irregular)
      : mesh_(mesh), reach_(reach), tracks_(tracks), irregular_(irregular), ends_(reach), loops_(reach),
        sets_(tracks.size()), links_(tracks.size()), opened_(tracks.size(), kNone), refused_(tracks.size(), {0, 0}) {}

  void run() {
    if (tracks_.size() > 1) join_nearest_first();
    std::vector<char> done(tracks_.size(), 0);
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      if (opened_[t] != kNone) start_at(tracks_[t], opened_[t]);
      thin_track(mesh_, irregular_, tracks_[t]);
    }
    std::vector<Track> chains;
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      if (done[t]) continue;
      if (links_[t][0].other != kNone && links_[t][1].other != kNone) continue;  // in the middle of a chain
      chains.push_back(chain_from(static_cast<Index>(t), done));
    }
    tracks_ = std::move(chains);
  }

 private:
  // What an end (0: front, 1: back) of a track is joined to.
  struct Link {
    Index other = kNone;
    int other_end = 0;
    Index step = kNone;
    bool from_here = false;  // the step starts here
  };

  [[nodiscard]] TrackPoint point_at(const Port& port) const {
    TrackPoint point = tracks_[port.track].points[port.point];
    if (port.point == 0) point.triangle = tracks_[port.track].points[1].triangle;
    return point;
  }
  [[nodiscard]] const Vec3& place_of(const Port& port) const { return tracks_[port.track].points[port.point].position; }

  void join_nearest_first() {
    collect_ports();
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      const Index last = static_cast<Index>(tracks_[t].points.size()) - 1;
      if (last < 1) continue;
      if (tracks_[t].closed) {
        offer_loops_beside(t);
      } else {
        offer_around({t, 0});
        offer_around({t, last});
      }
    }
    while (!joints_.empty()) {
      const Joint joint = joints_.top();
      joints_.pop();
      if (free_end(joint.a) >= 0 && free_end(joint.b) >= 0 && sets_.root(joint.a.track) != sets_.root(joint.b.track)) join(joint);
    }
  }

  void collect_ports() {
    for (Index t = 0; t < static_cast<Index>(tracks_.size()); ++t) {
      const auto& points = tracks_[t].points;
      const Index last = static_cast<Index>(points.size()) - 1;
      if (last < 1) continue;
      if (!tracks_[t].closed) {
        ends_.add(points[0].position, {t, 0});
        ends_.add(points[last].position, {t, last});
        continue;
      }
      const Vec3* added = nullptr;
      for (Index i = 1; i <= last; ++i) {
        if (added != nullptr && (points[i].position - *added).norm() < kPortSpacing) continue;
        added = &points[i].position;
        loops_.add(*added, {t, i});
      }
    }
    ends_.finish();
    loops_.finish();
  }

  void offer(const Port& a, const Port& b) {
    const double distance = (place_of(a) - place_of(b)).norm();
    if (distance < reach_) joints_.push({distance, std::min(a, b), std::max(a, b)});
  }
  // To an end, all that is near.
  void offer_around(const Port& port) {
    const auto offer_to = [&](const Vec3& place, const Port& other) {
      if (other.track != port.track && (place - place_of(port)).squaredNorm() < reach_ * reach_) offer(port, other);
    };
    ends_.visit(place_of(port), offer_to);
    loops_.visit(place_of(port), offer_to);
  }
  // Between two closed tracks, the shortest joint.
  void offer_loops_beside(Index track) {
    std::vector<Joint> best;
    const auto& points = tracks_[track].points;
    for (Index i = 1; i < static_cast<Index>(points.size()); ++i) {
      loops_.visit(points[i].position, [&](const Vec3& place, const Port& other) {
        if (other.track <= track) return;
        const Joint joint{(place - points[i].position).norm(), {track, i}, other};
        const auto same = std::find_if(best.begin(), best.end(), [&](const Joint& j) { return j.b.track == other.track; });
        if (same == best.end()) {
          best.push_back(joint);
        } else if (joint.distance < same->distance) {
          *same = joint;
        }
      });
    }
    for (const Joint& joint : best) offer(joint.a, joint.b);
  }

  // The end of a track that a step to a port would take; -1 when there is none left.
  [[nodiscard]] int free_end(const Port& port) const {
    const auto& link = links_[port.track];
    if (!tracks_[port.track].closed) {
      const int end = port.point == 0 ? 0 : 1;
      return link[end].other == kNone ? end : -1;
    }
    if (opened_[port.track] != kNone && opened_[port.track] != port.point) return -1;
    return link[0].other == kNone ? 0 : link[1].other == kNone ? 1 : -1;
  }

  void join(const Joint& joint) {
    const int end_a = free_end(joint.a), end_b = free_end(joint.b);
    int &refused_a = refused_[joint.a.track][end_a], &refused_b = refused_[joint.b.track][end_b];
    const bool tired = (!tracks_[joint.a.track].closed && refused_a >= kMostRefused) || (!tracks_[joint.b.track].closed && refused_b >= kMostRefused);
    if (tired) return;
    Track step = lay_step(mesh_, irregular_, point_at(joint.a), point_at(joint.b), kLongestWay * joint.distance, under_);
    if (step.points.empty()) {
      ++refused_a, ++refused_b;
      return;
    }
    for (const Index t : under_) mark_irregular(t);
    const Index id = static_cast<Index>(steps_.size());
    steps_.push_back(std::move(step));
    links_[joint.a.track][end_a] = {joint.b.track, end_b, id, true};
    links_[joint.b.track][end_b] = {joint.a.track, end_a, id, false};
    sets_.join(joint.a.track, joint.b.track);
    for (const Port& port : {joint.a, joint.b}) {
      if (!tracks_[port.track].closed || opened_[port.track] != kNone) continue;
      opened_[port.track] = port.point;
      offer_around(port);  // its other end is here, too
    }
  }

  void mark_irregular(Index triangle) {
    irregular_[triangle] = 1;
    for (const Index across : mesh_.neighbours[triangle]) {
      if (across != kNone) irregular_[across] = 1;
    }
  }

  // The chain that begins with the free end of a track.
  Track chain_from(Index track, std::vector<char>& done) {
    int entry = links_[track][0].other == kNone ? 0 : 1;
    Track chain;
    while (true) {
      done[track] = 1;
      Track& next = tracks_[track];
      if (entry == 1) turn_round(next);
      if (chain.points.empty()) {
        chain = std::move(next);
      } else {
        append(chain, next);
        if (next.kind == PathKind::contour) chain.kind = PathKind::contour;
      }
      const Link& link = links_[track][1 - entry];
      if (link.other == kNone) return chain;
      if (!link.from_here) turn_round(steps_[link.step]);
      append(chain, steps_[link.step]);
      track = link.other;
      entry = link.other_end;
    }
  }
  static void append(Track& chain, const Track& next) {
    chain.points.insert(chain.points.end(), next.points.begin() + 1, next.points.end());
  }

  const PieceMesh& mesh_;
  double reach_;
  std::vector<Track>& tracks_;
  std::vector<char>& irregular_;
  PortGrid ends_, loops_;
  std::priority_queue<Joint> joints_;
  DisjointSets sets_;
  std::vector<std::array<Link, 2>> links_;
  std::vector<Index> opened_;  // the point where a closed track was opened
  std::vector<std::array<int, 2>> refused_;
  std::vector<Track> steps_;
  std::vector<Index> under_;
};

}  // namespace

void chain_tracks(const PieceMesh& mesh, double reach, std::vector<Track>& tracks, std::vector<char>& irregular) {
  Chainer(mesh, reach, tracks, irregular).run();
}

}  // namespace curvesup::toolpath
