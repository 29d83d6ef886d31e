#pragma once

#include <span>
#include <string>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/motion/machine.h"
#include "curvesup/motion/motion.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// One picture: `png` is the whole file <name>.png, `caption` a sentence on how to read it.
struct Plot {
  std::string name, title, caption;
  std::string png;
};

// What a finished run can be drawn from. A null pointer is a stage that has not run: plots that need it are left out.
struct PlotInput {
  const ScalarField* field = nullptr;  // on the domain; needed with layers
  const LayerStack* layers = nullptr;  // as printed
  const Toolpaths* toolpaths = nullptr;
  const Motion* motion = nullptr;  // null or empty: times come from feeds and an assumed travel speed
  Arm arm{};                       // of the singularity metric
};

// Plots: histogram of the layer thickness by printed area, support volume by layer, bead height and tilt along the print, time
// by material, joint angles and singularity metric by time, in this order. Drawn without a display; the same input gives
// the same bytes (with the same font installed). Linear in triangles and points.
[[nodiscard]] std::vector<Plot> make_plots(const PlotInput& input, const RunContext& run = {});

}  // namespace curvesup
