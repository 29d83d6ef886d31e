#pragma once

#include "curvesup/core/report.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"

namespace curvesup {

struct LayersReport {
  Index model_layers = 0, support_layers = 0;  // with any area above z = 0
  Index triangles = 0, degenerate_triangles = 0;
  double thickness_p1_mm = 0.0, thickness_p50_mm = 0.0, thickness_p99_mm = 0.0;  // of the model's layers, by area
  std::vector<Check> checks;
};

struct LayersResult {
  LayerStack stack;  // model and untrimmed support, one pass each, clipped at z = 0
  LayersReport report;
};

// Iso-surfaces G = (k + 1/2) / N for every integer k that G reaches. A vertex with value >= iso is above.
[[nodiscard]] LayersResult slice_layers(const Domain& domain, const ScalarField& field, int layer_count,
                                        const RunContext& run = {});

}  // namespace curvesup
