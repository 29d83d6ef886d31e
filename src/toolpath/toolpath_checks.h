#pragma once

#include <vector>

#include "curvesup/toolpath/plan_toolpaths.h"

namespace curvesup::toolpath {

// Whether lines of a material may leave room between them.
[[nodiscard]] bool sparse(const MaterialToolpathOptions& material, const ToolpathOptions& options);

// What a finished report must hold.
[[nodiscard]] std::vector<Check> toolpath_checks(const ToolpathReport& report, const ToolpathOptions& options);

}  // namespace curvesup::toolpath
