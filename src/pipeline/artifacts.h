#pragma once

#include <string>

#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/skeleton/skeleton.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// The VTK files of the output, as bytes; arrays as the contract of the output names them.
[[nodiscard]] std::string domain_vtu(const Domain& domain, const ScalarField& field);
[[nodiscard]] std::string layers_vtp(const LayerStack& stack, const ScalarField& field);
[[nodiscard]] std::string skeleton_vtp(const Skeleton& skeleton);
[[nodiscard]] std::string toolpaths_vtp(const Toolpaths& toolpaths);

// Thickness of a layer triangle: 1 / (N m |grad G|), or the height of the bead's top above the platform where that is less.
[[nodiscard]] double printed_height(const LayerStack& stack, const Sheet& sheet, const ScalarField& field, Index triangle);

}  // namespace curvesup
