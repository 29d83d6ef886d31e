#pragma once

#include <vector>

#include "curvesup/domain/domain.h"
#include "trim/reachable_tets.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

class Solid;

struct SlabOptions {
  double edge_length_mm = 0.4;
  double max_height_mm = 1.0;
  int max_passes = 12;
};

// How the slab of one layer is laid.
struct DividedSlab {
  std::vector<char> in_one_pass;     // per piece of the layer
  std::vector<TrimmedSheet> passes;  // of all others; pieces that belong to other numbers of passes are gone
};

// Decides the number of passes for every connected region of the support in the slab of `middle`, the trimmed layer with its
// pieces, and cuts the passes. A piece wants enough passes for its 95th percentile of thickness; pieces that a piece of some
// pass connects along grad G take the largest number among them.
[[nodiscard]] DividedSlab divide_slab(const Domain& domain, const ScalarField& field, int layer_count,
                                      const ReachableTets& reachable, const Solid& solid, const TrimmedSheet& middle,
                                      const SlabOptions& options);

}  // namespace curvesup
