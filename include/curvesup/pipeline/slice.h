#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/pipeline/config.h"

namespace curvesup {

struct StageTime {
  std::string name;
  double wall_s = 0.0, cpu_s = 0.0, peak_mb = 0.0;
};

struct SliceRequest {
  std::filesystem::path model_file;
  ConfigSource config;
  std::filesystem::path out;
  std::string stop_after;  // name of a stage; empty: all
  std::function<void(double fraction, std::string_view stage)> on_progress;  // of the whole run, 0..1
};

struct SliceOutcome {
  bool ok = false;   // every check passed
  int exit_code = 0;  // 0, 1 (a check failed) or 6 (robot)
  Json report;        // what report.json holds
  std::vector<StageTime> times;
};

// Names of the stages in their order.
[[nodiscard]] std::vector<std::string> slice_stage_names();

// From a model file to the complete folder `out`: everything is computed first and then moved into place, so `out` is
// written completely or not at all. Throws Error; a robot that cannot reach or would collide is no exception but exit code
// 6: everything but robot/ and duet/ is written then.
[[nodiscard]] SliceOutcome slice(const SliceRequest& request, const RunContext& run = {});

// The one screen that `slice` ends with.
[[nodiscard]] std::string summary_text(const SliceOutcome& outcome, const std::filesystem::path& out);

}  // namespace curvesup
