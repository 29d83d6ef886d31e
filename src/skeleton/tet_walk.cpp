#include "skeleton/tet_walk.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace curvesup {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A walk that makes no way for this many tets runs around an edge of degenerate tets.
constexpr int kMaxStalledTets = 200;

struct Exit {
  double distance = kInfinity;
  int face = -1;
};

// Where the ray p + s u leaves a tet; the face by which it came in does not count. All faces are looked at before one is
// chosen: which ones the ray runs towards cannot be foreseen, and waiting for it costs more than the products.
Exit find_exit(const TetMesh& mesh, Index tet, const Vec3& p, const Vec3& u, int entry_face) {
  const auto& corner = mesh.tets[tet];
  const Vec3 &a = mesh.vertices[corner[0]], &b = mesh.vertices[corner[1]], &c = mesh.vertices[corner[2]],
             &d = mesh.vertices[corner[3]];
  const Vec3 ab = b - a, ac = c - a, ad = d - a, to_a = a - p;
  const Vec3 opposite_a = (c - b).cross(d - b), opposite_b = ad.cross(ac), opposite_c = ab.cross(ad),
             opposite_d = ac.cross(ab);  // outwards
  std::array<double, 4> rate = {opposite_a.dot(u), opposite_b.dot(u), opposite_c.dot(u), opposite_d.dot(u)};
  const std::array<double, 4> gap = {opposite_a.dot(b - p), opposite_b.dot(to_a), opposite_c.dot(to_a),
                                     opposite_d.dot(to_a)};
  if (entry_face >= 0) rate[entry_face] = 0.0;
  Exit exit;
  for (int f = 0; f < 4; ++f) {
    const double distance = rate[f] > 0.0 ? std::max(0.0, gap[f] / rate[f]) : kInfinity;
    const bool nearer = distance < exit.distance;
    exit.distance = nearer ? distance : exit.distance;
    exit.face = nearer ? f : exit.face;
  }
  return exit;
}

int face_towards(const TetTopology& topology, Index tet, Index neighbour) {
  const auto& neighbours = topology.neighbours[tet];
  return static_cast<int>(std::find(neighbours.begin(), neighbours.end(), neighbour) - neighbours.begin());
}

}  // namespace

WalkResult TetWalk::walk(const Vec3& start, Index tet, const Vec3& u, const WalkGoal& goal) const {
  WalkResult result;
  result.position = start;
  result.tet = tet;
  int entry_face = -1;
  for (int stalled = 0; stalled < kMaxStalledTets;) {
    const Vec3 p = result.position;
    const Exit exit = find_exit(domain_.mesh, result.tet, p, u, entry_face);
    if (exit.face < 0) return result;

    const double slope = field_.gradient[result.tet].dot(u);
    const double to_value = slope < 0.0 ? std::max(0.0, (goal.value - value_at(result.tet, p)) / slope) : kInfinity;
    const double to_platform = goal.stop_at_platform && u.z() < 0.0 ? std::max(0.0, -p.z() / u.z()) : kInfinity;
    const double to_length = goal.length - result.length;
    const double distance = std::min({exit.distance, to_value, to_platform, to_length});

    if (distance > 0.0 && result.length < WalkResult::kEntry) result.enter(result.tet);
    result.position = p + distance * u;
    result.length += distance;
    if (distance > 0.0) {
      stalled = 0;
    } else {
      ++stalled;
    }
    if (distance == to_platform) {
      result.position.z() = 0.0;
      result.stop = WalkStop::platform;
      return result;
    }
    if (distance == to_value) {
      result.stop = WalkStop::value;
      return result;
    }
    if (distance == to_length) {
      result.stop = WalkStop::length;
      return result;
    }
    const Index next = domain_.topology.neighbours[result.tet][exit.face];
    if (next == kNone) {
      result.stop = WalkStop::hull;
      return result;
    }
    if (domain_.region(next) == Material::model) {
      result.stop = WalkStop::model;
      result.model_tet = next;
      return result;
    }
    entry_face = face_towards(domain_.topology, next, result.tet);
    result.tet = next;
  }
  result.stop = WalkStop::lost;
  return result;
}

}  // namespace curvesup
