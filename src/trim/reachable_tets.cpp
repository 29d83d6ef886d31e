#include "trim/reachable_tets.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/parallel.h"

namespace curvesup {

ReachableTets::ReachableTets(const Domain& domain, const Solid& solid, const RunContext& run) : domain_(domain) {
  const std::size_t support = domain.mesh.tets.size() - domain.model_tets;
  first_.assign(support, 0);
  count_.assign(support, kNone);
  parts_.resize(chunk_count(support, kChunk));
  parallel_for(support, kChunk, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    const auto local = solid.local();
    std::vector<Index>& parts = parts_[chunk];
    for (std::size_t t = begin; t < end; ++t) {
      const Neighbourhood ball = ball_around(domain.model_tets + static_cast<Index>(t));
      local->focus(ball.centre, ball.radius);
      if (local->surely_outside(ball.centre, ball.radius)) continue;
      first_[t] = static_cast<Index>(parts.size());
      count_[t] = static_cast<Index>(local->parts().size());
      parts.insert(parts.end(), local->parts().begin(), local->parts().end());
    }
  });
}

Neighbourhood ReachableTets::ball_around(Index tet) const {
  const auto& corners = domain_.mesh.tets[tet];
  Vec3 centre = Vec3::Zero();
  for (const Index v : corners) centre += 0.25 * domain_.mesh.vertices[v];
  double radius2 = 0.0;
  for (const Index v : corners) radius2 = std::max(radius2, (domain_.mesh.vertices[v] - centre).squaredNorm());
  return {centre, std::sqrt(radius2), {}};
}

Neighbourhood ReachableTets::around(Index tet) const {
  Neighbourhood ball = ball_around(tet);
  const std::size_t t = tet - domain_.model_tets;
  ball.parts = std::span(parts_[t / kChunk]).subspan(first_[t], count_[t]);
  return ball;
}

}  // namespace curvesup
