#include "toolpath/fill_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/chain.h"
#include "toolpath/link.h"
#include "toolpath/rings.h"
#include "toolpath/share_area.h"
#include "toolpath/zigzag.h"

namespace curvesup::toolpath {
namespace {

constexpr double kLongestStep = 3.0;   // widths, between tracks that are laid without a lift
constexpr double kLongestTurn = 5.0;   // widths, from one line to the next where they end on a slant ...
constexpr double kLongestOpenTurn = 2.0;  // ... or spacings
constexpr double kInset = 0.25;        // widths from the inner edge of the innermost ring to the ends of lines, which hold on to it
constexpr double kShortestLine = 0.75; // widths
constexpr double kFewestLines = 3.0;   // must have room beside each other inside the rings of a piece; less is filled by rings
constexpr double kDepthSlack = 0.02;   // mm
constexpr double kWidestRing = 1.15;   // widths
constexpr double kEnoughRoom = 0.97;   // of a piece, that its beads must be able to fill
constexpr double kStepReach = 0.75;    // widths: beads that near to a step share the area with it
constexpr double kLongestEdge = 2.0;   // widths
constexpr int kPowerRounds = 40;
constexpr double kDotGap = 0.25;       // widths of a dot, from its ends to the border ...
constexpr double kLeastDotGap = 0.02;  // ... lengths, where it would have to be wider than it may be

// The vertex farthest from the border and the triangles around it; of a piece that is all border, the middle of the largest triangle.
std::pair<Vec3, std::vector<Index>> deepest_place(const BorderDistance& distance) {
  const PieceMesh& mesh = distance.mesh();
  Index deepest = 0, largest = 0;
  for (Index v = 0; v < static_cast<Index>(mesh.vertices.size()); ++v) {
    if (distance.distance(v) > distance.distance(deepest)) deepest = v;
  }
  std::vector<Index> around;
  double area = 0.0;
  for (Index t = 0; t < static_cast<Index>(mesh.triangles.size()); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (a == deepest || b == deepest || c == deepest) around.push_back(t);
    const double here = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    if (here > area) area = here, largest = t;
  }
  if (distance.distance(deepest) > 0.0) return {mesh.vertices[deepest], std::move(around)};
  const auto& [a, b, c] = mesh.triangles[largest];
  return {(mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0, {largest}};
}

// The direction in which a piece is longest, seen from a place; as long as the farthest vertex is away.
Vec3 longest_way(const PieceMesh& mesh, const Vec3& centre) {
  Vec3 farthest = Vec3::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const auto& [a, b, c] : mesh.triangles) {
    const double area = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    for (const Index v : {a, b, c}) {
      const Vec3 out = mesh.vertices[v] - centre;
      moment += area * out * out.transpose();
      if (out.squaredNorm() > farthest.squaredNorm()) farthest = out;
    }
  }
  Vec3 way = farthest;
  for (int i = 0; i < kPowerRounds && (moment * way).norm() > 0.0; ++i) way = (moment * way).normalized();
  return way.normalized() * farthest.norm();
}

// A piece too small for anything else: one short line through its deepest place, along the way that is longest, as near to the
// border as the bead must come to hold the whole piece.
Track lay_dot(const BorderDistance& distance, const BeadWidths& beads) {
  const PieceMesh& mesh = distance.mesh();
  const auto [centre, around] = deepest_place(distance);
  const Vec3 heading = longest_way(mesh, centre);
  const double far = 2.0 * heading.norm();
  const double to_back = walk_from(distance, centre, around, -heading, far).length, to_front = walk_from(distance, centre, around, heading, far).length;
  const double whole = to_back + to_front;
  if (whole < 1e-4) return {.kind = PathKind::centre_line, .points = {}};
  const double width = mesh.area / whole;
  const double gap = std::clamp(0.5 * whole * (1.0 - width / beads.max), kLeastDotGap * whole, kDotGap * std::min(width, whole));
  return straight_through(distance, centre, around, heading, std::max(0.0, to_back - gap), std::max(0.0, to_front - gap));
}

void join_tracks(const PieceMesh& mesh, bool join, double reach, std::vector<Track>& tracks, std::vector<char>& irregular) {
  if (join) return chain_tracks(mesh, reach, tracks, irregular);
  for (Track& track : tracks) thin_track(mesh, irregular, track);
}

// A small piece is all corners and ends: its distances must be true between them.
BorderDistance border_distance(PieceMesh mesh, double width) {
  const bool small = is_small(mesh, width);
  return {std::move(mesh), {.tolerance_mm = (small ? 0.03 : 0.08) * width,
                            .min_edge_mm = (small ? 0.3 : 0.75) * width,
                            .max_edge_mm = kLongestEdge * width}};
}

class PieceFiller {
 public:
  PieceFiller(PieceMesh mesh, const Sheet& sheet, const ToolpathOptions& options, bool sparse)
      : sheet_(sheet), options_(options), fill_(options.material[static_cast<int>(sheet.material)]), sparse_(sparse),
        beads_{options.bead_width_mm, options.min_bead_mm, options.max_bead_mm},
        distance_(border_distance(std::move(mesh), beads_.width)),
        zigzag_(fill_.pattern == FillPattern::contour_zigzag && (sparse || has_room_for_lines())),
        ridge_(distance_, beads_) {}

  FilledPiece run() {
    std::vector<Track> contours = trace_contours(ridge_), lines;
    if (zigzag_) lines = trace_inside();
    if (lines.empty() && !can_hold(contours)) contours = trace_roomier(std::move(contours));
    count(contours);
    filled_.lines = static_cast<Index>(lines.size());
    filled_.naive_paths = filled_.rings + filled_.centre_lines + filled_.lines;
    if (options_.link_rings) link_tracks(distance_, beads_.width, contours);
    lay(std::move(contours), std::move(lines));
    if (filled_.paths.empty()) {
      ++filled_.dots;
      lay({lay_dot(distance_, beads_)}, {});
    }
    filled_.naive_paths = std::max(filled_.naive_paths, static_cast<Index>(filled_.paths.size()));
    return std::move(filled_);
  }

 private:
  [[nodiscard]] double rings_depth() const { return fill_.perimeters * beads_.width; }
  [[nodiscard]] bool has_room_for_lines() const {
    const double least = rings_depth() + 0.5 * kFewestLines * beads_.width;
    for (Index v = 0; v < static_cast<Index>(distance_.mesh().vertices.size()); ++v) {
      if (distance_.distance(v) > least) return true;
    }
    return false;
  }
  // Up to here a medial line inside the rings has a centre line; where it is deeper, lines run.
  [[nodiscard]] double narrow_depth() const { return rings_depth() + 0.5 * beads_.widest_strip(fill_.perimeters); }

  std::vector<Track> trace_contours(const Ridge& ridge) const {
    std::vector<Track> tracks = trace_rings(distance_, ridge, beads_.width, zigzag_ ? fill_.perimeters : std::numeric_limits<int>::max() / 2);
    for (Track& line : ridge.centre_lines()) {
      const TrackPoint& middle = line.points[line.points.size() / 2];
      if (zigzag_ && distance_at(distance_, middle.triangle, middle.position) > narrow_depth() + kDepthSlack) continue;
      tracks.push_back(std::move(line));
    }
    return tracks;
  }

  void count(const std::vector<Track>& contours) {
    for (const Track& track : contours) ++(track.kind == PathKind::contour ? filled_.rings : filled_.centre_lines);
  }

  // The area that beads on these tracks can fill, as a part of the piece; at most 1. Rings run beside each other and on
  // themselves: their beads cannot be much wider than usual.
  [[nodiscard]] double room_on(const std::vector<Track>& tracks) const {
    double room = 0.0;
    for (const Track& track : tracks) {
      room += length_of(track) * (track.kind == PathKind::contour ? std::min(kWidestRing * beads_.width, beads_.max) : beads_.max);
    }
    return std::min(1.0, room / distance_.mesh().area);
  }
  [[nodiscard]] bool can_hold(const std::vector<Track>& tracks) const { return room_on(tracks) >= kEnoughRoom; }

  // Where the usual tracks are too short for a small piece: a ring in place of a centre line, or one line right across,
  // whichever has more room.
  std::vector<Track> trace_roomier(std::vector<Track> usual) {
    const Ridge narrow(distance_, {beads_.width, beads_.min, beads_.width});
    std::vector<Track> rings = trace_contours(narrow), dot = {lay_dot(distance_, beads_)};
    std::vector<Track>& best = room_on(rings) >= room_on(dot) ? rings : dot;
    if (room_on(best) <= room_on(usual)) return usual;
    filled_.dots += &best == &dot;
    return std::move(best);
  }

  std::vector<Track> trace_inside() const {
    const double w = beads_.width;
    const int turn = std::abs(sheet_.layer * sheet_.passes + sheet_.pass) % 2;  // of the passes that lie over each other
    return trace_lines(distance_, ridge_,
                       {.spacing = spacing(),
                        .inset = rings_depth() + kInset * w,
                        .narrowest = narrow_depth(),
                        .shortest = kShortestLine * w,
                        .angle = (fill_.line_angle_deg / 180.0 + 0.5 * turn) * std::numbers::pi});
  }
  [[nodiscard]] double spacing() const { return sparse_ ? std::max(beads_.width, *fill_.line_spacing_mm) : beads_.width; }

  void lay(std::vector<Track> contours, std::vector<Track> lines) {
    const PieceMesh& mesh = distance_.mesh();
    std::vector<char> irregular = irregular_triangles(mesh, ridge_, beads_);
    if (!lines.empty() && !sparse_) mark_inside(irregular);
    for (const Track& track : contours) mark_around_steps(track, irregular);
    join_tracks(mesh, options_.link_rings, kLongestStep * beads_.width, contours, irregular);
    join_tracks(mesh, options_.link_rings, std::max(kLongestTurn * beads_.width, kLongestOpenTurn * spacing()), lines, irregular);
    std::vector<Track> tracks = std::move(contours);
    for (Track& line : lines) tracks.push_back(std::move(line));
    for (Track& track : tracks) {
      for (TrackPoint& p : track.points) p.width = beads_.width;
    }
    share_area(mesh, irregular, beads_, tracks);
    for (Track& track : tracks) {
      // What lies between sparse lines stays open.
      if (sparse_ && track.kind == PathKind::infill) {
        for (TrackPoint& p : track.points) p.width = beads_.width;
      }
      BeadPath path = lay_beads(track);
      if (!path.points.empty()) filled_.paths.push_back(std::move(path));
    }
  }

  // Around steps from ring to ring the beads share the area with them.
  void mark_around_steps(const Track& track, std::vector<char>& irregular) const {
    const PieceMesh& mesh = distance_.mesh();
    const double reach = kStepReach * beads_.width;
    std::vector<Index> found;
    for (const TrackPoint& p : track.points) {
      if (!p.step) continue;
      const auto near = [&](const Vec3& place) { return (place - p.position).squaredNorm() < reach * reach; };
      found.assign(1, p.triangle);
      for (std::size_t i = 0; i < found.size(); ++i) {
        irregular[found[i]] = 1;
        for (const Index across : mesh.neighbours[found[i]]) {
          if (across == kNone || std::find(found.begin(), found.end(), across) != found.end()) continue;
          const auto& [a, b, c] = mesh.triangles[across];
          if (near(mesh.vertices[a]) || near(mesh.vertices[b]) || near(mesh.vertices[c])) found.push_back(across);
        }
      }
    }
  }

  // Dense lines share the area inside the rings, as beads near the medial line do.
  void mark_inside(std::vector<char>& irregular) const {
    const PieceMesh& mesh = distance_.mesh();
    const double depth = rings_depth() - 0.5 * beads_.width;
    for (std::size_t t = 0; t < irregular.size(); ++t) {
      for (const Index v : mesh.triangles[t]) irregular[t] |= distance_.distance(v) > depth;
    }
  }

  const Sheet& sheet_;
  const ToolpathOptions& options_;
  const MaterialToolpathOptions& fill_;
  bool sparse_;
  BeadWidths beads_;
  BorderDistance distance_;
  bool zigzag_;  // lines run inside the rings
  Ridge ridge_;
  FilledPiece filled_;
};

}  // namespace

FilledPiece fill_piece(PieceMesh mesh, const Sheet& sheet, const ToolpathOptions& options, bool sparse) {
  return PieceFiller(std::move(mesh), sheet, options, sparse).run();
}

}  // namespace curvesup::toolpath
