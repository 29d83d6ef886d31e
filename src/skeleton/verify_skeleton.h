#pragma once

#include "curvesup/skeleton/grow_skeleton.h"

namespace curvesup {

// Walks every edge again, counts what the guarantees of grow_skeleton forbid, and adds counts and checks to the report.
void verify_skeleton(const Domain& domain, const ScalarField& field, int layer_count, const SkeletonOptions& options,
                     const Skeleton& skeleton, SkeletonReport& report, const RunContext& run);

}  // namespace curvesup
