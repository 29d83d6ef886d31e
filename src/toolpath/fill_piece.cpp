#include "toolpath/fill_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/chain.h"
#include "toolpath/link.h"
#include "toolpath/rings.h"
#include "toolpath/share_area.h"

namespace curvesup::toolpath {
namespace {

constexpr double kLongestStep = 3.0;  // widths, between tracks that are laid without a lift

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

void add_beads(const BorderDistance& distance, const Ridge& ridge, const BeadWidths& beads, bool join, std::vector<Track>& tracks,
               FilledPiece& filled) {
  const PieceMesh& mesh = distance.mesh();
  std::vector<char> irregular = irregular_triangles(mesh, ridge, beads);
  if (join) {
    chain_tracks(mesh, kLongestStep * beads.width, tracks, irregular);
  } else {
    for (Track& track : tracks) thin_track(mesh, irregular, track);
  }
  share_area(mesh, irregular, beads, tracks);
  for (const Track& track : tracks) {
    BeadPath path = lay_beads(track);
    if (!path.points.empty()) filled.paths.push_back(std::move(path));
  }
}

}  // namespace

FilledPiece fill_piece(PieceMesh mesh, const Sheet&, const ToolpathOptions& options) {
  const BeadWidths beads{options.bead_width_mm, options.min_bead_mm, options.max_bead_mm};
  const BorderDistance distance(std::move(mesh), {.tolerance_mm = 0.08 * beads.width, .min_edge_mm = 0.75 * beads.width});
  const Ridge ridge(distance, beads);
  std::vector<Track> tracks = trace_rings(distance, ridge, beads.width, std::numeric_limits<int>::max() / 2);
  FilledPiece filled;
  filled.rings = static_cast<Index>(tracks.size());
  for (Track& line : ridge.centre_lines()) {
    ++filled.centre_lines;
    tracks.push_back(std::move(line));
  }
  filled.naive_paths = static_cast<Index>(tracks.size());
  if (options.link_rings) link_tracks(distance, beads.width, tracks);
  add_beads(distance, ridge, beads, options.link_rings, tracks, filled);
  if (filled.paths.empty()) {
    ++filled.dots;
    std::vector<Track> dot{lay_dot(distance, beads)};
    add_beads(distance, ridge, beads, false, dot, filled);
  }
  filled.naive_paths = std::max(filled.naive_paths, static_cast<Index>(filled.paths.size()));
  return filled;
}

}  // namespace curvesup::toolpath
