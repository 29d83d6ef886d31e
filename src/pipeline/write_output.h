#pragma once

#include <span>
#include <vector>

#include "curvesup/io/output_folder.h"
#include "curvesup/preview/plots.h"
#include "slice_state.h"

namespace curvesup {

// Writes every artifact of the stages that have run; the text of the robot's programs goes with it. Gives the plots, which
// are drawn meanwhile.
[[nodiscard]] std::vector<Plot> write_artifacts(OutputFolder& folder, SliceState& state, const RunContext& run);

// Writes plots and preview.html, which lists the files so far.
void write_pictures(OutputFolder& folder, const SliceState& state, std::span<const Plot> plots, const Json& report, const RunContext& run);

// Writes manifest.json over all files so far, then report.json.
void write_index(OutputFolder& folder, const SliceState& state, const Json& report);

}  // namespace curvesup
