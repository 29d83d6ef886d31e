#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/domain/domain.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

class Solid;

// What nothing carries of a sheet.
struct Floating {
  std::size_t sheet = 0;
  double area = 0.0;
  Vec3 centroid = Vec3::Zero();
  Index pieces_less = 0;  // of the sheet; negative where the rest of one falls apart
};

// Takes away pieces that have less than 0.3 of their area over something: along -grad G, one layer deeper, lies the
// model, the solid or the platform. Most are the lowest layers of a trunk beside a model part that is thinner than the trunk.
// Where enough of such a piece rests, that and what it carries stays (`clip_piece.h`). What is gone carries nothing, nor do
// pieces that are too small, which go here, too, unlisted: pieces over it are looked at again. Where more than six on top of
// each other would go, a branch stands on them, and all of them stay as they were. In the order of the sheets.
[[nodiscard]] std::vector<Floating> drop_floating(const Domain& domain, const ScalarField& field, int layer_count,
                                                  const Solid& solid, double min_piece_area_mm2,
                                                  const std::vector<TrimmedSheet*>& sheets, const RunContext& run);

}  // namespace curvesup
