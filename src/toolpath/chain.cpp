#include "toolpath/chain.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/beads.h"

namespace curvesup::toolpath {
namespace {

constexpr double kMiss = 0.02;             // mm by which a straight step may miss its end; it bends there
constexpr double kOff = 0.005;             // mm by which it may leave the surface, over degenerate triangles
constexpr double kUneven = 0.019;          // of the thickness
constexpr double kPlaces = 0.3;            // mm between the places where that is looked at
constexpr std::size_t kMostPairs = 40000;  // of points of two closed tracks that are compared

struct Box {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

  void add(const Vec3& p) { low = low.cwiseMin(p), high = high.cwiseMax(p); }
  [[nodiscard]] double distance(const Vec3& p) const { return (low - p).cwiseMax(p - high).cwiseMax(0.0).norm(); }
  [[nodiscard]] double distance(const Box& b) const { return (low - b.high).cwiseMax(b.low - high).cwiseMax(0.0).norm(); }
};

Box box_of(const Track& track) {
  Box box;
  for (const TrackPoint& p : track.points) box.add(p.position);
  return box;
}

// Makes a closed track start and end at one of its points.
void start_at(Track& track, std::size_t point) {
  auto& points = track.points;
  if (point == 0 || point + 1 >= points.size()) return;
  points.erase(points.begin());  // the last one repeats it, with the values of the segment that ends there
  std::rotate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(point - 1), points.end());
  points.push_back(TrackPoint(points.front()));
}

// Where a chain can go on: from its point `from` (its end, unless it is still closed) to a point of another track.
struct Joint {
  double distance = 0.0;
  std::size_t track = 0, from = 0, to = 0;
};

class Chainer {
 public:
  Chainer(const BorderDistance& distance, double reach, std::vector<Track>& tracks, std::vector<char>& irregular)
      : distance_(distance), reach_(reach), tracks_(tracks), irregular_(irregular), used_(tracks.size(), 0) {
    for (const Track& track : tracks) boxes_.push_back(box_of(track));
  }

  void run() {
    std::vector<Track> chains;
    for (std::size_t seed = 0; seed < tracks_.size(); ++seed) {
      if (used_[seed] || tracks_[seed].points.size() < 2) continue;
      used_[seed] = 1;
      Track chain = std::move(tracks_[seed]);
      while (extend(chain)) {
      }
      if (!chain.closed) {
        turn_round(chain);
        while (extend(chain)) {
        }
      }
      chains.push_back(std::move(chain));
    }
    tracks_ = std::move(chains);
  }

 private:
  bool extend(Track& chain) {
    Joint best{.distance = reach_};
    bool found = false;
    const auto offer = [&](const Joint& joint) {
      if (joint.distance >= best.distance) return;
      best = joint;
      found = true;
    };
    const Box own = chain.closed ? box_of(chain) : Box{};
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      if (used_[t] || tracks_[t].points.size() < 2) continue;
      if (chain.closed ? boxes_[t].distance(own) >= best.distance : boxes_[t].distance(chain.points.back().position) >= best.distance) continue;
      if (chain.closed) {
        offer_joints_of_loop(chain, t, offer);
      } else {
        offer_joints(chain.points.back().position, chain.points.size() - 1, t, offer);
      }
    }
    return found && join(chain, best);
  }

  template <class Offer>
  void offer_joints(const Vec3& place, std::size_t from, std::size_t t, const Offer& offer) const {
    const auto& points = tracks_[t].points;
    const std::size_t last = points.size() - 1;
    for (std::size_t i = 0; i <= last; i += tracks_[t].closed ? 1 : last) {
      offer(Joint{(points[i].position - place).norm(), t, from, i});
    }
  }

  template <class Offer>
  void offer_joints_of_loop(const Track& chain, std::size_t t, const Offer& offer) const {
    if (tracks_[t].closed && chain.points.size() * tracks_[t].points.size() > kMostPairs) return;
    for (std::size_t i = 1; i < chain.points.size(); ++i) offer_joints(chain.points[i].position, i, t, offer);
  }

  bool join(Track& chain, const Joint& joint) {
    Track& next = tracks_[joint.track];
    const TrackPoint end = chain.points[joint.from], start = next.points[joint.to];
    const Vec3 heading = start.position - end.position;
    Walk walk;
    if (heading.norm() > 1e-6) {
      walk = walk_straight(distance_, {triangle_ahead(end, heading), end.position}, heading, heading.norm());
      if ((walk.end.position - start.position).norm() > kMiss || !on_surface(end.position, walk)) return false;
    }
    const Track step = step_of(end, walk, start);
    if (!walk.points.empty() && !heights_hold(step, walk)) return false;
    if (chain.closed) start_at(chain, joint.from);
    if (next.closed) {
      start_at(next, joint.to);
    } else if (joint.to != 0) {
      turn_round(next);
    }
    for (const TrackPoint& p : walk.points) mark_irregular(p.triangle);
    chain.points.insert(chain.points.end(), step.points.begin() + 1, step.points.end());
    chain.points.insert(chain.points.end(), next.points.begin() + 1, next.points.end());
    chain.closed = false;
    if (next.kind == PathKind::contour) chain.kind = PathKind::contour;
    used_[joint.track] = 1;
    return true;
  }

  Track step_of(const TrackPoint& end, const Walk& walk, const TrackPoint& start) const {
    Track step{.points = {end}};
    for (std::size_t i = 0; i + 1 < walk.points.size(); ++i) step.points.push_back(walk.points[i]);
    step.points.push_back(start);
    step.points.back().triangle = walk.points.empty() ? end.triangle : walk.end.triangle;
    thin_track(distance_.mesh(), irregular_, step);
    for (TrackPoint& p : step.points) p.step = true;
    step.points.front().step = end.step;
    return step;
  }

  // Along an edge of the mesh a step may be counted to the wrong side of it: its beads' heights are compared with the
  // triangles that really lie under places of each.
  [[nodiscard]] bool heights_hold(const Track& step, const Walk& walk) const {
    for (std::size_t i = 1; i < step.points.size(); ++i) {
      const Vec3 &from = step.points[i - 1].position, along = step.points[i].position - from;
      const int places = std::max(1, static_cast<int>(std::ceil(along.norm() / kPlaces)));
      double low = 1e300, high = 0.0;
      for (int k = 0; k < places; ++k) {
        const double thickness = thickness_under(from + (k + 0.5) / places * along, walk);
        low = std::min(low, thickness), high = std::max(high, thickness);
      }
      const double own = step.points[i].thickness;
      if (own < low * (1.0 - kUneven) || own > high * (1.0 + kUneven)) return false;
    }
    return true;
  }

  // Of the triangle of a walk, or beside it, that is nearest.
  [[nodiscard]] double thickness_under(const Vec3& place, const Walk& walk) const {
    NearestTriangle nearest;
    for (const TrackPoint& p : walk.points) offer_around(p.triangle, place, nearest);
    return distance_.mesh().thickness[nearest.triangle];
  }

  // A point often lies on an edge: of its triangle and the three beside it, the one that the step enters.
  [[nodiscard]] Index triangle_ahead(const TrackPoint& from, const Vec3& heading) const {
    NearestTriangle nearest;
    offer_around(from.triangle, from.position + heading * std::min(0.5, 0.05 / heading.norm()), nearest);
    return nearest.triangle;
  }

  struct NearestTriangle {
    Index triangle = kNone;
    double distance = 1e300;
  };
  // The triangle and the three beside it.
  void offer_around(Index triangle, const Vec3& place, NearestTriangle& nearest) const {
    const auto offer = [&](Index t) {
      const double distance = distance_to(t, place);
      if (distance < nearest.distance) nearest = {t, distance};
    };
    offer(triangle);
    for (const Index across : distance_.mesh().neighbours[triangle]) {
      if (across != kNone) offer(across);
    }
  }
  [[nodiscard]] double distance_to(Index triangle, const Vec3& place) const {
    const PieceMesh& mesh = distance_.mesh();
    const auto& [a, b, c] = mesh.triangles[triangle];
    return (closest_point_on_triangle(place, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - place).norm();
  }

  [[nodiscard]] bool on_surface(Vec3 from, const Walk& walk) const {
    for (const TrackPoint& p : walk.points) {
      if (distance_to(p.triangle, 0.5 * (from + p.position)) > kOff || distance_to(p.triangle, p.position) > kOff) return false;
      from = p.position;
    }
    return true;
  }

  void mark_irregular(Index triangle) {
    irregular_[triangle] = 1;
    for (const Index across : distance_.mesh().neighbours[triangle]) {
      if (across != kNone) irregular_[across] = 1;
    }
  }

  const BorderDistance& distance_;
  double reach_;
  std::vector<Track>& tracks_;
  std::vector<char>& irregular_;
  std::vector<char> used_;
  std::vector<Box> boxes_;
};

}  // namespace

void chain_tracks(const BorderDistance& distance, double reach, std::vector<Track>& tracks, std::vector<char>& irregular) {
  Chainer(distance, reach, tracks, irregular).run();
}

}  // namespace curvesup::toolpath
