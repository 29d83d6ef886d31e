#pragma once

#include <vector>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/sheets.h"
#include "toolpath/track.h"

// Tracks over the pieces of small named sheets.
namespace curvesup::sheets {

inline toolpath::PieceMesh only_piece(const NamedSheet& sheet) {
  return toolpath::split_into_pieces(sheet.stack, sheet.stack.sheets[0], sheet.gradient).front();
}

// The triangle of a mesh that is nearest to a place, by looking at all.
inline Index nearest_triangle(const toolpath::PieceMesh& mesh, const Vec3& place) {
  Index best = 0;
  double least = 1e300;
  for (Index t = 0; t < static_cast<Index>(mesh.triangles.size()); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double distance = (closest_point_on_triangle(place, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - place).norm();
    if (distance < least - 1e-12) least = distance, best = t;
  }
  return best;
}

inline toolpath::TrackPoint point_on(const toolpath::PieceMesh& mesh, const Vec3& place) {
  const Index triangle = nearest_triangle(mesh, place);
  return {.position = place, .normal = toolpath::normal_at(mesh, triangle, place), .width = 0.8, .triangle = triangle};
}

// Through places so dense that each segment lies on one triangle, nearly.
inline toolpath::Track track_through(const toolpath::PieceMesh& mesh, const std::vector<Vec3>& places, bool closed = false) {
  toolpath::Track track{.closed = closed, .points = {point_on(mesh, places.front())}};
  for (std::size_t i = 1; i < places.size(); ++i) {
    track.points.push_back(point_on(mesh, places[i]));
    track.points.back().triangle = nearest_triangle(mesh, 0.5 * (places[i] + places[i - 1]));
  }
  return track;
}

inline std::vector<Vec3> line(const Vec3& from, const Vec3& to, int segments = 40) {
  std::vector<Vec3> places;
  for (int i = 0; i <= segments; ++i) places.push_back(from + static_cast<double>(i) / segments * (to - from));
  return places;
}

inline std::vector<Vec3> circle(const Vec3& centre, double radius, int segments = 90) {
  std::vector<Vec3> places;
  for (int i = 0; i <= segments; ++i) {
    const double a = 2.0 * std::numbers::pi * (i % segments) / segments;
    places.push_back(centre + radius * Vec3(std::cos(a), std::sin(a), 0.0));
  }
  return places;
}

}  // namespace curvesup::sheets
