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
constexpr double kDepthSlack = 0.02;   // mm

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

// A piece too small for anything else: one short line through its deepest place, along the way that is longest, as wide
// as makes its area that of the piece.
Track lay_dot(const BorderDistance& distance, const BeadWidths& beads) {
  const PieceMesh& mesh = distance.mesh();
  const auto [centre, around] = deepest_place(distance);
  Index farthest = 0;
  for (Index v = 0; v < static_cast<Index>(mesh.vertices.size()); ++v) {
    if ((mesh.vertices[v] - centre).squaredNorm() > (mesh.vertices[farthest] - centre).squaredNorm()) farthest = v;
  }
  const Vec3 heading = mesh.vertices[farthest] - centre;
  Track track{.kind = PathKind::centre_line, .points = {}};
  // Half the dot to either side; the triangle around `centre` that the heading enters is found by trying.
  const double wanted = std::max(std::sqrt(mesh.area), mesh.area / beads.max);
  const auto walk_to = [&](const Vec3& direction) {
    Walk best;
    for (const Index t : around) {
      Walk walk = walk_straight(distance, {t, centre}, direction, 0.5 * wanted);
      if (walk.length > best.length) best = std::move(walk);
    }
    return best;
  };
  const Walk back = walk_to(-heading), forth = walk_to(heading);
  const double length = back.length + forth.length;
  if (length < 1e-4) return track;
  const double width = std::clamp(mesh.area / length, beads.min, beads.max);
  for (std::size_t i = back.points.size(); i-- > 0;) {
    TrackPoint p = back.points[i];
    p.triangle = i + 1 < back.points.size() ? back.points[i + 1].triangle : kNone;
    p.width = width;
    track.points.push_back(p);
  }
  TrackPoint middle{centre, normal_at(mesh, around.front(), centre), width, back.points.empty() ? kNone : back.points[0].triangle};
  track.points.push_back(middle);
  for (TrackPoint p : forth.points) {
    p.width = width;
    track.points.push_back(p);
  }
  return track;
}

void join_tracks(const PieceMesh& mesh, bool join, double reach, std::vector<Track>& tracks, std::vector<char>& irregular) {
  if (join) return chain_tracks(mesh, reach, tracks, irregular);
  for (Track& track : tracks) thin_track(mesh, irregular, track);
}

class PieceFiller {
 public:
  PieceFiller(PieceMesh mesh, const Sheet& sheet, const ToolpathOptions& options, bool sparse)
      : sheet_(sheet), options_(options), fill_(options.material[static_cast<int>(sheet.material)]), sparse_(sparse),
        beads_{options.bead_width_mm, options.min_bead_mm, options.max_bead_mm},
        distance_(std::move(mesh), {.tolerance_mm = 0.08 * beads_.width, .min_edge_mm = 0.75 * beads_.width}),
        ridge_(distance_, beads_) {}

  FilledPiece run() {
    std::vector<Track> contours = trace_contours(), lines;
    if (zigzag()) lines = trace_inside();
    filled_.naive_paths = filled_.rings + filled_.centre_lines + filled_.lines;
    lay(std::move(contours), std::move(lines));
    if (filled_.paths.empty()) {
      ++filled_.dots;
      lay({lay_dot(distance_, beads_)}, {});
    }
    filled_.naive_paths = std::max(filled_.naive_paths, static_cast<Index>(filled_.paths.size()));
    return std::move(filled_);
  }

 private:
  [[nodiscard]] bool zigzag() const { return fill_.pattern == FillPattern::contour_zigzag; }
  [[nodiscard]] double rings_depth() const { return fill_.perimeters * beads_.width; }
  // Up to here a medial line inside the rings has a centre line; where it is deeper, lines run.
  [[nodiscard]] double narrow_depth() const { return rings_depth() + 0.5 * beads_.max; }

  std::vector<Track> trace_contours() {
    std::vector<Track> tracks = trace_rings(distance_, ridge_, beads_.width, zigzag() ? fill_.perimeters : std::numeric_limits<int>::max() / 2);
    filled_.rings = static_cast<Index>(tracks.size());
    for (Track& line : ridge_.centre_lines()) {
      const TrackPoint& middle = line.points[line.points.size() / 2];
      if (zigzag() && distance_at(distance_, middle.triangle, middle.position) > narrow_depth() + kDepthSlack) continue;
      ++filled_.centre_lines;
      tracks.push_back(std::move(line));
    }
    if (options_.link_rings) link_tracks(distance_, beads_.width, tracks);
    return tracks;
  }

  std::vector<Track> trace_inside() {
    const double w = beads_.width;
    const int turn = std::abs(sheet_.layer * sheet_.passes + sheet_.pass) % 2;  // of the passes that lie over each other
    std::vector<Track> lines = trace_lines(distance_, ridge_, w,
                                           {.spacing = spacing(),
                                            .inset = rings_depth() + kInset * w,
                                            .narrowest = narrow_depth(),
                                            .shortest = kShortestLine * w,
                                            .angle = (fill_.line_angle_deg / 180.0 + 0.5 * turn) * std::numbers::pi});
    filled_.lines = static_cast<Index>(lines.size());
    return lines;
  }
  [[nodiscard]] double spacing() const { return sparse_ ? std::max(beads_.width, *fill_.line_spacing_mm) : beads_.width; }

  void lay(std::vector<Track> contours, std::vector<Track> lines) {
    const PieceMesh& mesh = distance_.mesh();
    std::vector<char> irregular = irregular_triangles(mesh, ridge_, beads_);
    if (!lines.empty() && !sparse_) mark_inside(irregular);
    join_tracks(mesh, options_.link_rings, kLongestStep * beads_.width, contours, irregular);
    join_tracks(mesh, options_.link_rings, std::max(kLongestTurn * beads_.width, kLongestOpenTurn * spacing()), lines, irregular);
    std::vector<Track> tracks = std::move(contours);
    for (Track& line : lines) tracks.push_back(std::move(line));
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
  Ridge ridge_;
  FilledPiece filled_;
};

}  // namespace

FilledPiece fill_piece(PieceMesh mesh, const Sheet& sheet, const ToolpathOptions& options, bool sparse) {
  return PieceFiller(std::move(mesh), sheet, options, sparse).run();
}

}  // namespace curvesup::toolpath
