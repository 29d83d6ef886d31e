#include "skeleton/leaf_start.h"

#include <algorithm>

#include "curvesup/mesh/triangle_mesh.h"
#include "core/angle_between.h"

namespace curvesup {

namespace {
constexpr double kLift = 0.02;  // mm above the face at which a blocked leaf starts again
}

LeafStarts::LeafStarts(const Model& model, const Domain& domain, const ScalarField& field,
                       const AngleLimit& self_support, std::span<const LeafSite> sites)
    : model_(model), domain_(domain), field_(field), walk_(domain, field), self_support_(self_support) {
  collect_tets_around(sites);
}

void LeafStarts::collect_tets_around(std::span<const LeafSite> sites) {
  std::vector<char> wanted(domain_.mesh.vertices.size(), 0);
  bool any = false;
  for (const LeafSite& site : sites) {
    if (site.vertex != kNone) wanted[site.vertex] = any = true;
  }
  if (!any) return;
  for (Index t = domain_.model_tets; t < static_cast<Index>(domain_.mesh.tets.size()); ++t) {
    for (const Index v : domain_.mesh.tets[t]) {
      if (wanted[v]) tets_around_.emplace_back(v, t);
    }
  }
  std::sort(tets_around_.begin(), tets_around_.end());
}

// Does a ray from a corner of a tet run into it?
bool LeafStarts::enters(Index tet, Index vertex, const Vec3& u) const {
  const auto& corner = domain_.mesh.tets[tet];
  for (int f = 0; f < 4; ++f) {
    if (corner[f] == vertex) continue;
    const auto v = face_vertices(corner, f);
    const Vec3 outward =
        area_normal(domain_.mesh.vertices[v[0]], domain_.mesh.vertices[v[1]], domain_.mesh.vertices[v[2]]);
    if (outward.dot(u) >= 0.0) return false;
  }
  return true;
}

std::optional<Start> LeafStarts::start_at_vertex(const LeafSite& site) const {
  std::optional<Start> best;
  double best_angle = 0.0;
  auto around = std::lower_bound(tets_around_.begin(), tets_around_.end(), std::pair(site.vertex, Index{0}));
  for (; around != tets_around_.end() && around->first == site.vertex; ++around) {
    const Index tet = around->second;
    const Vec3 u = self_support_.turn(walk_.down(tet), site.direction);
    const double angle = angle_between(u, site.direction);
    if ((best && angle >= best_angle) || !enters(tet, site.vertex, u)) continue;
    best = Start{site.position, u, tet};
    best_angle = angle;
  }
  return best;
}

std::optional<Start> LeafStarts::start_on_face(Index face, const Vec3& p) const {
  const Index tet = domain_.interface_tet[face];
  const auto& v = model_.boundary[face].vertices;
  const Vec3 normal =
      area_normal(model_.mesh.vertices[v[0]], model_.mesh.vertices[v[1]], model_.mesh.vertices[v[2]]).normalized();
  const Vec3 u = self_support_.turn(walk_.down(tet), -print_direction(field_, model_.boundary[face].tet));
  if (u.dot(normal) <= 0.0) return std::nullopt;
  return Start{p, u, tet};
}

// A ray that would start into the solid starts again 25 % towards the face's centroid, lifted a little.
std::optional<Start> LeafStarts::start(const LeafSite& site) const {
  if (site.vertex == kNone) return start_on_face(site.face, site.position);
  if (const auto at_vertex = start_at_vertex(site)) return at_vertex;
  const auto& v = model_.boundary[site.face].vertices;
  const Vec3 &a = model_.mesh.vertices[v[0]], &b = model_.mesh.vertices[v[1]], &c = model_.mesh.vertices[v[2]];
  const Vec3 inside = 0.75 * site.position + 0.25 * (a + b + c) / 3.0;
  auto restart = start_on_face(site.face, inside);
  if (!restart) return restart;
  const WalkResult lift =
      walk_.walk(inside, restart->tet, area_normal(a, b, c).normalized(), {.length = kLift, .stop_at_platform = false});
  if (lift.stop == WalkStop::length) {
    restart->position = lift.position;
    restart->tet = lift.tet;
    restart->direction = self_support_.turn(walk_.down(lift.tet), restart->direction);
  }
  return restart;
}

}  // namespace curvesup
