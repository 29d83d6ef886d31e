#include "trim/reachable_tets.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/parallel.h"

namespace curvesup {

ReachableTets::ReachableTets(const Domain& domain, const ScalarField& field, const Solid& solid, const RunContext& run)
    : domain_(domain), field_(field) {
  const std::size_t support = domain.mesh.tets.size() - domain.model_tets;
  first_.assign(support, 0);
  count_.assign(support, kNone);
  parts_.resize(chunk_count(support, kChunk));
  extents_.resize(parts_.size());
  parallel_for(support, kChunk, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    const auto local = solid.local();
    std::vector<Index> near, &parts = parts_[chunk];
    for (std::size_t t = begin; t < end; ++t) {
      const Index tet = domain.model_tets + static_cast<Index>(t);
      Neighbourhood ball = ball_around(tet);
      find_parts(solid, tet, ball, near);
      ball.parts = near;
      local->focus(ball.centre, ball.radius, ball);
      if (local->surely_outside(ball.centre, ball.radius)) continue;
      first_[t] = static_cast<Index>(parts.size());
      count_[t] = static_cast<Index>(near.size());
      parts.insert(parts.end(), near.begin(), near.end());
      const Vec3 up = print_direction(field, tet);
      for (const Index part : near) extents_[chunk].push_back(solid.extent(part, up));
    }
  });
}

// The parts of the solid near a tet, but those beyond one of its faces.
void ReachableTets::find_parts(const Solid& solid, Index tet, const Neighbourhood& ball, std::vector<Index>& parts) const {
  solid.find_parts(ball.centre, ball.radius, parts);
  const auto& at = domain_.mesh.vertices;
  for (int f = 0; f < 4 && !parts.empty(); ++f) {
    const auto v = face_vertices(domain_.mesh.tets[tet], f);
    const Vec3 outward = (at[v[1]] - at[v[0]]).cross(at[v[2]] - at[v[0]]).normalized();
    const double face = outward.dot(at[v[0]]);
    std::erase_if(parts, [&](Index part) { return solid.extent(part, outward).low > face; });
  }
}

Neighbourhood ReachableTets::ball_around(Index tet) const {
  const auto& corners = domain_.mesh.tets[tet];
  Vec3 centre = Vec3::Zero();
  for (const Index v : corners) centre += 0.25 * domain_.mesh.vertices[v];
  double radius2 = 0.0;
  for (const Index v : corners) radius2 = std::max(radius2, (domain_.mesh.vertices[v] - centre).squaredNorm());
  Neighbourhood ball;
  ball.centre = centre;
  ball.radius = std::sqrt(radius2);
  return ball;
}

Neighbourhood ReachableTets::around(Index tet) const {
  Neighbourhood ball = ball_around(tet);
  const std::size_t t = tet - domain_.model_tets;
  ball.parts = std::span(parts_[t / kChunk]).subspan(first_[t], count_[t]);
  ball.up = print_direction(field_, tet);
  ball.extents = std::span(extents_[t / kChunk]).subspan(first_[t], count_[t]);
  return ball;
}

}  // namespace curvesup
