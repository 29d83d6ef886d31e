#pragma once

#include "curvesup/skeleton/grow_skeleton.h"

namespace curvesup {

// Points of the overhang, by face, that do not hang on how it is divided into triangles: where lines of a fixed grid meet its
// faces, where planes of the grid meet its border, and the border's corners; neighbours are about `step_mm` apart.
[[nodiscard]] std::vector<LeafSite> sample_overhang(const Model& model, const ScalarField& field, const Overhang& overhang,
                                                    double step_mm);

}  // namespace curvesup
