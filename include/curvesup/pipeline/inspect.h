#pragma once

#include <string>

#include "curvesup/model/diagnose.h"

namespace curvesup {

// The diagnosis of a model file for a terminal: counts, quality, and every problem with the first ids and the remedy.
[[nodiscard]] std::string diagnosis_text(const std::string& name, const MeshDiagnosis& diagnosis);

}  // namespace curvesup
