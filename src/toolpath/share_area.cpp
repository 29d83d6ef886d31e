#include "toolpath/share_area.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/beads.h"
#include "toolpath/nearest_segment.h"

namespace curvesup::toolpath {
namespace {

constexpr double kSmall = 0.75;          // widths: edges of triangles whose corners always tell who shares them ...
constexpr double kLarge = 1.25;          // ... widths: edges of those whose corners may tell it
constexpr double kStraight = 0.9;        // cosine between segments that run alike
constexpr double kBeside = 1.1;          // widths between two tracks with none between them
constexpr double kFar = 1e6;             // squared mm
constexpr double kIrregularRise = 1.3;   // widths below the medial line
constexpr double kStretch = 1.5;         // widths
constexpr double kShortest = 0.75;       // widths
constexpr double kNear = 0.75;           // widths, from a shared segment to a vertex of each triangle in which something belongs to it
constexpr std::size_t kCellsPerSegment = 16;
constexpr double kAllIrregular = 36.0;   // squared widths: where regular tracks and shared ones meet, some area is left over or taken twice
constexpr double kReach = 0.6;           // widths: most places are not farther from the track that they belong to ...
constexpr double kFarthest = 2.4;        // ... and none is farther
constexpr Index kAdjoining = 4;          // segments along a track
constexpr double kTurnedBack = -0.3;     // cosine between segments

struct Stretch {
  double length = 0.0;
  double face = 0.0;     // length times height of its bead
  double volume = 0.0;   // of what belongs to it
  bool goes_on = false;  // from the stretch before
};

// A function that is linear over a triangle, by its values at the corners.
using Linear = std::array<double, 3>;

// A convex part of a triangle, whose corners are (0, 0), (1, 0) and (0, 1) here.
struct Region {
  struct Spot {
    double x, y;
  };
  std::array<Spot, 6> spots{{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}};
  int count = 3;

  // As a part of the triangle's.
  [[nodiscard]] double area() const {
    double sum = 0.0;
    for (int i = 0, last = count - 1; i < count; last = i++) sum += spots[last].x * spots[i].y - spots[last].y * spots[i].x;
    return sum;
  }
  // What lies where a function is positive.
  [[nodiscard]] Region where(const Linear& value) const {
    Region kept;
    kept.count = 0;
    const auto at = [&](const Spot& s) { return value[0] + s.x * (value[1] - value[0]) + s.y * (value[2] - value[0]); };
    for (int i = 0, last = count - 1; i < count; last = i++) {
      const double before = at(spots[last]), here = at(spots[i]);
      if ((before > 0.0) != (here > 0.0)) {
        const double part = before / (before - here);
        const Spot &from = spots[last], &to = spots[i];
        kept.spots[kept.count++] = {from.x + part * (to.x - from.x), from.y + part * (to.y - from.y)};
      }
      if (here > 0.0) kept.spots[kept.count++] = spots[i];
    }
    return kept;
  }
};

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
    find_idle_ends();
    pass_on_excess();
    set_widths();
    cut_idle_ends();
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
        if (irregular) {
          stretches_.back().length += along.norm();
          stretches_.back().face += along.norm() * to.height;
        }
        start_.push_back(segments_.empty() ? 0.0 : start_.back() + segments_.back().length);
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
    stretches_[last - 1].face += stretches_[last].face;
    stretches_.pop_back();
  }

  // A corner of parts: its place and the segment that the place belongs to.
  struct Corner {
    Place place;
    NearestSegment owner;
    Index first_cut = kNone;
  };
  // The middle between a corner and one of a higher number.
  struct Cut {
    Index to, middle;
    Index next;  // cut from the same corner
  };
  // A triangle, or a part of one.
  struct Part {
    std::array<Index, 3> corners;
    double area;
    Index triangle;  // of the mesh
  };

  // A place on a track.
  struct OnTrack {
    Index segment = kNone;
    double along = 0.0;    // the way to there, from the start of the first track over all of them
    double squared = 0.0;  // distance of what it is nearest to
  };

  void hand_out() {
    grid_.emplace(segments_, kReach * beads_.width);
    const std::vector<char> near = near_shared();
    std::vector<Index> corner_at(mesh_.vertices.size(), kNone);
    Index guess = kNone;
    for (Index t = 0; t < static_cast<Index>(mesh_.triangles.size()); ++t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      if (!near[a] && !near[b] && !near[c]) continue;
      for (const Index v : {a, b, c}) {
        if (corner_at[v] == kNone) corner_at[v] = add_corner({mesh_.vertices[v], mesh_.normals[v]}, guess);
        guess = corners_[corner_at[v]].owner.id;
      }
      hand_out({{corner_at[a], corner_at[b], corner_at[c]}, triangle_area(mesh_.vertices[a], mesh_.vertices[b], mesh_.vertices[c]), t});
    }
  }

  // The vertices so near to shared segments that something in the triangles around may belong to those, and some others.
  [[nodiscard]] std::vector<char> near_shared() const {
    const CellSlots cells(beads_.width, kCellsPerSegment * std::bit_ceil(segments_.size()));
    std::vector<char> marked(cells.size(), 0), near(mesh_.vertices.size(), 0);
    const Vec3 margin = Vec3::Constant(kNear * beads_.width);
    for (Index s = 0; s < static_cast<Index>(segments_.size()); ++s) {
      if (!shared(s)) continue;
      const Vec3 &from = segments_[s].from, to = from + segments_[s].along;
      cells.for_box(from.cwiseMin(to) - margin, from.cwiseMax(to) + margin, [&](std::size_t slot) { marked[slot] = 1; });
    }
    for (std::size_t v = 0; v < near.size(); ++v) {
      const Vec3& place = mesh_.vertices[v];
      cells.for_box(place, place, [&](std::size_t slot) { near[v] = marked[slot]; });
    }
    return near;
  }

  Index add_corner(const Place& place, Index guess) {
    corners_.push_back({place, grid_->nearest(place, kFarthest * beads_.width, guess)});
    return static_cast<Index>(corners_.size()) - 1;
  }

  // The corner in the middle between two, the same one for the triangles on both sides.
  Index middle_of(Index a, Index b) {
    if (a > b) std::swap(a, b);
    for (Index k = corners_[a].first_cut; k != kNone; k = cuts_[k].next) {
      if (cuts_[k].to == b) return cuts_[k].middle;
    }
    const Place &at_a = corners_[a].place, &at_b = corners_[b].place;
    const Index middle = add_corner({0.5 * (at_a.position + at_b.position), 0.5 * (at_a.normal + at_b.normal)}, corners_[a].owner.id);
    cuts_.push_back({b, middle, corners_[a].first_cut});
    corners_[a].first_cut = static_cast<Index>(cuts_.size()) - 1;
    return middle;
  }

  // Halves a part across its longest edge until the owners of its corners tell who shares it.
  void hand_out(const Part& part) {
    const auto position = [&](int i) -> const Vec3& { return corners_[part.corners[i]].place.position; };
    const auto [longest, squared] = longest_edge(position(0), position(1), position(2));
    const double bead = beads_.width * beads_.width;
    const bool small = squared <= kSmall * kSmall * bead;
    if (small || (squared <= kLarge * kLarge * bead && is_plain(part))) {
      share(part);
      return;
    }
    Part left = part, right = part;
    left.area = right.area = 0.5 * part.area;
    left.corners[next3(longest)] = right.corners[longest] = middle_of(part.corners[longest], part.corners[next3(longest)]);
    hand_out(left);
    hand_out(right);
  }

  [[nodiscard]] std::array<Index, 3> owners_of(const Part& part) const {
    return {corners_[part.corners[0]].owner.id, corners_[part.corners[1]].owner.id, corners_[part.corners[2]].owner.id};
  }

  // To whom a part belongs is told by its corners: to one track, to two with the straight line between them, or to three.
  void share(const Part& part) {
    const std::array<Index, 3> owner = owners_of(part);
    if (!shared(owner[0]) && !shared(owner[1]) && !shared(owner[2])) return;
    const double volume = part.area * height_of(part);
    int lone = 0;  // the corner that may belong to another track than the two others
    while (lone < 3 && !adjoin(owner[next3(lone)], owner[prev3(lone)])) ++lone;
    if (lone == 3) return share_by_three(part, volume);
    const Index one = owner[lone], other = owner[next3(lone)];
    if (one == kNone || other == kNone) {
      for (const Index segment : owner) add(segment, volume / 3.0);
      return;
    }
    if (adjoin(one, other)) {
      const bool alike = stretch_[owner[0]] == stretch_[owner[1]] && stretch_[owner[1]] == stretch_[owner[2]];
      return alike ? add(one, volume) : spread(Region{}, nearest_on(part, other), volume);
    }
    // Between two straight tracks the difference of the squared distances from them is linear.
    const std::array<OnTrack, 3> on_one = nearest_on(part, one), on_other = nearest_on(part, other);
    Linear lead, lag;
    for (int i = 0; i < 3; ++i) lead[i] = on_other[i].squared - on_one[i].squared, lag[i] = -lead[i];
    const Region nearer_one = Region{}.where(lead), nearer_other = Region{}.where(lag);
    spread(nearer_one, on_one, volume);
    spread(nearer_other, on_other, volume);
    // Around a corner where a track turns back, both are equally near.
    const double undecided = 1.0 - nearer_one.area() - nearer_other.area();
    for (const Index segment : {on_one[lone].segment, on_other[next3(lone)].segment}) add(segment, 0.5 * undecided * volume);
  }

  void share_by_three(const Part& part, double volume) {
    const std::array<Index, 3> owner = owners_of(part);
    std::array<Linear, 3> squares;
    for (int i = 0; i < 3; ++i) {
      squares[i].fill(kFar);
      if (owner[i] == kNone) continue;
      const std::array<OnTrack, 3> on = nearest_on(part, owner[i]);
      for (int corner = 0; corner < 3; ++corner) squares[i][corner] = on[corner].squared;
    }
    const std::array<double, 3> shares = least_parts(squares);
    for (int i = 0; i < 3; ++i) add(owner[i], shares[i] * volume);
  }

  void add(Index segment, double volume) {
    if (shared(segment)) stretches_[stretch_[segment]].volume += volume;
  }

  // Gives what lies in a region, of a part with so much volume, to the stretches of the track that it lies beside.
  void spread(const Region& region, const std::array<OnTrack, 3>& beside, double volume) {
    const auto [first, last] = std::minmax({beside[0].segment, beside[1].segment, beside[2].segment});
    double before = 0.0;
    for (Index segment = first; segment <= last; ++segment) {
      const Index stretch = stretch_[segment];
      while (segment < last && stretch_[segment + 1] == stretch) ++segment;
      double upto;
      if (segment == last) {
        upto = region.area();
      } else {
        Linear left;
        for (int i = 0; i < 3; ++i) left[i] = start_[segment + 1] - beside[i].along;
        upto = region.where(left).area();
      }
      if (stretch != kNone) stretches_[stretch].volume += (upto - before) * volume;
      before = upto;
    }
  }

  [[nodiscard]] double height_of(const Part& part) const {
    const auto z = [&](int i) { return corners_[part.corners[i]].place.position.z(); };
    return mean_clipped_height(mesh_.thickness[part.triangle], {z(0), z(1), z(2)}, mesh_.rise[part.triangle]);
  }

  // Whether a segment is as wide as its share makes it.
  [[nodiscard]] bool shared(Index segment) const { return segment != kNone && stretch_[segment] != kNone; }

  // Whether segments follow each other on a track that does not turn back in between.
  [[nodiscard]] bool adjoin(Index a, Index b) const {
    if (a == b) return true;
    return a != kNone && b != kNone && std::abs(a - b) <= kAdjoining && track_[a] == track_[b] && cosine(a, b) > kTurnedBack;
  }

  // Whether a part belongs to one straight track, or to two that run beside each other so closely that none passes between.
  // A track that turns from regular to shared within the part is not straight in this sense: where it does is not known.
  [[nodiscard]] bool is_plain(const Part& part) const {
    const auto [a, b, c] = owners_of(part);
    if (a == kNone || b == kNone || c == kNone) return false;
    return are_plain(a, b, c) || are_plain(b, c, a) || are_plain(c, a, b);
  }
  [[nodiscard]] bool are_plain(Index one, Index two, Index other) const {
    if (!run_on(one, two)) return false;
    return adjoin(one, other) ? run_on(one, other) : run_beside(one, other);
  }
  [[nodiscard]] bool run_on(Index a, Index b) const {
    return a == b || (adjoin(a, b) && shared(a) == shared(b) && cosine(a, b) > kStraight);
  }
  [[nodiscard]] bool run_beside(Index a, Index b) const {
    if (std::abs(cosine(a, b)) < kStraight) return false;
    const double reach = kBeside * beads_.width;
    return nearest_on(segments_[b].from + 0.5 * segments_[b].along, a).squared <= reach * reach;
  }
  [[nodiscard]] double cosine(Index a, Index b) const {
    const Segment &x = segments_[a], &y = segments_[b];
    return x.along.dot(y.along) / std::max(x.length * y.length, 1e-12);
  }

  // Where a track is nearest to a place, found downhill from one of its segments.
  [[nodiscard]] OnTrack nearest_on(const Vec3& place, Index segment) const {
    const auto at = [&](Index s) {
      const double part = segments_[s].part(place);
      return std::pair(part, OnTrack{s, start_[s] + part * segments_[s].length, segments_[s].squared_distance(place, part)});
    };
    auto [part, best] = at(segment);
    if (part > 0.0 && part < 1.0) return best;
    const Index step = part > 0.0 ? 1 : -1;
    for (Index s = segment + step; s >= 0 && s < static_cast<Index>(segments_.size()) && adjoin(s, segment); s += step) {
      const OnTrack here = at(s).second;
      if (here.squared > best.squared) break;
      best = here;
    }
    return best;
  }
  // The same for the corners of a part.
  [[nodiscard]] std::array<OnTrack, 3> nearest_on(const Part& part, Index segment) const {
    std::array<OnTrack, 3> on;
    for (int i = 0; i < 3; ++i) {
      const Corner& corner = corners_[part.corners[i]];
      on[i] = nearest_on(corner.place.position, adjoin(corner.owner.id, segment) ? corner.owner.id : segment);
    }
    return on;
  }

  [[nodiscard]] bool is_idle(Index stretch) const {
    return stretch != kNone && stretches_[stretch].volume < 0.5 * beads_.min * stretches_[stretch].face;
  }

  // Ends of open tracks that little belongs to run in ribbons thinner than any bead, or in the beads of others: what does belong to
  // them goes to the stretch that stays.
  void find_idle_ends() {
    std::size_t first = 0;
    busy_.clear();
    for (const Track& track : tracks_) {
      const std::size_t count = track.points.empty() ? 0 : track.points.size() - 1;
      std::size_t begin = 0, end = count;
      if (!track.closed && track.kind != PathKind::infill) {  // around sparse lines the area is nobody's
        while (begin < count && is_idle(stretch_[first + begin])) ++begin;
        while (end > begin && is_idle(stretch_[first + end - 1])) --end;
      }
      if (begin == end) begin = 0, end = count;  // all of it
      for (std::size_t i = 0; i < count; ++i) {
        if (i >= begin && i < end) continue;
        const Index from = stretch_[first + i], to = stretch_[first + (i < begin ? begin : end - 1)];
        if (to == kNone) continue;
        stretches_[to].volume += std::exchange(stretches_[from].volume, 0.0);
      }
      busy_.push_back({begin, end});
      first += count;
    }
  }

  void cut_idle_ends() {
    for (std::size_t t = 0; t < tracks_.size(); ++t) {
      auto& points = tracks_[t].points;
      const auto [begin, end] = busy_[t];
      if (points.empty() || end - begin + 1 == points.size()) continue;
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(end) + 1, points.end());
      points.erase(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(begin));
      points.front().width = points[1].width;
    }
  }

  // What is too much for a stretch goes to those beside it on its track, as far as they have room: shares of stretches that
  // follow each other are rough.
  void pass_on_excess() {
    const auto room = [&](const Stretch& s) { return beads_.max * s.face - s.volume; };
    const auto pass_on = [&](Stretch& from, Stretch& to) {
      const double volume = std::clamp(-room(from), 0.0, std::max(0.0, room(to)));
      from.volume -= volume;
      to.volume += volume;
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
        if (stretch != nullptr && stretch->face > 0.0) width = stretch->volume / stretch->face;
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
  std::vector<double> start_;      // of each: the length of all before it
  std::vector<Index> stretch_, track_;  // of each segment; no stretch where the width is regular
  std::vector<Stretch> stretches_;
  std::vector<std::array<std::size_t, 2>> busy_;  // by track: its segments but for idle ends
  std::vector<char> idle_;                        // by track
  std::optional<SegmentGrid> grid_;
  std::vector<Corner> corners_;
  std::vector<Cut> cuts_;
};

}  // namespace

std::vector<char> irregular_triangles(const PieceMesh& mesh, const Ridge& ridge, const BeadWidths& beads) {
  std::vector<char> irregular(mesh.triangles.size(), mesh.area < kAllIrregular * beads.width * beads.width);
  for (std::size_t t = 0; t < irregular.size(); ++t) {
    for (const Index v : mesh.triangles[t]) irregular[t] |= ridge.rise(v) <= kIrregularRise * beads.width;
  }
  return irregular;
}

void share_area(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks) {
  AreaShares(mesh, irregular, beads, tracks).run();
}

}  // namespace curvesup::toolpath
