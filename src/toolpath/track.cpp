#include "toolpath/track.h"

#include <algorithm>
#include <cmath>

namespace curvesup::toolpath {
namespace {

// Weights of the corners at a point of the triangle's plane; false where the triangle has no area.
bool barycentric(const PieceMesh& mesh, Index triangle, const Vec3& p, std::array<double, 3>& weight) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 ab = mesh.vertices[b] - mesh.vertices[a], ac = mesh.vertices[c] - mesh.vertices[a];
  const Vec3 normal = ab.cross(ac), ap = p - mesh.vertices[a];
  const double area = normal.squaredNorm();
  if (area < 1e-20) return false;
  weight[1] = ap.cross(ac).dot(normal) / area;
  weight[2] = ab.cross(ap).dot(normal) / area;
  weight[0] = 1.0 - weight[1] - weight[2];
  return true;
}

}  // namespace

void turn_round(Track& track) {
  auto& points = track.points;
  std::reverse(points.begin(), points.end());
  for (std::size_t i = points.size() - 1; i > 0; --i) {
    const Vec3 position = points[i].position, normal = points[i].normal;
    const double tip_offset = points[i].tip_offset;
    points[i] = points[i - 1];
    points[i].position = position;
    points[i].normal = normal;
    points[i].tip_offset = tip_offset;
  }
}

double length_of(const Track& track) {
  double sum = 0.0;
  for (std::size_t i = 1; i < track.points.size(); ++i) {
    sum += (track.points[i].position - track.points[i - 1].position).norm();
  }
  return sum;
}

Vec3 normal_at(const PieceMesh& mesh, Index triangle, const Vec3& position) {
  std::array<double, 3> w{1.0 / 3, 1.0 / 3, 1.0 / 3};
  barycentric(mesh, triangle, position, w);
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < 3; ++i) sum += std::clamp(w[i], 0.0, 1.0) * mesh.normals[mesh.triangles[triangle][i]];
  return sum.normalized();
}

double tip_offset_at(const PieceMesh& mesh, Index triangle, const Vec3& position) {
  std::array<double, 3> w{1.0 / 3, 1.0 / 3, 1.0 / 3};
  barycentric(mesh, triangle, position, w);
  double sum = 0.0, total = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double weight = std::clamp(w[i], 0.0, 1.0);
    sum += weight * mesh.tip_offset[mesh.triangles[triangle][i]];
    total += weight;
  }
  return sum / total;
}

double distance_at(const BorderDistance& distance, Index triangle, const Vec3& position) {
  std::array<double, 3> w{1.0 / 3, 1.0 / 3, 1.0 / 3};
  barycentric(distance.mesh(), triangle, position, w);
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += w[i] * distance.distance(distance.mesh().triangles[triangle][i]);
  return sum;
}

Walk walk_straight(const BorderDistance& distance, const SurfacePoint& start, const Vec3& direction, double length,
                   double stop_distance) {
  const PieceMesh& mesh = distance.mesh();
  Walk walk;
  walk.end = start;
  Vec3 heading = direction;
  Index entered_from = kNone;
  double here = stop_distance >= 0.0 ? distance_at(distance, start.triangle, start.position) : 0.0;
  for (int step = 0; step < 2000; ++step) {
    const Index t = walk.end.triangle;
    const auto& corner = mesh.triangles[t];
    const Vec3 normal = (mesh.vertices[corner[1]] - mesh.vertices[corner[0]])
                            .cross(mesh.vertices[corner[2]] - mesh.vertices[corner[0]]);
    const double area = normal.norm();
    if (area < 1e-12) break;
    const Vec3 up = normal / area;
    heading -= up * up.dot(heading);
    if (heading.norm() < 1e-9) break;
    heading.normalize();
    // The first edge that the heading leaves through.
    double reach = std::numeric_limits<double>::infinity();
    int exit = -1;
    for (int i = 0; i < 3; ++i) {
      const Vec3& from = mesh.vertices[corner[i]];
      const Vec3 edge = mesh.vertices[corner[next3(i)]] - from;
      const Vec3 outward = edge.cross(up);
      const double speed = heading.dot(outward);
      if (speed <= 1e-12 * edge.norm()) continue;
      if (mesh.neighbours[t][i] == entered_from && entered_from != kNone) continue;
      const double at = std::max(0.0, (from - walk.end.position).dot(outward) / speed);
      if (at < reach) reach = at, exit = i;
    }
    if (exit < 0) break;
    double advance = std::min(reach, length - walk.length);
    Vec3 next = walk.end.position + advance * heading;
    bool done = advance >= length - walk.length;
    if (stop_distance >= 0.0) {
      const double there = distance_at(distance, t, next);
      if ((here - stop_distance) * (there - stop_distance) <= 0.0 && here != there) {
        const double part = (here - stop_distance) / (here - there);
        advance *= part;
        next = walk.end.position + advance * heading;
        walk.stopped = done = true;
      }
      here = there;
    }
    walk.length += advance;
    walk.end.position = next;
    walk.points.push_back({next, normal_at(mesh, t, next), 0.0, t});
    if (done) break;
    const Index across = mesh.neighbours[t][exit];
    if (across == kNone) break;
    // Unroll the next triangle about the edge: what runs along the edge stays, what runs out turns with the plane.
    const Vec3 along = (mesh.vertices[corner[next3(exit)]] - mesh.vertices[corner[exit]]).normalized();
    const auto& other = mesh.triangles[across];
    const Vec3 other_normal = (mesh.vertices[other[1]] - mesh.vertices[other[0]])
                                  .cross(mesh.vertices[other[2]] - mesh.vertices[other[0]]);
    const double other_area = other_normal.norm();
    if (other_area > 1e-12) {
      const Vec3 out = along.cross(up), out_there = along.cross(Vec3(other_normal / other_area));
      heading = heading.dot(along) * along + heading.dot(out) * out_there;
    }
    entered_from = t;
    walk.end.triangle = across;
  }
  walk.direction = heading;
  return walk;
}

Walk walk_from(const BorderDistance& distance, const Vec3& place, const std::vector<Index>& around, const Vec3& direction, double length) {
  Walk best;
  for (const Index t : around) {
    Walk here = walk_straight(distance, {t, place}, direction, length);
    if (here.length > best.length) best = std::move(here);
  }
  return best;
}

Track straight_through(const BorderDistance& distance, const Vec3& place, const std::vector<Index>& around, const Vec3& direction,
                       double back, double forth) {
  const Walk behind = walk_from(distance, place, around, -direction, back), ahead = walk_from(distance, place, around, direction, forth);
  Track track{.kind = PathKind::centre_line, .points = {}};
  track.points.push_back({.position = place, .normal = normal_at(distance.mesh(), around.front(), place)});
  track.points.insert(track.points.end(), behind.points.begin(), behind.points.end());
  turn_round(track);
  track.points.insert(track.points.end(), ahead.points.begin(), ahead.points.end());
  return track;
}

}  // namespace curvesup::toolpath
