#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/model/model.h"

namespace curvesup {

enum class FieldSource { direction, scalar_file, vector_file };

struct FieldOptions {
  FieldSource source = FieldSource::direction;
  Vec3 direction = Vec3::UnitZ();  // of source `direction`, in the placed frame; any length but 0
};

// What was read from the field's file; empty for source `direction`.
struct FieldInput {
  std::vector<double> vertex_value;  // scalar_file: one a vertex of the file, in its order
  std::vector<Vec3> tet_vector;      // vector_file: one a tet of the file, in its order and in the file's frame
  std::string where = "field";       // the file that errors name
};

struct FieldReport {
  bool flipped = false;                                      // 1 - G is used, because the given field runs downward
  double input_min = 0.0, input_max = 0.0;                   // before normalising
  double grad_min = 0.0, grad_median = 0.0, grad_max = 0.0;  // |grad G| in 1/mm, median weighted by volume
  std::vector<Index> weak_tets;                              // |grad G| below a thousandth of the median
  // grad G points against the given vector (vector_file) or against the mean of the face neighbours' gradients.
  std::vector<Index> inverted_tets;
  std::vector<Index> interior_minima, interior_maxima;  // vertices off the boundary; a plateau counts once
  double solve_residual = 0.0;                          // relative, of equation 1 (vector_file)
};

struct FieldResult {
  ScalarField field;  // G on the placed model: from 0 to 1 exactly, growing upward
  FieldReport report;
};

// The governing field G on the model (paper, section II-A, equation 1).
//   direction    linear along the direction
//   scalar_file  the given values
//   vector_file  least squares: the volume-weighted sum of |grad G - v|^2 is smallest; one SPD solve
// mapped linearly to [0, 1] over the vertices that tets use. When the mean value at the lowest vertices lies above that
// at the highest ones, 1 - G is taken. Unreferenced vertices get 0. Throws Error{input} on a wrong number of values, a
// value that is no finite number, or a constant field; Error{usage} on a direction of no length; Error{solver}.
[[nodiscard]] FieldResult compute_field(const Model& model, const FieldInput& input, const FieldOptions& options = {},
                                        const RunContext& run = {});

// Layers that close around a vertex inside the model, the lowest or highest of G there: nothing carries them or no nozzle gets in.
struct ClosedLayers {
  Index vertex = kNone;
  bool around_minimum = false;
  int count = 0;
};

// Of the report's interior extrema the one that most layers close around, before they reach the model's boundary or a lower
// (higher) place; none when no layer's value lies between.
[[nodiscard]] std::optional<ClosedLayers> find_closed_layers(const Model& model, const ScalarField& field, const FieldReport& report,
                                                             int layer_count);

// Volume-weighted median of |grad G|.
[[nodiscard]] double median_gradient(const Model& model, const ScalarField& field);

// N = max(1, round(1 / (t * median |grad G|))): so many layers that the median one is t thick. Throws Error{usage} when
// t is not above 0 or asks for more than a million layers.
[[nodiscard]] int layer_count_for_thickness(const Model& model, const ScalarField& field, double thickness_mm);

}  // namespace curvesup
