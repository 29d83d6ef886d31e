#include "toolpath/toolpath_checks.h"

#include <cmath>

namespace curvesup::toolpath {

bool sparse(const MaterialToolpathOptions& material, const ToolpathOptions& options) {
  return material.line_spacing_mm && *material.line_spacing_mm > options.bead_width_mm;
}

std::vector<Check> toolpath_checks(const ToolpathReport& report, const ToolpathOptions& options) {
  std::vector<Check> checks;
  checks.push_back(check_equal("toolpath.pieces_without_path", report.pieces_without_path, 0,
                               "every piece of every layer has a path"));
  checks.push_back(check_at_most("toolpath.max_flow_mm3_s", report.max_flow_mm3_s, options.max_flow_mm3_s * (1.0 + 1e-9),
                                 "fastest flow, width times height times speed"));
  for (int m = 0; m < kMaterialCount; ++m) {
    if (sparse(options.material[m], options)) continue;  // open on purpose; certificate.toolpath_coverage looks at the lines
    const double layers = report.layer_volume_mm3[m];
    const double off = layers > 0.0 ? std::abs(report.volume_mm3[m] / layers - 1.0) : 0.0;
    checks.push_back(check_at_most(m == 0 ? "toolpath.model_volume" : "toolpath.support_volume", off, 0.01,
                                   "bead volumes against area times thickness, relative"));
  }
  if (options.min_height_mm) {
    checks.push_back(check_at_least("toolpath.min_height_mm", report.min_height_mm, *options.min_height_mm,
                                    "lowest bead"));
  }
  if (options.max_height_mm) {
    checks.push_back(check_at_most("toolpath.max_height_mm", report.max_height_mm, *options.max_height_mm,
                                   "highest bead"));
  }
  return checks;
}

}  // namespace curvesup::toolpath
