#include "skeleton/node_drop.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "curvesup/mesh/triangle_mesh.h"
#include "skeleton/resting_part.h"

namespace curvesup {

namespace {
constexpr double kSteepestStand = 0.35;  // n . d_p of a model face on which a branch may stand; steeper ones are walls
constexpr double kLeastRest = 0.4;       // of each section next to a foot that must lie on something
}  // namespace

const char* reason(Drop drop) {
  switch (drop) {
    case Drop::blocked:
      return "the model lies less than a layer below";
    case Drop::short_branch:
      return "its branch would meet the model less than a layer below";
    case Drop::no_platform:
      return "the platform cannot be reached within the self-support angle";
    case Drop::left_hull:
      return "its branch would leave the support domain";
    case Drop::steep:
      return "no direction within the self-support angle leads out of the model";
    case Drop::none:
      break;
  }
  return "";
}

double radius_by_area(const SkeletonOptions& options, Index leaves) {
  return options.leaf_radius_mm * std::sqrt(static_cast<double>(leaves));
}

NodeDrop::NodeDrop(const Model& model, const Domain& domain, const ScalarField& field, int layer_count,
                   const SkeletonOptions& options)
    : model_(model),
      domain_(domain),
      field_(field),
      walk_(domain, field),
      count_(layer_count),
      options_(options),
      self_support_(options.self_support.radians()) {}

Index NodeDrop::interface_face(Index model_tet, Index support_tet) const {
  const auto& boundary = model_.boundary;
  auto it = std::lower_bound(boundary.begin(), boundary.end(), model_tet,
                             [](const BoundaryFace& f, Index tet) { return f.tet < tet; });
  const auto& corner = domain_.mesh.tets[support_tet];
  for (; it != boundary.end() && it->tet == model_tet; ++it) {
    const bool shared = std::all_of(it->vertices.begin(), it->vertices.end(), [&](Index v) {
      return std::find(corner.begin(), corner.end(), v) != corner.end();
    });
    if (shared) return static_cast<Index>(it - boundary.begin());
  }
  return kNone;
}

NodeDrop::Stand NodeDrop::stand_of(const WalkResult& walk, const Vec3& u, const Branch& branch) const {
  Stand stand;
  const Index face = interface_face(walk.model_tet, walk.tet);
  if (face == kNone || branch.lowest_leaf - walk_.value_at(walk.tet, walk.position) < 1.0 / count_) return stand;
  const auto& v = model_.boundary[face].vertices;
  const Vec3 normal =
      area_normal(model_.mesh.vertices[v[0]], model_.mesh.vertices[v[1]], model_.mesh.vertices[v[2]]).normalized();
  const Vec3 up = print_direction(field_, walk.model_tet);
  stand.allowed = normal.dot(up) > 0.0;
  if (normal.dot(up) < kSteepestStand) return stand;
  stand.angle = stand_angle(normal, up, -u);
  if (!stand.broad()) return stand;
  const double radius = std::min(radius_by_area(options_, branch.count), options_.max_radius_mm);
  const Foot foot = foot_of(normal, up, -u, radius, options_.leaf_radius_mm);
  const double part = resting_part(walk_, count_, {walk.position, walk.tet, -u, radius, foot},
                                   0.5 * options_.bead_width_mm * options_.bead_width_mm);
  if (part < kLeastRest) stand.angle = part - 1.0;
  return stand;
}

Vec3 NodeDrop::host_direction(Index tet) const {
  const Vec3 down = walk_.down(tet);
  return options_.host_direction == HostDirection::normal ? down : self_support_.turn(down, -Vec3::UnitZ());
}

Step NodeDrop::step(const Vec3& p, Index tet, const Vec3& wanted, double value, const Branch& branch) const {
  const bool may_stand = options_.model_contact != ModelContact::forbidden;
  const WalkResult straight = walk_.walk(p, tet, wanted, {.value = value});
  const bool straight_allowed = within_angle(straight, wanted);
  const auto arrives = [](const WalkResult& w) { return w.stop == WalkStop::value || w.stop == WalkStop::platform; };
  if (straight_allowed && arrives(straight)) return {straight};
  Stand best;
  std::optional<WalkResult> stands;
  const auto try_stand = [&](const WalkResult& walk, const Vec3& u) {
    if (!may_stand || walk.stop != WalkStop::model) return;
    const Stand stand = stand_of(walk, u, branch);
    if (!stand.allowed || (stands && stand.angle <= best.angle)) return;
    stands = walk;
    best = stand;
  };
  if (straight_allowed) try_stand(straight, wanted);
  // A wall is left by the side, as the model is altogether where the platform is preferred.
  if (best.broad() && options_.model_contact == ModelContact::allowed) return {straight};

  const Vec3 down = walk_.down(tet);
  const Vec3 side = down.unitOrthogonal(), other = down.cross(side);
  constexpr int kTilts = 4, kAround = 8;
  for (int tilt = 1; tilt <= kTilts; ++tilt) {
    const double angle = self_support_.radians() * tilt / kTilts;
    for (int around = -1; around < kAround; ++around) {
      const double azimuth = 2.0 * std::numbers::pi * around / kAround;
      const Vec3 u =
          around < 0
              ? AngleLimit(angle).turn(down, -Vec3::UnitZ())
              : Vec3((std::cos(angle) * down + std::sin(angle) * (std::cos(azimuth) * side + std::sin(azimuth) * other))
                         .normalized());
      const WalkResult bent = walk_.walk(p, tet, u, {.value = value});
      if (!within_angle(bent, u)) continue;
      if (arrives(bent)) return {bent};
      if (!best.broad()) try_stand(bent, u);
    }
  }
  if (stands) return {*stands};
  if (straight.stop == WalkStop::model) return {straight, may_stand ? Drop::short_branch : Drop::no_platform};
  return {straight, straight.stop == WalkStop::hull ? Drop::left_hull : Drop::steep};
}

}  // namespace curvesup
