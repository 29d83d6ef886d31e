#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

// The support tets that the solid may reach, and what of it: most of the support domain is empty, and one bound clears all
// layers of a tet.
class ReachableTets {
 public:
  ReachableTets(const Domain& domain, const Solid& solid, const RunContext& run);

  [[nodiscard]] bool operator[](Index tet) const { return count_[tet - domain_.model_tets] != kNone; }
  // Of a tet that is reachable.
  [[nodiscard]] Neighbourhood around(Index tet) const;

 private:
  static constexpr std::size_t kChunk = 4096;  // tets
  [[nodiscard]] Neighbourhood ball_around(Index tet) const;

  const Domain& domain_;
  std::vector<Index> first_, count_;        // per support tet: its parts in the list of its chunk; kNone: out of reach
  std::vector<std::vector<Index>> parts_;   // per chunk
};

}  // namespace curvesup
