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

  [[nodiscard]] bool operator[](Index tet) const { return number_[tet - first_tet_] != kNone; }
  // Of a tet that is reachable; `up` is along grad G.
  [[nodiscard]] const Neighbourhood& around(Index tet) const {
    const std::size_t t = tet - first_tet_;
    return chunks_[t / kChunk].around[number_[t]];
  }

 private:
  static constexpr std::size_t kChunk = 4096;  // tets
  struct Chunk {
    std::vector<Neighbourhood> around;  // reachable tets
    std::vector<Index> parts;
    std::vector<Extent> extents;
  };

  Index first_tet_;
  std::vector<Index> number_;  // per support tet, in its chunk; kNone: out of reach
  std::vector<Chunk> chunks_;
};

}  // namespace curvesup
