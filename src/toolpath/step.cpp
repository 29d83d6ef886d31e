#include "toolpath/step.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"
#include "toolpath/beads.h"

namespace curvesup::toolpath {
namespace {

constexpr double kArrived = 1e-4;  // mm
constexpr double kOn = 1e-5;       // mm from the part of the section inside a triangle to a start that lies on it
constexpr int kMostTriangles = 400;
constexpr double kUneven = 0.019;  // of the height
constexpr double kPlaces = 0.3;    // mm between the places where that is looked at

// A plane that cuts triangles; vertices on it count as above.
class Section {
 public:
  Section(const PieceMesh& mesh, const Vec3& origin, const Vec3& side) : mesh_(mesh), origin_(origin), side_(side) {}

  [[nodiscard]] bool crosses(Index triangle, int edge) const {
    const auto& corner = mesh_.triangles[triangle];
    return (height(corner[edge]) >= 0.0) != (height(corner[next3(edge)]) >= 0.0);
  }
  // The crossed edge of a crossed triangle other than `but`.
  [[nodiscard]] int other_edge(Index triangle, int but) const {
    for (int i = 0; i < 3; ++i) {
      if (i != but && crosses(triangle, i)) return i;
    }
    return -1;
  }
  [[nodiscard]] Vec3 place(Index triangle, int edge) const {
    const Index a = mesh_.triangles[triangle][edge], b = mesh_.triangles[triangle][next3(edge)];
    const double at_a = height(a), at_b = height(b);
    return mesh_.vertices[a] + at_a / (at_a - at_b) * (mesh_.vertices[b] - mesh_.vertices[a]);
  }

 private:
  [[nodiscard]] double height(Index vertex) const { return side_.dot(mesh_.vertices[vertex] - origin_); }

  const PieceMesh& mesh_;
  Vec3 origin_, side_;
};

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) { return (closest_point_on_segment(p, a, b) - p).norm(); }

// A triangle in which the section starts, and the edge through which it goes on; kNone where none is found.
std::pair<Index, int> first_exit(const PieceMesh& mesh, const Section& section, const TrackPoint& from, const Vec3& heading) {
  const auto& around = mesh.neighbours[from.triangle];
  for (const Index t : {from.triangle, around[0], around[1], around[2]}) {
    if (t == kNone) continue;
    const int one = section.other_edge(t, -1), two = section.other_edge(t, one);
    if (one < 0 || two < 0) continue;
    const Vec3 at_one = section.place(t, one), at_two = section.place(t, two);
    if (distance_to_segment(from.position, at_one, at_two) > kOn) continue;
    return {t, heading.dot(at_one - at_two) > 0.0 ? one : two};
  }
  return {kNone, -1};
}

struct NearestTriangle {
  double distance = 1e300;
  Index triangle = kNone;
};

// The height of a bead on the nearest of some triangles and those beside them.
double height_at(const PieceMesh& mesh, const Vec3& place, const std::vector<Index>& triangles) {
  NearestTriangle nearest;
  const auto offer = [&](Index t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double distance = (closest_point_on_triangle(place, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - place).norm();
    if (distance < nearest.distance) nearest = {distance, t};
  };
  for (const Index t : triangles) {
    offer(t);
    for (const Index across : mesh.neighbours[t]) {
      if (across != kNone) offer(across);
    }
  }
  return clipped_height(mesh.thickness[nearest.triangle], place.z(), mesh.rise[nearest.triangle]);
}

// Along an edge of the mesh a step may be counted to the wrong side of it: its beads' heights are compared with the
// triangles that really lie under places of each.
bool heights_hold(const PieceMesh& mesh, const Track& step, const std::vector<Index>& triangles) {
  for (std::size_t i = 1; i < step.points.size(); ++i) {
    const Vec3 &from = step.points[i - 1].position, along = step.points[i].position - from;
    const int places = std::max(1, static_cast<int>(std::ceil(along.norm() / kPlaces)));
    double low = 1e300, high = 0.0;
    for (int k = 0; k < places; ++k) {
      const double height = height_at(mesh, from + (k + 0.5) / places * along, triangles);
      low = std::min(low, height), high = std::max(high, height);
    }
    const double own = step.points[i].height;
    if (own < low * (1.0 - kUneven) || own > high * (1.0 + kUneven)) return false;
  }
  return true;
}

}  // namespace

std::vector<TrackPoint> walk_to(const PieceMesh& mesh, const TrackPoint& from, const TrackPoint& to, double longest) {
  const Vec3 heading = to.position - from.position, side = heading.cross(from.normal + to.normal);
  std::vector<TrackPoint> way;
  if (side.norm() < 1e-9) return way;
  const Section section(mesh, from.position, side.normalized());
  auto [t, exit] = first_exit(mesh, section, from, heading);
  Vec3 at = from.position;
  double length = 0.0;
  for (int i = 0; t != kNone && i < kMostTriangles && length < longest; ++i) {
    const Vec3 next = section.place(t, exit);
    if (distance_to_segment(to.position, at, next) < kArrived) {
      way.push_back(to);
      way.back().triangle = t;
      return way;
    }
    length += (next - at).norm();
    way.push_back({.position = next, .normal = normal_at(mesh, t, next), .triangle = t});
    at = next;
    const Index across = mesh.neighbours[t][exit];
    if (across == kNone) break;
    const auto& corner = mesh.triangles[t];
    const int entry = edge_with_end(mesh, across, corner[next3(exit)], corner[exit]);
    t = across;
    exit = section.other_edge(t, entry);
    if (exit < 0) break;
  }
  way.clear();
  return way;
}

Track lay_step(const PieceMesh& mesh, const std::vector<char>& irregular, const TrackPoint& from, const TrackPoint& to,
               double longest, std::vector<Index>& triangles) {
  Track step{.points = {from}};
  triangles.clear();
  if ((to.position - from.position).norm() < 1e-6) return step;
  const std::vector<TrackPoint> way = walk_to(mesh, from, to, longest);
  for (const TrackPoint& p : way) triangles.push_back(p.triangle);
  step.points.insert(step.points.end(), way.begin(), way.end());
  thin_track(mesh, irregular, step);
  for (TrackPoint& p : step.points) p.step = true;
  if (way.empty() || !heights_hold(mesh, step, triangles)) step.points.clear();
  return step;
}

}  // namespace curvesup::toolpath
