#include "write_output.h"

#include <algorithm>
#include <map>

#include "artifacts.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/preview/plots.h"
#include "curvesup/preview/preview.h"
#include "curvesup/core/error.h"
#include "curvesup/pipeline/machine_config.h"

namespace curvesup {

namespace {

bool wanted(const SliceState& state, const std::string& artifact) {
  const Json& list = config_value(state.config, "output.artifacts");
  return std::find(list.begin(), list.end(), Json(artifact)) != list.end();
}

bool done(const SliceState& state, std::string_view stage) {
  const auto names = slice_stage_names();
  const auto at = std::find(names.begin(), names.end(), stage);
  return at != names.end() && static_cast<std::size_t>(at - names.begin()) < state.stages_done;
}

template <class Result>
const Result* if_done(const SliceState& state, std::string_view stage, const Result& result) {
  return done(state, stage) ? &result : nullptr;
}

const LayerStack& final_layers(const SliceState& state) { return done(state, "trim") ? state.trim.stack : state.layers.stack; }

const Motion* final_motion(const SliceState& state) { return state.robot_ok() ? if_done(state, "motion", state.motion.motion) : nullptr; }

std::vector<Plot> plots_of(const SliceState& state, const RunContext& run) {
  if (!done(state, "layers") || (!wanted(state, "plots") && !wanted(state, "preview"))) return {};
  const Machine machine = machine_from_config(config_value(state.config, "machine"));
  return make_plots({.field = &state.extension.field,
                     .layers = &final_layers(state),
                     .toolpaths = if_done(state, "toolpath", state.toolpath.toolpaths),
                     .motion = final_motion(state),
                     .arm = machine.arm},
                    run);
}

const char* const kDescriptions[][2] = {
    {"config.resolved.json", "every config key with its value"},
    {"domain.vtu", "tets of model and support domain with G"},
    {"layers.vtp", "all printed layers as triangles"},
    {"skeleton.vtp", "the support tree"},
    {"toolpaths.vtp", "one polyline a path, in print order"},
};

std::string description_of(const std::string& path, const SliceState& state) {
  for (const auto& [name, text] : kDescriptions) {
    if (path == name) return text;
  }
  for (const EmittedFile& file : state.emitted.files) {
    if (path == file.name) return file.description;
  }
  if (path == "preview.html") return "open it in a browser: part, support, layers, toolpaths, checks, report";
  if (path.starts_with("plots/")) return "a plot of the report";
  if (path.starts_with("waypoints/")) return "waypoints of one path";
  return {};
}

Json parts_json(const std::vector<EmittedPart>& parts) {
  Json list = Json::array();
  for (const EmittedPart& part : parts) {
    Json paths = Json::array(), sections = Json::array();
    for (const EmittedChain& chain : part.chains) {
      paths.push_back(chain.path);
      if (chain.sections > 1) sections.push_back({{"path", chain.path}, {"section", chain.section}, {"sections", chain.sections}});
    }
    list.push_back({{"file", part.file}, {"paths", paths}, {"sections", sections}, {"moves", part.moves},
                    {"expected_s", part.expected_s}, {"duet_offset", part.duet_offset}});
  }
  return list;
}

}  // namespace

std::vector<Plot> write_artifacts(OutputFolder& folder, SliceState& state, const RunContext& run) {
  std::vector<OutputFolder::Task> tasks;
  const auto add = [&](std::string name, std::function<void(const ByteSink&)> produce) {
    tasks.push_back({std::move(name), std::move(produce)});
  };
  add("config.resolved.json", [&](const ByteSink& sink) { sink(state.config.dump(2) + "\n"); });
  const ScalarField& field = state.extension.field;
  if (done(state, "extension") && wanted(state, "domain")) {
    add("domain.vtu", [&](const ByteSink& sink) { sink(domain_vtu(state.domain.domain, field)); });
  }
  if (done(state, "layers") && wanted(state, "layers")) {
    add("layers.vtp", [&](const ByteSink& sink) { write_layers_vtp(final_layers(state), field, sink); });
  }
  if (done(state, "skeleton") && wanted(state, "skeleton")) {
    add("skeleton.vtp", [&](const ByteSink& sink) { write_skeleton_vtp(state.skeleton.skeleton, sink); });
  }
  if (done(state, "toolpath") && wanted(state, "toolpaths")) {
    add("toolpaths.vtp", [&](const ByteSink& sink) { write_toolpaths_vtp(state.toolpath.toolpaths, sink); });
  }
  for (const EmittedFile& file : state.emitted.files) {
    if (wanted(state, file.name.starts_with("duet/") ? "duet" : "robot")) add(file.name, file.write);
  }
  const bool waypoints = done(state, "motion") && config_value(state.config, "output.waypoints").get<bool>();
  if (waypoints) {
    const Machine machine = machine_from_config(config_value(state.config, "machine"));
    for (EmittedFile& file : emit_waypoints(state.toolpath.toolpaths, state.motion.motion, machine)) add(file.name, std::move(file.write));
  }
  // Of a print that the robot cannot make, nothing more is told by its poses.
  if (!state.robot_ok() && !waypoints) state.motion.motion = {};
  // One large file keeps one thread busy; the plots are drawn by another one.
  std::vector<Plot> plots;
  parallel_for(2, 1, run, [&](std::size_t i, std::size_t, std::size_t) {
    if (i == 0) folder.write_all(tasks, run);
    else plots = plots_of(state, run);
  });
  // The text has its place; the names are still asked for.
  for (EmittedFile& file : state.emitted.files) file.write = {};
  return plots;
}

namespace {

std::vector<PreviewMark> certificate_marks(const SliceState& state) {
  std::vector<PreviewMark> marks;
  for (const auto& piece : state.certificate.floating) {
    marks.push_back({"certificate.floating_pieces", piece.centroid, format("layer %d: %.2f mm2 rest on nothing", piece.layer, piece.area_mm2), kNone, piece.layer});
  }
  const ToolpathCertificate& paths = state.toolpath_certificate;
  const auto mark = [&](const char* check, const ToolpathCertificate::PlaceOnLayer& place, const char* what) {
    const char* material = place.material == Material::model ? "part" : "support";
    marks.push_back({check, place.position, format("layer %d of the %s: %s", place.layer, material, what), kNone, place.layer});
  };
  for (const auto& place : paths.uncovered) mark("certificate.toolpath_coverage", place, "no bead here");
  for (const auto& place : paths.leaving) mark("certificate.toolpath_segments_on_layer", place, "a line leaves the layer");
  for (const auto& place : paths.pieces_without_path) mark("certificate.toolpath_pieces", place, "a region without a line");
  if (paths.wrong_heights > 0) mark("certificate.toolpath_height", paths.worst_height, "the bead is not as high as the layer is thick");
  if (paths.max_layer_volume_error > 0.0) mark("certificate.toolpath_layer_volume", paths.worst_layer, "too much or too little plastic in the layer");
  if (paths.points_off_layer > 0) mark("certificate.toolpath_points_on_layer", paths.farthest_point, "farthest from the layer");
  const auto& model = state.model.model;
  for (const auto& face : state.certificate.uncovered) {
    const auto& v = model.boundary[face.face].vertices;
    const Vec3 centre = (model.mesh.vertices[v[0]] + model.mesh.vertices[v[1]] + model.mesh.vertices[v[2]]) / 3.0;
    marks.push_back({"certificate.coverage", centre, format("face %d: %.3f mm2 without support", face.face, face.area_mm2)});
  }
  return marks;
}

// What a person calls the part: files named model.tet differ by their folder.
std::string title_of(const SliceState& state) {
  const std::string name = state.model.model.name;
  const auto folder = std::filesystem::absolute(state.request.model_file).lexically_normal().parent_path().filename();
  return name == "model" && !folder.empty() ? folder.string() : name;
}

}  // namespace

void write_pictures(OutputFolder& folder, const SliceState& state, std::span<const Plot> plots, const Json& report, const RunContext& run) {
  if (!done(state, "layers")) return;
  if (wanted(state, "plots")) {
    for (const Plot& plot : plots) folder.write("plots/" + plot.name + ".png", plot.png);
  }
  if (!wanted(state, "preview")) return;

  std::vector<PreviewFile> files;
  for (const OutputFolder::File& file : folder.files()) files.push_back({file.path, file.bytes, description_of(file.path, state)});
  std::vector<PreviewMark> marks = certificate_marks(state);
  for (const auto& more : {marks_of(state.motion.report), marks_of(state.toolpath.report)}) marks.insert(marks.end(), more.begin(), more.end());
  const Machine machine = machine_from_config(config_value(state.config, "machine"));
  folder.write("preview.html",
               preview_html({.model = &state.model.model,
                             .overhang = &state.overhang,
                             .skeleton = if_done(state, "skeleton", state.skeleton.skeleton),
                             .layers = &final_layers(state),
                             .toolpaths = if_done(state, "toolpath", state.toolpath.toolpaths),
                             .motion = final_motion(state),
                             .checks = state.checks,
                             .marks = marks,
                             .plots = plots,
                             .files = files,
                             .report_json = report.dump(),
                             .config_json = state.config.dump()},
                            {.title = title_of(state), .nozzle_half_angle = machine.tool.cone_half_angle, .nozzle_length_mm = machine.tool.cone_length_mm}, run));
}

void write_index(OutputFolder& folder, const SliceState& state, const Json& report) {
  Json files = Json::array();
  for (const OutputFolder::File& file : folder.files()) {
    files.push_back({{"path", file.path}, {"bytes", file.bytes}, {"sha256", file.sha256}, {"what", description_of(file.path, state)}});
  }
  const Json manifest = {{"program", report["program"]}, {"files", files}, {"robot_parts", parts_json(state.emitted.parts)}};
  folder.write("manifest.json", manifest.dump(2) + "\n");
  folder.write("report.json", report.dump(2) + "\n");
}

}  // namespace curvesup
