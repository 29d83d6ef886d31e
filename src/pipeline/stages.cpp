#include "stages.h"

#include <algorithm>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/tet_file.h"
#include "curvesup/io/value_file.h"
#include "curvesup/solid/convolution_solid.h"
#include "curvesup/solid/envelope_solid.h"
#include "options.h"

namespace curvesup {

namespace {

// ---------------------------------------------------------------------------------------------------------- load

void load(SliceState& state, const RunContext& run) {
  const auto& file = state.request.model_file;
  state.input_sha256 = sha256_of_file(file);
  state.model = load_model(file.stem().string(), read_tet_file(file), place_options(state.config), run);
  const ModelReport& report = state.model.report;
  if (report.flipped_tets > 0) {
    run.log(LogLevel::warning, format("%d tets were turned inside out and have been mended", report.flipped_tets));
  }
  if (report.low.z() < -1e-6 * (report.high - report.low).norm()) {
    throw Error(ErrorKind::usage, "config key model.translate_mm",
                format("the placed model reaches %.3f mm below the platform", -report.low.z()),
                "move it up or set model.drop_to_platform");
  }
  state.report["model"] = {{"vertices", report.vertices},
                           {"tets", report.tets},
                           {"boundary_faces", report.boundary_faces},
                           {"volume_mm3", report.volume_mm3},
                           {"genus", report.genus},
                           {"components", report.components},
                           {"cavities", report.cavities},
                           {"flipped_tets", report.flipped_tets},
                           {"duplicate_vertices", report.duplicate_vertices},
                           {"unreferenced_vertices", report.unreferenced_vertices},
                           {"low_mm", {report.low.x(), report.low.y(), report.low.z()}},
                           {"high_mm", {report.high.x(), report.high.y(), report.high.z()}}};
}

// --------------------------------------------------------------------------------------------------------- field

FieldInput read_field_input(const SliceState& state, FieldSource source) {
  FieldInput input;
  if (source == FieldSource::direction) return input;
  const std::string path = config_value(state.config, "field.path").get<std::string>();
  const auto file = config_file_path(state.request.config, "field.path", path);
  const TetMesh& mesh = state.model.model.mesh;
  if (source == FieldSource::scalar_file) input.vertex_value = read_scalars(file, mesh.vertices.size());
  if (source == FieldSource::vector_file) input.tet_vector = read_vectors(file, mesh.tets.size());
  return input;
}

void field(SliceState& state, const RunContext& run) {
  const FieldOptions options = field_options(state.config);
  const Model& model = state.model.model;
  state.field = compute_field(model, read_field_input(state, options.source), options, run);
  const Json& count = config_value(state.config, "layers.count");
  state.layer_count = count.is_null() ? layer_count_for_thickness(model, state.field.field,
                                                                  config_value(state.config, "layers.thickness_mm").get<double>())
                                      : count.get<int>();
  const FieldReport& report = state.field.report;
  if (report.flipped) run.log(LogLevel::info, "the field runs downward in this pose; 1 - G is used");
  state.report["field"] = {{"flipped", report.flipped},
                           {"grad_min", report.grad_min},
                           {"grad_median", report.grad_median},
                           {"grad_max", report.grad_max},
                           {"weak_tets", report.weak_tets.size()},
                           {"inverted_tets", report.inverted_tets.size()},
                           {"interior_minima", report.interior_minima.size()},
                           {"interior_maxima", report.interior_maxima.size()},
                           {"layer_count", state.layer_count}};
}

// ------------------------------------------------------------------------------------------------------ overhang

void overhang(SliceState& state, const RunContext& run) {
  state.overhang = find_overhang(state.model.model, state.field.field, overhang_options(state.config, state.request.config), run);
  const Overhang& found = state.overhang;
  const bool needed = !found.faces.empty() || !found.minima.empty();
  const bool wanted = config_value(state.config, "support.method") != "none";
  state.supported = needed && wanted;
  if (!needed) run.log(LogLevel::info, "the model has no overhang: no support is made");
  state.report["overhang"] = {{"faces", found.faces.size()},
                              {"vertices", found.vertices.size()},
                              {"area_mm2", found.area_mm2},
                              {"minima", found.minima.size()}};
}

// -------------------------------------------------------------------------------------------------- hull, domain

// The largest radius a strut can have; the hull leaves that much room around the trajectories.
double strut_room_mm(const SliceState& state) {
  const double leaf = config_value(state.config, "support.leaf_radius_mm").get<double>();
  return config_value(state.config, "support.method") == "envelope" ? leaf : 2.0 * leaf;
}

void hull(SliceState& state, const RunContext& run) {
  if (!state.supported) return;
  HullOptions options = hull_options(state.config);
  options.extra_margin_mm = strut_room_mm(state);
  state.hull = build_hull(state.model.model, state.field.field, state.overhang, state.layer_count, options, run);
}

void domain(SliceState& state, const RunContext& run) {
  const Model& model = state.model.model;
  if (state.supported) {
    state.domain = mesh_domain(model, state.hull.surface, domain_options(state.config), run);
  } else {
    state.domain = domain_without_support(model);
  }
  const DomainReport& report = state.domain.report;
  state.add_checks(report.checks);
  state.report["domain"] = {{"vertices", report.vertices},
                            {"tets", report.tets},
                            {"support_tets", report.support_tets},
                            {"interface_faces", report.interface_faces},
                            {"volume_rel_error", report.volume_rel_error},
                            {"min_dihedral_deg", report.min_dihedral_deg},
                            {"hull_margin_mm", state.hull.report.margin_mm},
                            {"hull_attempts", state.hull.report.attempts}};
}

void extension(SliceState& state, const RunContext& run) {
  if (state.supported) {
    state.extension = extend_field(state.domain.domain, state.field.field, state.layer_count, {}, run);
  } else {
    state.extension.field = state.field.field;
  }
  const ExtensionReport& report = state.extension.report;
  state.add_checks(report.checks);
  state.report["extension"] = {{"unknowns", report.unknowns},
                               {"residual", report.residual},
                               {"false_extrema", report.false_extrema},
                               {"hull_extrema", report.hull_extrema},
                               {"thickness_p1_mm", report.thickness_p1_mm},
                               {"thickness_p50_mm", report.thickness_p50_mm},
                               {"thickness_p99_mm", report.thickness_p99_mm}};
}

// -------------------------------------------------------------------------------------------------------- layers

void layers(SliceState& state, const RunContext& run) {
  state.layers = slice_layers(state.domain.domain, state.extension.field, state.layer_count, run);
  const LayersReport& report = state.layers.report;
  state.add_checks(report.checks);
  state.report["layers"] = {{"model", report.model_layers},
                            {"support", report.support_layers},
                            {"support_printed", 0},
                            {"triangles", report.triangles},
                            {"degenerate_triangles", report.degenerate_triangles},
                            {"thickness_p1_mm", report.thickness_p1_mm},
                            {"thickness_p50_mm", report.thickness_p50_mm},
                            {"thickness_p99_mm", report.thickness_p99_mm}};
}

// ----------------------------------------------------------------------------------------------- skeleton, solid

Json dropped_json(const std::vector<DroppedLeaf>& dropped) {
  Json list = Json::array();
  for (const DroppedLeaf& leaf : dropped) {
    list.push_back({{"position_mm", {leaf.position.x(), leaf.position.y(), leaf.position.z()}}, {"face", leaf.face}, {"reason", leaf.reason}});
  }
  return list;
}

void skeleton(SliceState& state, const RunContext& run) {
  if (!state.supported) return;
  state.skeleton = grow_skeleton(state.model.model, state.domain.domain, state.extension.field, state.overhang,
                                 state.layer_count, skeleton_options(state.config), run);
  const SkeletonReport& report = state.skeleton.report;
  state.add_checks(report.checks);
  state.report["overhang"]["points_added"] = report.points_added;
  state.report["overhang"]["dropped"] = dropped_json(report.dropped);
  state.report["skeleton"] = {{"leaves", report.leaves},
                              {"nodes", report.nodes},
                              {"edges", report.edges},
                              {"platform_ends", report.platform_ends},
                              {"model_ends", report.model_ends},
                              {"leaf_count_at_ends", report.leaf_count_at_ends},
                              {"max_branch_count", report.max_branch_count},
                              {"max_edge_angle_deg", report.max_edge_angle_deg},
                              {"length_mm", report.length_mm}};
}
