#pragma once

#include "curvesup/io/output_folder.h"
#include "slice_state.h"

namespace curvesup {

// Writes every artifact of the stages that have run; the text of the robot's programs goes from memory with it.
void write_artifacts(OutputFolder& folder, SliceState& state, const RunContext& run);

// Writes plots and preview.html, which list the files so far.
void write_pictures(OutputFolder& folder, const SliceState& state, const Json& report, const RunContext& run);

// Writes manifest.json over all files so far, then report.json.
void write_index(OutputFolder& folder, const SliceState& state, const Json& report);

}  // namespace curvesup
