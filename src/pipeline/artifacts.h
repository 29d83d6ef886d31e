#pragma once

#include <string>

#include "curvesup/domain/domain.h"
#include "curvesup/io/text_file.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/skeleton/skeleton.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// The VTK files of the output; arrays as the contract of the output names them. Layers and toolpaths are large, so no
// copy of them is made; their numbers are Float32.
[[nodiscard]] std::string domain_vtu(const Domain& domain, const ScalarField& field);
void write_layers_vtp(const LayerStack& stack, const ScalarField& field, const ByteSink& sink);
void write_skeleton_vtp(const Skeleton& skeleton, const ByteSink& sink);
void write_toolpaths_vtp(const Toolpaths& toolpaths, const ByteSink& sink);

// Thickness of a layer triangle: 1 / (N m |grad G|), or the height of the bead's top above the platform where that is less.
[[nodiscard]] double printed_height(const LayerStack& stack, const Sheet& sheet, const ScalarField& field, Index triangle);

}  // namespace curvesup
