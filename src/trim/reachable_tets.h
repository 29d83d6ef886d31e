#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "curvesup/field/field.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

// The support tets that the solid may reach, and what of it: most of the support domain is empty, and one bound clears all
// layers of a tet.
class ReachableTets {
 public:
  ReachableTets(const Domain& domain, const ScalarField& field, const Solid& solid, const RunContext& run);

  [[nodiscard]] bool operator[](Index tet) const { return count_[tet - domain_.model_tets] != kNone; }
  // Of a tet that is reachable.
  [[nodiscard]] Neighbourhood around(Index tet) const;

 private:
  static constexpr std::size_t kChunk = 4096;  // tets
  [[nodiscard]] Neighbourhood ball_around(Index tet) const;
  void find_parts(const Solid& solid, Index tet, const Neighbourhood& ball, std::vector<Index>& parts) const;

  const Domain& domain_;
  const ScalarField& field_;
  std::vector<Index> first_, count_;        // per support tet: its parts in the lists of its chunk; kNone: out of reach
  std::vector<std::vector<Index>> parts_;   // per chunk
  std::vector<std::vector<Extent>> extents_;  // along grad G
};

}  // namespace curvesup
