#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/model/model.h"
#include "curvesup/motion/motion.h"
#include "curvesup/overhang/overhang.h"
#include "curvesup/preview/plots.h"
#include "curvesup/skeleton/skeleton.h"
#include "curvesup/toolpath/plan_toolpaths.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// A place that a check speaks of; a click on the check flies there, the next click to its next place.
struct PreviewMark {
  std::string check;  // Check::name
  Vec3 position = Vec3::Zero();
  std::string text;    // what is the matter there
  Index path = kNone;  // of the toolpaths: the print is shown as it stands when this path is laid
  std::optional<Index> layer = {};  // or: the layers are shown up to this one
};

struct PreviewFile {
  std::string path;  // relative to the output folder
  std::uint64_t bytes = 0;
  std::string what;  // one sentence
};

// What a page shows. Views only: everything must outlive the call. A null pointer is a stage that has not run.
struct PreviewInput {
  const Model* model = nullptr;
  const Overhang* overhang = nullptr;
  const Skeleton* skeleton = nullptr;
  const LayerStack* layers = nullptr;  // as printed
  const Toolpaths* toolpaths = nullptr;
  const Motion* motion = nullptr;  // may be empty: then times are made from feeds, and the nozzle follows the normal
  std::span<const Check> checks;
  std::span<const PreviewMark> marks;
  std::span<const Plot> plots;
  std::span<const PreviewFile> files;
  std::string report_json;  // report.json; its `stages` (times) and `checks` are left out of the page
  std::string config_json;  // config.resolved.json
};

struct PreviewOptions {
  std::string title = "curvesup";
  double path_tolerance_mm = 0.05;     // by which drawn toolpaths may leave the planned ones
  double outline_tolerance_mm = 0.1;   // the same for layer borders
  int layer_triangles = 150000;        // of each material, about
  std::size_t max_bytes = 28'000'000;  // coarser until the page is smaller
  Angle nozzle_half_angle = Angle::degrees(30);
  double nozzle_length_mm = 25.0;
};

// One HTML file that needs nothing else: opens from disk without network in any browser with WebGL. Positions are
// rounded to 1/65535 of the scene. No wall times: the same input gives the same bytes. Linear in the input.
// Throws Error{internal} when report_json or config_json is no JSON.
[[nodiscard]] std::string preview_html(const PreviewInput& input, const PreviewOptions& options = {},
                                       const RunContext& run = {});

// The places of checks as the stages report them, ready for PreviewInput::marks.
[[nodiscard]] std::vector<PreviewMark> marks_of(const MotionReport& report);
[[nodiscard]] std::vector<PreviewMark> marks_of(const ToolpathReport& report);

}  // namespace curvesup
