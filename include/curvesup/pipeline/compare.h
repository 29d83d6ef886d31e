#pragma once

#include <string>
#include <vector>

#include "curvesup/pipeline/slice.h"

namespace curvesup {

// One way to support the model, measured under one definition.
struct CompareRow {
  std::string method;       // "envelope alpha 8", "tree", "untrimmed", "none"
  double volume_mm3 = 0.0;  // sum of area times platform-clipped height of the printed support
  double area_mm2 = 0.0;
  long pieces = 0;
  double covered_fraction = 0.0;
  double path_mm = 0.0;     // support
  double time_s = 0.0;      // whole print, estimate
  long material_changes = 0;
  double reduction = 0.0;   // of volume against the envelope at the configured alpha
};

struct CompareResult {
  std::string model;
  std::vector<CompareRow> rows;
};

// The tree against the envelope baseline at half, once and twice the configured alpha, untrimmed layers and no support. All rows
// share domain, field, layers and leaves. Throws Error as slice does.
[[nodiscard]] CompareResult compare(const SliceRequest& request, const RunContext& run = {});

[[nodiscard]] std::string compare_table(const CompareResult& result);  // for a terminal, and valid Markdown
[[nodiscard]] std::string compare_csv(const CompareResult& result);
[[nodiscard]] Json compare_json(const CompareResult& result);

}  // namespace curvesup
