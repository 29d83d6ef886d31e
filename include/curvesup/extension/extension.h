#pragma once

#include "curvesup/domain/domain.h"

namespace curvesup {

struct ExtensionOptions {
  double floor_weight = 1.0;     // 1/mm^2; "gradient = (0, 0, median)" in a layer of 1.25 mm at the floor of the hull
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

// Paper, section II-B: G~ = G on the interface. Minimises, over the free vertices, the sum of
//   A²/(V1+V2) · (jump of the normal derivative)²  over faces between support tets and over interface faces, where the far
//                                                  side is the model's own gradient (about the integral of |D²G|²),
//   floor_weight · A · 1.25 mm · |grad G - (0,0,median)|²  over the floor faces of the hull, whatever the size of the tets:
//                                                  with their volumes instead, coarse tets pull as a larger weight does,
//   outflow_weight · A²/V · (normal derivative)²   over the other hull faces that -grad G leaves, chosen anew each round.
// The floor term, not the outflow term, decides how thick the layers under wide overhangs get: the stronger it is, the fewer
// layers there are and the thicker the columns. Measured on a shell, an arch bridge and a branching frame of 80, 150 and
// 100 layers (support layers above the platform; thickness p99 in mm; false extrema):
//   weight 0.1: 91, -, 252; 1.9, -, 0.6; none                 0.3: 91, 173, -; 2.0, 1.8, -; none
//   weight 1:   91, 167, 245;        2.0, 3.2, 0.6; none      3:   89, 158, -; 2.1, 4.8, -; 8 on the bridge
// With a weak floor, outflow weights of 1 to 100 change the thickness by less than 1 %; 0 lets 2 % of the frame's columns
// out of the hull.
// O(n^1.5) factorisation; the same bytes for any thread count. Throws Error{solver}.
[[nodiscard]] ExtensionResult extend_field(const Domain& domain, const ScalarField& model_field, int layer_count,
                                           const ExtensionOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
