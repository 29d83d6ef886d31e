#include "curvesup/pipeline/compare.h"

#include <memory>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "options.h"
#include "stages.h"

namespace curvesup {

namespace {

void run_named(SliceState& state, std::string_view first, std::string_view last, const RunContext& run) {
  bool on = false;
  for (const Stage& stage : slice_stages()) {
    on = on || stage.name == first;
    if (on) {
      run.check_stop();
      stage.run(state, run);
    }
    if (stage.name == last) return;
  }
}

// Everything is inside: the support's layers stay untrimmed.
class WholeDomain final : public Solid {
 public:
  [[nodiscard]] double value(const Vec3&) const override { return 1.0; }
  [[nodiscard]] Bounds bounds(const Vec3&, double) const override { return {1.0, 1.0}; }
};

CompareRow measure(SliceState state, std::string method, const RunContext& run) {
  run_named(state, "trim", "certificate", run);
  const Json& support = state.report["support"];
  const ToolpathReport& toolpath = state.toolpath.report;
  return {.method = std::move(method),
          .volume_mm3 = state.trim.report.printed_volume_mm3[1],
          .area_mm2 = support["area_mm2"].get<double>(),
          .pieces = state.trim.report.support_pieces,
          .covered_fraction = support["covered_overhang_fraction"].get<double>(),
          .path_mm = toolpath.length_mm[1],
          .time_s = toolpath.time_s,
          .material_changes = toolpath.material_changes};
}

}  // namespace

CompareResult compare(const SliceRequest& request, const RunContext& run) {
  SliceState shared(request);
  run_named(shared, "load", "skeleton", run);
  CompareResult result;
  result.model = shared.model.model.name;
  if (!shared.supported) {
    throw Error(ErrorKind::usage, "compare", "the model gets no support: it has no overhang, or support.method is none",
                "compare a model with an overhang");
  }

  const SolidOptions options = solid_options(shared.config);
  const auto with_solid = [&](SupportMethod method, double alpha_mm) {
    SliceState state = shared;
    state.config["support"]["method"] = method == SupportMethod::envelope ? "envelope" : "tree";
    state.config["support"]["envelope_alpha_mm"] = alpha_mm;
    run_named(state, "solid", "solid", run);
    return state;
  };
  for (const double factor : {0.5, 1.0, 2.0}) {
    const double alpha = factor * options.envelope_alpha_mm;
    result.rows.push_back(measure(with_solid(SupportMethod::envelope, alpha), "envelope, alpha " + shortest(alpha) + " mm", run));
  }
  const double baseline = result.rows[1].volume_mm3;
  result.rows.push_back(measure(with_solid(SupportMethod::tree, options.envelope_alpha_mm), "tree", run));

  SliceState untrimmed = shared;
  untrimmed.solid = std::make_shared<WholeDomain>();
  result.rows.push_back(measure(std::move(untrimmed), "no trimming", run));

  SliceState none = shared;
  none.supported = false;
  none.domain = domain_without_support(none.model.model);
  none.extension.field = none.field.field;
  none.layers = slice_layers(none.domain.domain, none.extension.field, none.layer_count, run);
  result.rows.push_back(measure(std::move(none), "none", run));

  for (CompareRow& row : result.rows) row.reduction = baseline > 0.0 ? 1.0 - row.volume_mm3 / baseline : 0.0;
  return result;
}

std::string compare_table(const CompareResult& result) {
  std::string text = format("| %-22s | volume cm3 | against envelope | area cm2 | pieces | covered %% | path m | print h | changes |\n", result.model.c_str());
  text += "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n";
  for (const CompareRow& row : result.rows) {
    text += format("| %-22s | %10.2f | %+15.1f%% | %8.1f | %6ld | %9.2f | %6.1f | %7.2f | %7ld |\n", row.method.c_str(),
                   row.volume_mm3 / 1000.0, 0.0 - 100.0 * row.reduction, row.area_mm2 / 100.0, row.pieces, 100.0 * row.covered_fraction,
                   row.path_mm / 1000.0, row.time_s / 3600.0, row.material_changes);
  }
  return text;
}

std::string compare_csv(const CompareResult& result) {
  std::string text = "model,method,volume_mm3,reduction,area_mm2,pieces,covered_fraction,path_mm,time_s,material_changes\n";
  for (const CompareRow& row : result.rows) {
    text += format("%s,\"%s\",%.3f,%.5f,%.3f,%ld,%.6f,%.2f,%.1f,%ld\n", result.model.c_str(), row.method.c_str(), row.volume_mm3,
                   row.reduction, row.area_mm2, row.pieces, row.covered_fraction, row.path_mm, row.time_s, row.material_changes);
  }
  return text;
}

Json compare_json(const CompareResult& result) {
  Json rows = Json::array();
  for (const CompareRow& row : result.rows) {
    rows.push_back({{"method", row.method}, {"volume_mm3", row.volume_mm3}, {"reduction", row.reduction}, {"area_mm2", row.area_mm2},
                    {"pieces", row.pieces}, {"covered_fraction", row.covered_fraction}, {"path_mm", row.path_mm},
                    {"time_s", row.time_s}, {"material_changes", row.material_changes}});
  }
  return {{"model", result.model}, {"rows", rows}};
}

}  // namespace curvesup
