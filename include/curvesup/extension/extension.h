#pragma once

#include "curvesup/domain/domain.h"

namespace curvesup {

struct ExtensionOptions {
  double floor_weight = 0.1;     // "gradient = (0, 0, median)" in support tets that touch the floor of the hull
  double outflow_weight = 10.0;  // one-sided, on side faces of the hull where -grad G leaves it
  int outflow_rounds = 2;
};

struct ExtensionReport {
  Index unknowns = 0;
  double residual = 0.0;  // relative, of the last solve
  Index false_extrema = 0;  // at free vertices off the hull and the floor
  Index hull_extrema = 0;
  double thickness_p1_mm = 0.0, thickness_p50_mm = 0.0, thickness_p99_mm = 0.0;  // of the support domain, by volume
  std::vector<Check> checks;
};

struct ExtensionResult {
  ScalarField field;  // on the whole domain; on model vertices exactly the model's values
  ExtensionReport report;
};

// Paper, section II-B: G~ = G on the interface. Energy: see src/extension/README or the .cpp. O(n^1.5) factorisation.
// Throws Error{solver}.
[[nodiscard]] ExtensionResult extend_field(const Domain& domain, const ScalarField& model_field, int layer_count,
                                           const ExtensionOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
