#include "curvesup/pipeline/slice.h"

#include <algorithm>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/io/output_folder.h"
#include "core/memory.h"
#include "slice_state.h"
#include "stage_meter.h"
#include "stages.h"
#include "write_output.h"

namespace curvesup {

namespace {

// The one way a stage runs: interruption checked, timed, logged, its checks counted.
StageTime run_stage(const Stage& stage, SliceState& state, const RunContext& run) {
  run.check_stop();
  const std::size_t checks_before = state.checks.size();
  const StageMeter meter;
  stage.run(state, run);
  release_free_memory();
  const StageTime time = meter.stop(stage.name);
  run.log(LogLevel::debug, format("%s: %.3f s", stage.name, time.wall_s));
  for (std::size_t i = checks_before; i < state.checks.size(); ++i) {
    const Check& check = state.checks[i];
    if (!check.ok) {
      run.log(LogLevel::warning, "check " + check.name + " failed: " + shortest(check.value) + " (limit " +
                                     shortest(check.limit) + ") " + check.detail);
    }
  }
  return time;
}

Json checks_json(const std::vector<Check>& checks) {
  Json list = Json::array();
  for (const Check& check : checks) {
    list.push_back({{"name", check.name}, {"ok", check.ok}, {"value", check.value}, {"limit", check.limit}, {"detail", check.detail}});
  }
  return list;
}

Json times_json(const std::vector<StageTime>& times) {
  Json list = Json::array();
  for (const StageTime& time : times) {
    list.push_back({{"name", time.name}, {"wall_s", time.wall_s}, {"cpu_s", time.cpu_s}, {"peak_mb", time.peak_mb}});
  }
  return list;
}

}  // namespace

std::vector<std::string> slice_stage_names() {
  std::vector<std::string> names;
  for (const Stage& stage : slice_stages()) names.emplace_back(stage.name);
  return names;
}

SliceOutcome slice(const SliceRequest& request, const RunContext& outer) {
  SliceState state(request);
  OutputFolder folder(request.out);
  state.spool_folder = folder.working_path();

  SliceOutcome outcome;
  double done = 0.0;
  for (const Stage& stage : slice_stages()) {
    RunContext run = outer;
    run.progress_sink = [&](double fraction) {
      if (request.on_progress) request.on_progress(done + stage.share * std::clamp(fraction, 0.0, 1.0), stage.name);
    };
    run.progress(0.0);
    outcome.times.push_back(run_stage(stage, state, run));
    ++state.stages_done;
    done += stage.share;
    if (request.stop_after == stage.name) break;
  }

  const StageMeter meter;
  outcome.ok = state.robot_ok() && std::all_of(state.checks.begin(), state.checks.end(), [](const Check& c) { return c.ok; });
  outcome.exit_code = !state.robot_ok() ? exit_code(ErrorKind::robot) : outcome.ok ? 0 : 1;
  outcome.report = {{"program", {{"name", "curvesup"}, {"version", CURVESUP_VERSION}}},
                    {"input", {{"model", request.model_file.filename().string()}, {"sha256", state.input_sha256}}},
                    {"ok", outcome.ok},
                    {"checks", checks_json(state.checks)},
                    {"stages", Json::array()}};
  for (const auto& [name, section] : state.report.items()) outcome.report[name] = section;
  const std::vector<Plot> plots = write_artifacts(folder, state, outer);
  write_pictures(folder, state, plots, outcome.report, outer);
  outcome.times.push_back(meter.stop("write"));
  outcome.report["stages"] = times_json(outcome.times);
  write_index(folder, state, outcome.report);
  outer.check_stop();
  folder.commit();
  if (request.on_progress) request.on_progress(1.0, "done");
  return outcome;
}

}  // namespace curvesup
