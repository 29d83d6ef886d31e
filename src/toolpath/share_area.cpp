#include "toolpath/share_area.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/nearest_segment.h"

namespace curvesup::toolpath {
namespace {

constexpr double kLarge = 0.75;          // widths: edges of triangles whose corners are not trusted
constexpr double kSliver = 0.125;         // squared widths: areas too small for their corners to matter
constexpr double kFar = 1e6;              // mm
constexpr double kIrregularRise = 1.3;   // widths below the medial line
constexpr double kStretch = 1.5;         // widths
constexpr double kShortest = 0.75;       // widths
constexpr double kReach = 0.6;           // widths: most places are not farther from the track that they belong to ...
constexpr double kFarthest = 2.4;        // ... and none is farther
constexpr double kMargin = 1.0;          // widths around a step that are looked at
constexpr Index kAdjoining = 4;          // segments along a track
constexpr double kFlagCell = 0.6;        // widths: of places near a step

struct Stretch {
  double length = 0.0, area = 0.0;
  bool goes_on = false;  // from the stretch before
};

// Where steps pass near.
class StepFlags {
 public:
  StepFlags(double width, std::size_t slots) : cells_(kFlagCell * width, slots), margin_(Vec3::Constant(kMargin * width)), flag_(slots, 0) {}

  void mark(const Segment& s) {
    const Vec3 end = s.from + s.along;
    cells_.for_box(s.from.cwiseMin(end) - margin_, s.from.cwiseMax(end) + margin_, [&](std::size_t slot) { flag_[slot] = 1; });
    any_ = true;
  }
  // False only where no step is near the box.
  [[nodiscard]] bool near(const Vec3& low, const Vec3& high) const {
    bool found = false;
    if (any_) cells_.for_box(low, high, [&](std::size_t slot) { found = found || flag_[slot]; });
    return found;
  }

 private:
  CellSlots cells_;
  Vec3 margin_;
  std::vector<char> flag_;
  bool any_ = false;
};

// The part of a triangle's area where the function that is linear between the values at its corners is positive.
double positive_part(const std::array<double, 3>& value) {
  const int above = (value[0] > 0.0) + (value[1] > 0.0) + (value[2] > 0.0);
  if (above == 0 || above == 3) return above / 3;
  int lone = 0;  // the corner on the other side than the two others
  while ((value[lone] > 0.0) != (above == 1)) ++lone;
  const double here = value[lone];
  const double part = here / (here - value[next3(lone)]) * (here / (here - value[prev3(lone)]));
  return above == 1 ? part : 1.0 - part;
}

// The parts of a triangle where each of three functions, linear between their values at the corners, is the least: counted on
// the 16 like triangles that it is made of.
std::array<double, 3> least_parts(const std::array<std::array<double, 3>, 3>& value) {
  constexpr int kRows = 4;
  std::array<double, 3> part{};
  const auto count = [&](double x, double y) {
    std::array<double, 3> here;
    for (int f = 0; f < 3; ++f) here[f] = value[f][0] + x * (value[f][1] - value[f][0]) + y * (value[f][2] - value[f][0]);
    part[std::min_element(here.begin(), here.end()) - here.begin()] += 1.0 / (kRows * kRows);
  };
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; i + j < kRows; ++j) {
      count((i + 1.0 / 3.0) / kRows, (j + 1.0 / 3.0) / kRows);
      if (i + j + 1 < kRows) count((i + 2.0 / 3.0) / kRows, (j + 2.0 / 3.0) / kRows);
    }
  }
  return part;
}

// The corner at which the longest edge of a triangle starts, and its squared length.
std::pair<int, double> longest_edge(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
  if (ab >= bc && ab >= ca) return {0, ab};
  return bc >= ca ? std::pair{1, bc} : std::pair{2, ca};
}

class AreaShares {
 public:
  AreaShares(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks)
      : mesh_(mesh), irregular_(irregular), beads_(beads), tracks_(tracks) {}

  void run() {
    cut_into_stretches();
    if (stretches_.empty()) return;
    hand_out();
    pass_on_excess();
    set_widths();
    drop_idle_tracks();
  }

 private:
  void cut_into_stretches() {
    for (Index id = 0; id < static_cast<Index>(tracks_.size()); ++id) {
      const Track& track = tracks_[id];
      Index first = kNone;  // of the run of stretches that goes on
      for (std::size_t i = 1; i < track.points.size(); ++i) {
        const TrackPoint &from = track.points[i - 1], &to = track.points[i];
        const Vec3 along = to.position - from.position;
        const bool irregular = track.kind != PathKind::contour || to.step || irregular_[to.triangle];
        if (!irregular) {
          end_run(first);
          first = kNone;
        } else if (first == kNone || stretches_.back().length >= kStretch * beads_.width) {
          stretches_.push_back({.goes_on = first != kNone});
          if (first == kNone) first = static_cast<Index>(stretches_.size()) - 1;
        }
        if (irregular) stretches_.back().length += along.norm();
        segments_.emplace_back(from.position, along, (from.normal + to.normal).normalized());
        stretch_.push_back(irregular ? static_cast<Index>(stretches_.size()) - 1 : kNone);
        track_.push_back(id);
      }
      end_run(first);
    }
  }

  // A short last stretch of a run joins the one before it: what lies around its end would be too much for it.
  void end_run(Index first) {
    const Index last = static_cast<Index>(stretches_.size()) - 1;
    if (first == kNone || last == first || stretches_[last].length >= kShortest * beads_.width) return;
    for (std::size_t s = segments_.size(); s-- > 0 && stretch_[s] == last;) stretch_[s] = last - 1;
    stretches_[last - 1].length += stretches_[last].length;
    stretches_.pop_back();
  }

  // The middle between a place and one of a higher number.
  struct Cut {
    Index to, middle;
    Index next;  // cut from the same place
  };
  // A part of a triangle, small enough to trust its corners.
  struct Part {
    std::array<Index, 3> corners;  // places
    double area;
  };

  void hand_out() {
    cut_into_parts();
    find_owners();
    for (const Part& part : parts_) {
      const std::array<double, 3> shares = shares_of(part.corners);
      for (int i = 0; i < 3; ++i) give(owner_[part.corners[i]], shares[i] * part.area);
    }
  }

  // Most places have a track close by; the others are looked for again, farther out.
  void find_owners() {
    owner_ = nearest_segments(places_, segments_, kReach * beads_.width);
    std::vector<Index> lonely;
    std::vector<Place> there;
    for (double reach = 2.0 * kReach; reach <= kFarthest; reach *= 2.0) {
      lonely.clear();
      there.clear();
      for (std::size_t p = 0; p < places_.size(); ++p) {
        if (owner_[p] != kNone) continue;
        lonely.push_back(static_cast<Index>(p));
        there.push_back(places_[p]);
      }
      if (lonely.empty()) return;
      const std::vector<Index> nearest = nearest_segments(there, segments_, reach * beads_.width);
      for (std::size_t i = 0; i < lonely.size(); ++i) owner_[lonely[i]] = nearest[i];
    }
  }

  void cut_into_parts() {
    const StepFlags steps = flag_steps();
    const std::vector<char> near = near_irregular();
    std::vector<Index> place_of(mesh_.vertices.size(), kNone);
    for (const auto& corners : mesh_.triangles) {
      const Vec3 &a = mesh_.vertices[corners[0]], &b = mesh_.vertices[corners[1]], &c = mesh_.vertices[corners[2]];
      if (!near[corners[0]] && !near[corners[1]] && !near[corners[2]] &&
          !steps.near(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c))) {
        continue;
      }
      Part part{corners, triangle_area(a, b, c)};
      for (Index& v : part.corners) {
        Index& place = place_of[v];
        if (place == kNone) place = add_place(mesh_.vertices[v], mesh_.normals[v]);
        v = place;
      }
      cut(part);
    }
  }

  [[nodiscard]] StepFlags flag_steps() const {
    constexpr std::size_t kSlotsEach = 256;
    std::vector<Index> steps;
    Index s = 0;
    for (const Track& track : tracks_) {
      for (std::size_t i = 1; i < track.points.size(); ++i, ++s) {
        if (track.points[i].step) steps.push_back(s);
      }
    }
    StepFlags flags(beads_.width, std::bit_ceil(kSlotsEach * std::max<std::size_t>(steps.size(), 1)));
    for (const Index step : steps) flags.mark(segments_[step]);
    return flags;
  }

  // The vertices that are no farther from an irregular triangle, along edges, than a bead reaches.
  [[nodiscard]] std::vector<char> near_irregular() const {
    constexpr int kRounds = 2;
    const double reach = kReach * beads_.width;
    std::vector<double> distance(mesh_.vertices.size(), kFar);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!irregular_[t]) continue;
      for (const Index v : mesh_.triangles[t]) distance[v] = 0.0;
    }
    const auto hand_on = [&](Index from, Index to) {
      if (distance[from] >= reach || distance[to] == 0.0) return false;
      const double there = distance[from] + (mesh_.vertices[to] - mesh_.vertices[from]).norm();
      if (there >= distance[to]) return false;
      distance[to] = there;
      return true;
    };
    bool changed = true;
    for (int round = 0; round < kRounds && changed; ++round) {
      changed = false;
      for (const auto& t : mesh_.triangles) {
        for (int i = 0; i < 3; ++i) changed |= hand_on(t[i], t[next3(i)]) | hand_on(t[next3(i)], t[i]);
      }
    }
    std::vector<char> near(distance.size());
    for (std::size_t v = 0; v < near.size(); ++v) near[v] = distance[v] <= reach;
    return near;
  }

  Index add_place(const Vec3& position, const Vec3& normal) {
    places_.push_back({position, normal});
    return static_cast<Index>(places_.size()) - 1;
  }

  // The place in the middle between two, the same one for the triangles on both sides.
  Index middle_of(Index a, Index b) {
    if (a > b) std::swap(a, b);
    if (static_cast<std::size_t>(a) >= first_cut_.size()) first_cut_.resize(places_.size(), kNone);
    for (Index k = first_cut_[a]; k != kNone; k = cuts_[k].next) {
      if (cuts_[k].to == b) return cuts_[k].middle;
    }
    const Index middle = add_place(0.5 * (places_[a].position + places_[b].position), 0.5 * (places_[a].normal + places_[b].normal));
    cuts_.push_back({b, middle, first_cut_[a]});
    first_cut_[a] = static_cast<Index>(cuts_.size()) - 1;
    return middle;
  }

  // Halves what is too large across its longest edge.
  void cut(const Part& part) {
    const auto position = [&](int i) -> const Vec3& { return places_[part.corners[i]].position; };
    const auto [longest, squared] = longest_edge(position(0), position(1), position(2));
    const double bead = beads_.width * beads_.width;
    if (squared <= kLarge * kLarge * bead || part.area <= kSliver * bead) {
      parts_.push_back(part);
      return;
    }
    Part left = part, right = part;
    left.area = right.area = 0.5 * part.area;
    left.corners[next3(longest)] = right.corners[longest] = middle_of(part.corners[longest], part.corners[next3(longest)]);
    cut(left);
    cut(right);
  }

  // To whom a triangle belongs is told by its corners: to one track, to two with the straight line between them, or to
  // three. Its parts that belong to the owners of its corners.
  [[nodiscard]] std::array<double, 3> shares_of(const std::array<Index, 3>& corners) const {
    constexpr double kThird = 1.0 / 3.0;
    const std::array<Index, 3> owner = {owner_[corners[0]], owner_[corners[1]], owner_[corners[2]]};
    int lone = 0;  // the corner that may belong to another track than the two others
    while (lone < 3 && !adjoin(owner[next3(lone)], owner[prev3(lone)])) ++lone;
    const auto distances_from = [&](Index segment) -> std::array<double, 3> {
      if (segment == kNone) return {kFar, kFar, kFar};
      std::array<double, 3> distances;
      for (int i = 0; i < 3; ++i) distances[i] = distance_from(places_[corners[i]].position, segment);
      return distances;
    };
    if (lone == 3) return least_parts({distances_from(owner[0]), distances_from(owner[1]), distances_from(owner[2])});
    const Index here = owner[lone], there = owner[next3(lone)];
    if (here == kNone || there == kNone || adjoin(here, there)) return {kThird, kThird, kThird};
    const std::array<double, 3> from_here = distances_from(here), from_there = distances_from(there);
    const double own = positive_part({from_there[0] - from_here[0], from_there[1] - from_here[1], from_there[2] - from_here[2]});
    std::array<double, 3> shares;
    shares.fill(0.5 * (1.0 - own));
    shares[lone] = own;
    return shares;
  }

  [[nodiscard]] bool adjoin(Index a, Index b) const {
    if (a == b) return true;
    return a != kNone && b != kNone && std::abs(a - b) <= kAdjoining && track_[a] == track_[b];
  }

  // The distance of a place from a track, found downhill from one of its segments.
  [[nodiscard]] double distance_from(const Vec3& place, Index segment) const {
    const double part = segments_[segment].part(place);
    double least = segments_[segment].squared_distance(place, part);
    if (part > 0.0 && part < 1.0) return std::sqrt(least);
    const Index step = part > 0.0 ? 1 : -1;
    for (Index s = segment + step; s >= 0 && s < static_cast<Index>(segments_.size()) && adjoin(s, segment); s += step) {
      const double squared = segments_[s].squared_distance(place);
      if (squared > least) break;
      least = squared;
    }
    return std::sqrt(least);
  }

  void give(Index segment, double area) {
    if (segment != kNone && stretch_[segment] != kNone) stretches_[stretch_[segment]].area += area;
  }

  // What is too much for a stretch goes to those beside it on its track, as far as they have room: shares of stretches that
  // follow each other are rough.
  void pass_on_excess() {
    const auto room = [&](const Stretch& s) { return beads_.max * s.length - s.area; };
    const auto pass_on = [&](Stretch& from, Stretch& to) {
      const double area = std::clamp(-room(from), 0.0, std::max(0.0, room(to)));
      from.area -= area;
      to.area += area;
    };
    for (std::size_t s = 1; s < stretches_.size(); ++s) {
      if (stretches_[s].goes_on) pass_on(stretches_[s - 1], stretches_[s]);
    }
    for (std::size_t s = stretches_.size(); s-- > 1;) {
      if (stretches_[s].goes_on) pass_on(stretches_[s], stretches_[s - 1]);
    }
  }

  void set_widths() {
    std::size_t s = 0;
    idle_.assign(tracks_.size(), 0);
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      auto& points = tracks_[t].points;
      double owned = 0.0, length = 0.0;
      for (std::size_t i = 1; i < points.size(); ++i, ++s) {
        double& width = points[i].width;
        width = beads_.width;
        const Stretch* stretch = stretch_[s] == kNone ? nullptr : &stretches_[stretch_[s]];
        if (stretch != nullptr && stretch->length > 0.0) width = stretch->area / stretch->length;
        const double step = segments_[s].length;
        owned += width * step;
        length += step;
        width = std::clamp(width, beads_.min, beads_.max);
      }
      if (points.size() > 1) points.front().width = points[1].width;
      idle_[t] = owned < 0.5 * beads_.min * length;
    }
  }

  // A track that little belongs to runs in the beads of others.
  void drop_idle_tracks() {
    if (std::find(idle_.begin(), idle_.end(), 0) == idle_.end()) return;
    std::size_t kept = 0;
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      if (idle_[t]) continue;
      if (kept != t) tracks_[kept] = std::move(tracks_[t]);
      ++kept;
    }
    tracks_.resize(kept);
  }

  const PieceMesh& mesh_;
  const std::vector<char>& irregular_;
  const BeadWidths& beads_;
  std::vector<Track>& tracks_;
  std::vector<Segment> segments_;  // of all tracks, in their order
  std::vector<Index> stretch_, track_;  // of each segment; no stretch where the width is regular
  std::vector<Stretch> stretches_;
  std::vector<char> idle_;  // by track
  std::vector<Place> places_;  // corners of parts
  std::vector<Index> owner_;   // of each place the nearest segment
  std::vector<Part> parts_;
  std::vector<Cut> cuts_;
  std::vector<Index> first_cut_;  // by place
};

}  // namespace

std::vector<char> irregular_triangles(const PieceMesh& mesh, const Ridge& ridge, const BeadWidths& beads) {
  std::vector<char> irregular(mesh.triangles.size(), is_small(mesh, beads.width));
  for (std::size_t t = 0; t < irregular.size(); ++t) {
    for (const Index v : mesh.triangles[t]) irregular[t] |= ridge.rise(v) <= kIrregularRise * beads.width;
  }
  return irregular;
}

void share_area(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks) {
  AreaShares(mesh, irregular, beads, tracks).run();
}

}  // namespace curvesup::toolpath
