#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

class Solid;

// A piece that nothing carries, by its number in one of the sheets.
struct FloatingPiece {
  std::size_t sheet = 0;
  Index piece = 0;
};

// The pieces that have less than a quarter of their area over something: along -grad G, one layer deeper, lies the model,
// the solid or the platform. Most are the lowest layers of a trunk beside a model part that is thinner than the trunk. What
// is gone carries nothing, nor do pieces that are too small: pieces over it are looked at again. Where more than six on top of each other would go, a branch
// stands on them, and none of them is given. In order of (sheet, piece); empty pieces are passed over.
[[nodiscard]] std::vector<FloatingPiece> find_floating(const Domain& domain, const ScalarField& field, int layer_count,
                                                       const Solid& solid, const std::vector<TrimmedSheet*>& sheets,
                                                       const RunContext& run);

}  // namespace curvesup
