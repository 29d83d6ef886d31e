#pragma once

#include <vector>

#include "curvesup/domain/domain.h"
#include "trim/reachable_tets.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

class Solid;

struct SlabOptions {
  double edge_length_mm = 0.4;
  double max_height_mm = 1.0;  // for which a region is laid in passes
  double limit_mm = 1.0;       // a spot that is higher even so gets passes of its own
  int max_passes = 12;
};

// How the slab of one layer is laid. From each sheet is gone what is laid in other numbers of passes.
struct DividedSlab {
  TrimmedSheet in_one_pass;          // of the layer
  double in_passes_mm2 = 0.0;        // what is gone of the layer
  std::vector<TrimmedSheet> passes;  // of all else
};

// Decides the number of passes for every connected region of the support in the slab of `middle`, the trimmed layer with its
// pieces, and cuts the passes. A piece wants enough passes for its 95th percentile of thickness, and for limit_mm where it is
// thickest unless that takes more than twice as many; pieces that a piece of some pass connects along grad G take the largest
// number among them. In tets where a region is thicker than limit_mm even so, its passes are doubled, and again, up to
// max_passes, until beads there are no higher than that percentile is elsewhere. Thickness jumps from tet to tet, next to the
// model by more than ten times: spots that go by tets fit into what is left of the region, and leave the beads beside them as
// high as they are.
[[nodiscard]] DividedSlab divide_slab(const Domain& domain, const ScalarField& field, int layer_count,
                                      const ReachableTets& reachable, const Solid& solid, TrimmedSheet middle,
                                      const SlabOptions& options);

}  // namespace curvesup
