#pragma once

#include <span>

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

// Iso-surfaces G = (k + 1/2) / N for every integer k that G reaches, by marching tetrahedra over model and support with one
// set of edge crossings: the model's and the support's sheet of one k share the vertices of their common border exactly.
// A vertex with value >= iso is above, values are never moved; so every sheet is an oriented manifold, at the price of a few
// triangles without area where a vertex lies on the surface (`degenerate_triangles`). Cut at the platform: nothing is below
// z = 0, and the cut has z = 0 exactly. O(tets + triangles). Same bytes for any thread count.
// Throws Error{geometry} when layer_count is not positive or the field does not fit the domain.
[[nodiscard]] LayersResult slice_layers(const Domain& domain, const ScalarField& field, int layer_count,
                                        const RunContext& run = {});

// One iso-surface to extract: pass j of m of layer k, see Sheet.
struct Level {
  Index layer = 0;
  int pass = 0;
  int passes = 1;
  double iso_value = 0.0;
};

// G = (k + (j + 1/2) / m) / N.
[[nodiscard]] inline Level make_level(Index layer, int pass, int passes, int layer_count) {
  return {layer, pass, passes, (layer + (pass + 0.5) / passes) / layer_count};
}

// The same extraction for any levels, given in ascending order of iso_value (equal values give separate sheets), in the
// given tets only. The vertices of a level are consecutive. Sheets without triangles are left out.
[[nodiscard]] LayerStack extract_levels(const Domain& domain, const ScalarField& field, int layer_count,
                                        std::span<const Level> levels, std::span<const Index> tets,
                                        const RunContext& run = {});

// 1 / (N m |grad G|) of the tet in which a triangle lies; infinite where the gradient vanishes.
[[nodiscard]] double local_thickness(const LayerStack& stack, const ScalarField& field, const Sheet& sheet, Index triangle);

}  // namespace curvesup
