#include "toolpath/share_area.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kLarge = 0.75;          // widths: edges of triangles whose corners are not trusted
constexpr double kFar = 1e6;              // mm
constexpr double kIrregularRise = 1.3;   // widths below the medial line
constexpr double kSmallPiece = 16.0;     // squared widths: irregular as a whole
constexpr double kStretch = 1.5;         // widths
constexpr double kShortest = 0.75;       // widths
constexpr double kReach = 0.8;           // widths: no place is farther from the track that it belongs to
constexpr Index kAdjoining = 4;          // segments along a track
constexpr double kCell = 2.0;            // widths: of places that share a list of segments
constexpr double kFlagCell = 0.6;        // widths: of places near a stretch
constexpr double kSameSide = 0.5;       // cosine between the normals of a place and of a track that may fill it

struct Segment {
  Vec3 from, along;  // along: to the other end
  Vec3 normal;
  double squared_length = 0.0;
  Index stretch = kNone;  // kNone where the width is regular
  Index track = kNone;

  [[nodiscard]] double squared_distance(const Vec3& place) const {
    const Vec3 out = place - from;
    const double part = squared_length > 0.0 ? std::clamp(out.dot(along) / squared_length, 0.0, 1.0) : 0.0;
    return (out - part * along).squaredNorm();
  }
};

using Point = Eigen::Vector3f;

// What a search reads of four segments, packed.
struct Pack {
  using Four = Eigen::Array4f;
  std::array<Four, 3> from, along;
  Four inverse_squared_length;

  void set(int lane, const Segment& s) {
    for (int i = 0; i < 3; ++i) {
      from[i][lane] = static_cast<float>(s.from[i]);
      along[i][lane] = static_cast<float>(s.along[i]);
    }
    inverse_squared_length[lane] = s.squared_length > 0.0 ? static_cast<float>(1.0 / s.squared_length) : 0.0F;
  }
  [[nodiscard]] Four squared_distance(const Point& place) const {
    const Four x = place.x() - from[0], y = place.y() - from[1], z = place.z() - from[2];
    const Four part = ((x * along[0] + y * along[1] + z * along[2]) * inverse_squared_length).max(0.0F).min(1.0F);
    const Four dx = x - part * along[0], dy = y - part * along[1], dz = z - part * along[2];
    return dx * dx + dy * dy + dz * dz;
  }
};
constexpr int kLanes = 4;

// Segments that may be nearest to a place, four by four; the last ones may be doubles of the first.
struct Candidates {
  std::span<const Pack> packs;
  std::span<const Index> segments;
};

struct Stretch {
  double length = 0.0, area = 0.0;
};

// The segments that may be nearest to a place, by the cells of a cubic grid; each cell's list is made when first asked for.
class NearSegments {
 public:
  NearSegments(const std::vector<Segment>& segments, double width)
      : segments_(segments), cell_(kCell * width), flag_cell_(kFlagCell * width), reach_(kReach * width),
        search_(reach_ + 0.5 * std::sqrt(3.0) * cell_) {
    std::size_t size = 256;
    while (size < segments.size()) size *= 2;
    coarse_.assign(size + 1, 0);
    const auto for_segment_cells = [&](const auto& visit) {
      for (std::size_t s = 0; s < segments.size(); ++s) {
        const Vec3 a = segments[s].from, b = a + segments[s].along;
        for_cells(a.cwiseMin(b), a.cwiseMax(b), search_, [&](std::uint64_t key) { visit(static_cast<Index>(s), key); });
      }
    };
    for_segment_cells([&](Index, std::uint64_t key) { ++coarse_[slot(key, size) + 1]; });
    for (std::size_t i = 0; i < size; ++i) coarse_[i + 1] += coarse_[i];
    entries_.resize(coarse_[size]);
    std::vector<Index> fill(coarse_.begin(), coarse_.end() - 1);
    for_segment_cells([&](Index s, std::uint64_t key) { entries_[fill[slot(key, size)]++] = {key, s}; });
    fine_.assign(2 * size, kNone);
    flag_irregular_cells();
  }

  // False only where every place of the box is farther than the reach from any segment of a stretch.
  [[nodiscard]] bool near_stretch(const Vec3& low, const Vec3& high) const {
    bool found = false;
    for_cells(low, high, flag_cell_, [&](std::uint64_t key) { found = found || irregular_[slot(key, irregular_.size())]; });
    return found;
  }

  Candidates around(const Vec3& place) {
    const std::uint64_t key = key_of(index(place.x(), cell_), index(place.y(), cell_), index(place.z(), cell_));
    if (key == last_key_) return list(last_);
    last_key_ = key;
    last_ = fine_[slot(key, fine_.size())];
    while (last_ != kNone && cells_[last_].key != key) last_ = cells_[last_].next;
    if (last_ == kNone) last_ = add_cell(key, place);
    return list(last_);
  }

 private:
  struct Entry {
    std::uint64_t key;
    Index segment;
  };
  struct Cell {
    std::uint64_t key;
    Index first, count, next;  // packs
  };
  static std::uint64_t index(double x, double cell) {
    constexpr double kOrigin = 1 << 20;
    return static_cast<std::uint64_t>(x / cell + kOrigin);
  }
  static std::uint64_t key_of(std::uint64_t x, std::uint64_t y, std::uint64_t z) { return (x << 42) | (y << 21) | z; }
  static std::size_t slot(std::uint64_t key, std::size_t size) { return ((key ^ key >> 32) * 0x9e3779b97f4a7c15ULL >> 32) & (size - 1); }
  template <class Visit>
  static void for_cells(const Vec3& low, const Vec3& high, double cell, const Visit& visit) {
    const std::uint64_t last_x = index(high.x(), cell), last_y = index(high.y(), cell), last_z = index(high.z(), cell);
    for (std::uint64_t x = index(low.x(), cell); x <= last_x; ++x) {
      for (std::uint64_t y = index(low.y(), cell); y <= last_y; ++y) {
        for (std::uint64_t z = index(low.z(), cell); z <= last_z; ++z) visit(key_of(x, y, z));
      }
    }
  }
  [[nodiscard]] Candidates list(Index cell) const {
    const std::size_t first = cells_[cell].first, count = cells_[cell].count;
    return {{packs_.data() + first, count}, {listed_.data() + kLanes * first, kLanes * count}};
  }

  // One flag for all cells of one slot: a few places more are sampled than need be.
  void flag_irregular_cells() {
    irregular_.assign(2 * fine_.size(), 0);
    const Vec3 margin = Vec3::Constant(0.75 * reach_);
    for (const Segment& s : segments_) {
      if (s.stretch == kNone) continue;
      const Vec3 end = s.from + s.along;
      for_cells(s.from.cwiseMin(end) - margin, s.from.cwiseMax(end) + margin, flag_cell_,
                [&](std::uint64_t key) { irregular_[slot(key, irregular_.size())] = 1; });
    }
  }

  Index add_cell(std::uint64_t key, const Vec3& place) {
    const auto middle = [&](double x) { return (std::floor(x / cell_) + 0.5) * cell_; };
    const Vec3 centre(middle(place.x()), middle(place.y()), middle(place.z()));
    const double diagonal = std::sqrt(3.0) * cell_;
    found_.clear();
    double least = search_, limit = (least + diagonal) * (least + diagonal);
    for_cells(centre - Vec3::Constant(search_), centre + Vec3::Constant(search_), search_, [&](std::uint64_t coarse) {
      const std::size_t slot_of = slot(coarse, coarse_.size() - 1);
      for (Index e = coarse_[slot_of]; e < coarse_[slot_of + 1]; ++e) {
        if (entries_[e].key != coarse) continue;
        const double squared = segments_[entries_[e].segment].squared_distance(centre);
        if (squared > limit) continue;
        if (squared < least * least) least = std::sqrt(squared), limit = (least + diagonal) * (least + diagonal);
        found_.push_back({entries_[e].segment, squared});
      }
    });
    const Index first = static_cast<Index>(packs_.size());
    const std::size_t begin = listed_.size();
    for (const auto& [segment, squared] : found_) {
      if (squared <= limit) listed_.push_back(segment);
    }
    while (listed_.size() % kLanes != 0) listed_.push_back(listed_[begin]);
    packs_.resize(listed_.size() / kLanes);
    for (std::size_t i = begin; i < listed_.size(); ++i) packs_[i / kLanes].set(i % kLanes, segments_[listed_[i]]);
    Index& head = fine_[slot(key, fine_.size())];
    cells_.push_back({key, first, static_cast<Index>(packs_.size()) - first, head});
    head = static_cast<Index>(cells_.size()) - 1;
    return head;
  }

  const std::vector<Segment>& segments_;
  double cell_, flag_cell_, reach_, search_;
  std::vector<Index> coarse_, fine_;
  std::vector<Pack> packs_;
  std::vector<Index> listed_;  // the segments of the packs
  std::vector<Entry> entries_;
  std::vector<Cell> cells_;
  std::vector<char> irregular_;
  std::vector<std::pair<Index, double>> found_;  // segments and squared distances
  std::uint64_t last_key_ = ~0ULL;
  Index last_ = kNone;
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

class AreaShares {
 public:
  AreaShares(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks)
      : mesh_(mesh), irregular_(irregular), beads_(beads), tracks_(tracks), limit_(kLarge * beads.width) {}

  void run() {
    cut_into_stretches();
    if (stretches_.empty()) return;
    hand_out();
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
          stretches_.push_back({});
          if (first == kNone) first = static_cast<Index>(stretches_.size()) - 1;
        }
        if (irregular) stretches_.back().length += along.norm();
        segments_.push_back({from.position, along, (from.normal + to.normal).normalized(), along.squaredNorm(),
                             irregular ? static_cast<Index>(stretches_.size()) - 1 : kNone, id});
      }
      end_run(first);
    }
  }

  // A short last stretch of a run joins the one before it: what lies around its end would be too much for it.
  void end_run(Index first) {
    const Index last = static_cast<Index>(stretches_.size()) - 1;
    if (first == kNone || last == first || stretches_[last].length >= kShortest * beads_.width) return;
    for (std::size_t s = segments_.size(); s-- > 0 && segments_[s].stretch == last;) segments_[s].stretch = last - 1;
    stretches_[last - 1].length += stretches_[last].length;
    stretches_.pop_back();
  }

  struct Corner {
    Vec3 place, normal;
    Index owner;  // the nearest segment
  };
  using Triangle = std::array<Corner, 3>;

  void hand_out() {
    NearSegments near(segments_, beads_.width);
    constexpr Index kUnknown = -2;
    std::vector<Index> owner(mesh_.vertices.size(), kUnknown);
    for (const auto& corners : mesh_.triangles) {
      const Vec3 &a = mesh_.vertices[corners[0]], &b = mesh_.vertices[corners[1]], &c = mesh_.vertices[corners[2]];
      if (!near.near_stretch(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c))) continue;
      Triangle triangle;
      for (int i = 0; i < 3; ++i) {
        const Index v = corners[i];
        triangle[i] = {mesh_.vertices[v], mesh_.normals[v], owner[v]};
        if (owner[v] == kUnknown) triangle[i].owner = owner[v] = owner_of(near, mesh_.vertices[v], mesh_.normals[v]);
      }
      hand_out(near, triangle, triangle_area(a, b, c));
    }
  }

  // To whom a triangle belongs is told by its corners: to one track, to two with the straight line between them, or to
  // three. A triangle too large to trust its corners is halved.
  void hand_out(NearSegments& near, const Triangle& triangle, double area) {
    int longest = 0;
    double squared = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double s = (triangle[next3(i)].place - triangle[i].place).squaredNorm();
      if (s > squared) squared = s, longest = i;
    }
    if (squared > limit_ * limit_) {
      const Corner &a = triangle[longest], &b = triangle[next3(longest)];
      Corner middle{0.5 * (a.place + b.place), (a.normal + b.normal).normalized(), kNone};
      middle.owner = owner_of(near, middle.place, middle.normal);
      Triangle left = triangle, right = triangle;
      left[next3(longest)] = right[longest] = middle;
      hand_out(near, left, 0.5 * area);
      hand_out(near, right, 0.5 * area);
      return;
    }
    const std::array<double, 3> parts = parts_of(triangle);
    for (int i = 0; i < 3; ++i) give(triangle[i].owner, parts[i] * area);
  }

  // The parts of a triangle that belong to the owners of its corners.
  [[nodiscard]] std::array<double, 3> parts_of(const Triangle& triangle) const {
    int lone = 0;  // the corner that may belong to another track than the two others
    while (lone < 3 && !adjoin(triangle[next3(lone)].owner, triangle[prev3(lone)].owner)) ++lone;
    if (lone == 3) {
      std::array<std::array<double, 3>, 3> distance;
      for (int i = 0; i < 3; ++i) distance[i] = distances_from(triangle[i].owner, triangle);
      return least_parts(distance);
    }
    const Index here = triangle[lone].owner, there = triangle[next3(lone)].owner;
    double own = 1.0 / 3.0;
    if (!adjoin(here, there) && here != kNone && there != kNone) {
      const std::array<double, 3> from_here = distances_from(here, triangle), from_there = distances_from(there, triangle);
      own = positive_part({from_there[0] - from_here[0], from_there[1] - from_here[1], from_there[2] - from_here[2]});
    }
    std::array<double, 3> parts;
    parts.fill(0.5 * (1.0 - own));
    parts[lone] = own;
    return parts;
  }

  // The distances of the corners from a track.
  [[nodiscard]] std::array<double, 3> distances_from(Index segment, const Triangle& triangle) const {
    if (segment == kNone) return {kFar, kFar, kFar};
    return {distance_from(triangle[0].place, segment), distance_from(triangle[1].place, segment), distance_from(triangle[2].place, segment)};
  }

  [[nodiscard]] bool adjoin(Index a, Index b) const {
    if (a == b) return true;
    return a != kNone && b != kNone && std::abs(a - b) <= kAdjoining && segments_[a].track == segments_[b].track;
  }

  // The distance of a place from a track, found downhill from one of its segments.
  [[nodiscard]] double distance_from(const Vec3& place, Index segment) const {
    double least = segments_[segment].squared_distance(place);
    for (const Index step : {-1, 1}) {
      for (Index s = segment + step; adjoin(s >= 0 && s < static_cast<Index>(segments_.size()) ? s : kNone, segment); s += step) {
        const double squared = segments_[s].squared_distance(place);
        if (squared > least) break;
        least = squared;
      }
    }
    return std::sqrt(least);
  }

  void give(Index segment, double area) {
    if (segment != kNone && segments_[segment].stretch != kNone) stretches_[segments_[segment].stretch].area += area;
  }

  // The segment nearest to a place, of those whose surface faces the same way.
  [[nodiscard]] Index owner_of(NearSegments& near, const Vec3& place, const Vec3& normal) {
    const Candidates candidates = near.around(place);
    const Point at = place.cast<float>();
    squared_.resize(candidates.packs.size());
    Pack::Four least = Pack::Four::Constant(std::numeric_limits<float>::max());
    for (std::size_t i = 0; i < squared_.size(); ++i) {
      squared_[i] = candidates.packs[i].squared_distance(at);
      least = least.min(squared_[i]);
    }
    const Index nearest = nearest_of(candidates, normal, least.minCoeff());
    return nearest != kNone ? nearest : nearest_of(candidates, normal, std::numeric_limits<float>::max());
  }

  // Of the segments not farther than the limit the nearest one; of equal ones the first.
  [[nodiscard]] Index nearest_of(const Candidates& candidates, const Vec3& normal, float limit) const {
    Index best = kNone;
    for (std::size_t i = 0; i < squared_.size(); ++i) {
      if (!(squared_[i] <= limit).any()) continue;
      for (int lane = 0; lane < kLanes; ++lane) {
        const Index segment = candidates.segments[kLanes * i + lane];
        const float squared = squared_[i][lane];
        if (squared > limit || (squared == limit && best != kNone && segment > best)) continue;
        if (segments_[segment].normal.dot(normal) < kSameSide) continue;
        limit = squared, best = segment;
      }
    }
    return best;
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
        const Stretch* stretch = segments_[s].stretch == kNone ? nullptr : &stretches_[segments_[s].stretch];
        if (stretch != nullptr && stretch->length > 0.0) width = stretch->area / stretch->length;
        const double step = std::sqrt(segments_[s].squared_length);
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
  double limit_;  // of edges
  std::vector<Segment> segments_;  // of all tracks, in their order
  std::vector<Stretch> stretches_;
  std::vector<char> idle_;  // by track
  std::vector<Pack::Four> squared_;  // distances of a place from its candidates
};

}  // namespace

std::vector<char> irregular_triangles(const PieceMesh& mesh, const Ridge& ridge, const BeadWidths& beads) {
  const bool small = mesh.area < kSmallPiece * beads.width * beads.width;
  std::vector<char> irregular(mesh.triangles.size(), small);
  for (std::size_t t = 0; t < irregular.size(); ++t) {
    for (const Index v : mesh.triangles[t]) irregular[t] |= ridge.rise(v) <= kIrregularRise * beads.width;
  }
  return irregular;
}

void share_area(const PieceMesh& mesh, const std::vector<char>& irregular, const BeadWidths& beads, std::vector<Track>& tracks) {
  AreaShares(mesh, irregular, beads, tracks).run();
}

}  // namespace curvesup::toolpath
