#include "write_output.h"

#include <algorithm>
#include <map>

#include "artifacts.h"
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

void write_artifacts(OutputFolder& folder, const SliceState& state, const RunContext& run) {
  const auto write = [&](const std::string& name, const std::string& bytes) {
    run.check_stop();
    folder.write(name, bytes);
  };
  write("config.resolved.json", state.config.dump(2) + "\n");
  if (done(state, "extension") && wanted(state, "domain")) write("domain.vtu", domain_vtu(state.domain.domain, state.extension.field));
  if (done(state, "layers") && wanted(state, "layers")) {
    write("layers.vtp", layers_vtp(done(state, "trim") ? state.trim.stack : state.layers.stack, state.extension.field));
  }
  if (done(state, "skeleton") && wanted(state, "skeleton")) write("skeleton.vtp", skeleton_vtp(state.skeleton.skeleton));
  if (done(state, "toolpath") && wanted(state, "toolpaths")) write("toolpaths.vtp", toolpaths_vtp(state.toolpath.toolpaths));
  for (const EmittedFile& file : state.emitted.files) {
    if (wanted(state, file.name.starts_with("duet/") ? "duet" : "robot")) write(file.name, file.content);
  }
  if (done(state, "motion") && config_value(state.config, "output.waypoints").get<bool>()) {
    const Machine machine = machine_from_config(config_value(state.config, "machine"));
    for (const EmittedFile& file : emit_waypoints(state.toolpath.toolpaths, state.motion.motion, machine, run)) write(file.name, file.content);
  }
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
