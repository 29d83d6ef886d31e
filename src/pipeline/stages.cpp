#include "stages.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/pipeline/machine_config.h"
#include "curvesup/core/format.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/surface_file.h"
#include "curvesup/io/tet_file.h"
#include "curvesup/io/value_file.h"
#include "curvesup/model/fill_surface.h"
#include "curvesup/solid/convolution_solid.h"
#include "curvesup/solid/envelope_solid.h"
#include "mesh/tet_budget.h"
#include "options.h"

namespace curvesup {

namespace {

Json vec_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// ---------------------------------------------------------------------------------------------------------- load

// The tets of a .tet file, or of the inside of a surface.
TetMesh read_model(const SliceState& state, const RunContext& run) {
  const auto& file = state.request.model_file;
  if (!is_surface_file(file)) return read_tet_file(file);
  const double scale = place_options(state.config).scale;
  const double volume = config_value(state.config, "model.max_tet_volume_mm3").get<double>();
  return fill_surface(read_surface_file(file), file.string(), {.max_tet_volume_mm3 = volume, .scale = scale}, run);
}

// What no arm can print or no nozzle lay is most often a file in other units.
void look_at_size(const SliceState& state, const RunContext& run) {
  const ModelReport& report = state.model.report;
  const Vec3 size = report.high - report.low, middle = 0.5 * (report.high + report.low);
  const std::string sizes = format("the placed part is %.6g x %.6g x %.6g mm large", size.x(), size.y(), size.z());
  const double bead = toolpath_options(state.config).bead_width_mm;
  const char* units = "if the file is not in millimetres set model.scale: 25.4 for inches, 1000 for metres";
  if (size.maxCoeff() < bead) {
    throw Error(ErrorKind::usage, "config key model.scale", sizes + format(", smaller than one bead of %g mm", bead), units);
  }
  constexpr double kFewBeads = 10.0;
  if (size.maxCoeff() < kFewBeads * bead) {
    run.log(LogLevel::warning, sizes + format(", hardly more than beads of %g mm (%s)", bead, units));
  }
  double arm_mm = 0.0;  // its links laid in one line
  for (const DhRow& link : machine_from_config(config_value(state.config, "machine")).arm.dh) {
    arm_mm += 1000.0 * (std::abs(link.a_m) + std::abs(link.d_m));
  }
  if (size.maxCoeff() > 2.0 * arm_mm) {
    run.log(LogLevel::warning, sizes + format(", more than the arm reaches (if the file is not in millimetres set model.scale, to %s "
                                              "perhaps)", scale_that_helps(size.maxCoeff()).c_str()));
  } else if (middle.norm() > 2.0 * arm_mm) {
    const Vec3 move = place_options(state.config).translate_mm - Vec3(middle.x(), middle.y(), report.low.z());
    run.log(LogLevel::warning, format("the placed part lies %.6g mm from the middle of the platform, where the arm does not reach (set "
                                      "model.translate_mm to [%.6g, %.6g, %.6g])", middle.norm(), move.x(), move.y(), move.z()));
  }
}

void load(SliceState& state, const RunContext& run) {
  const auto& file = state.request.model_file;
  state.input_sha256 = sha256_of_file(file);
  state.model = load_model(file.stem().string(), read_model(state, run), place_options(state.config), run);
  const ModelReport& report = state.model.report;
  if (report.flipped_tets > 0) {
    run.log(LogLevel::warning, format("%d tets were turned inside out and have been mended", report.flipped_tets));
  }
  if (report.low.z() < -1e-6 * (report.high - report.low).norm()) {
    throw Error(ErrorKind::usage, "config key model.translate_mm",
                format("the placed model reaches %.3f mm below the platform", -report.low.z()),
                "move it up or set model.drop_to_platform");
  }
  look_at_size(state, run);
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
  if (is_surface_file(state.request.model_file)) {
    throw Error(ErrorKind::usage, "config key field.source",
                "a surface file has no vertices or tets inside that a file could give values to",
                "use a .tet file, or set field.source to direction");
  }
  const std::string path = config_value(state.config, "field.path").get<std::string>();
  const auto file = config_file_path(state.request.config, "field.path", path);
  input.where = file.string();
  const TetMesh& mesh = state.model.model.mesh;
  if (source == FieldSource::scalar_file) input.vertex_value = read_scalars(file, mesh.vertices.size());
  if (source == FieldSource::vector_file) input.tet_vector = read_vectors(file, mesh.tets.size());
  return input;
}

// Layers around a place inside the part would start in mid-air, or end where no nozzle gets in.
void refuse_closed_layers(const SliceState& state, const std::string& where) {
  const Model& model = state.model.model;
  const auto closed = find_closed_layers(model, state.field.field, state.field.report, state.layer_count);
  if (!closed) return;
  const Vec3& at = model.mesh.vertices[static_cast<std::size_t>(closed->vertex)];
  throw Error(ErrorKind::input, format("%s, vertex %d", where.c_str(), static_cast<int>(closed->vertex)),
              format("the field has a %s inside the part, at (%.3f, %.3f, %.3f) as placed, and %d layers close around it: %s",
                     closed->around_minimum ? "minimum" : "maximum", at.x(), at.y(), at.z(), closed->count,
                     closed->around_minimum ? "nothing would carry them" : "no nozzle could get in"),
              "make the field grow from the part's boundary to its boundary");
}

void field(SliceState& state, const RunContext& run) {
  const FieldOptions options = field_options(state.config);
  const Model& model = state.model.model;
  const FieldInput input = read_field_input(state, options.source);
  state.field = compute_field(model, input, options, run);
  const Json& count = config_value(state.config, "layers.count");
  state.layer_count = count.is_null() ? layer_count_for_thickness(model, state.field.field,
                                                                  config_value(state.config, "layers.thickness_mm").get<double>())
                                      : count.get<int>();
  refuse_closed_layers(state, input.where);
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
  if (!needed && found.blocked_area_mm2 > 0.0) {
    throw Error(ErrorKind::usage, "config keys support.block and support.method",
                "the blocked regions cover the whole overhang, so nothing is left to support",
                "make the regions smaller, or set support.method to none");
  }
  if (!needed) run.log(LogLevel::info, "the model has no overhang: no support is made");
  state.report["overhang"] = {{"faces", found.faces.size()},
                              {"vertices", found.vertices.size()},
                              {"area_mm2", found.area_mm2},
                              {"minima", found.minima.size()},
                              {"enforced_area_mm2", found.enforced_area_mm2},
                              {"blocked_area_mm2", found.blocked_area_mm2},
                              {"points_added", 0},
                              {"dropped", Json::array()}};
}

// -------------------------------------------------------------------------------------------------- hull, domain

void hull(SliceState& state, const RunContext& run) {
  if (!state.supported) return;
  state.hull = build_hull(state.model.model, state.field.field, state.overhang, state.layer_count, hull_options(state.config), run);
  state.add_checks(state.hull.report.checks);
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
  state.hull.surface = {};
}

void extension(SliceState& state, const RunContext& run) {
  if (state.supported) {
    state.extension = extend_field(state.domain.domain, state.field.field, state.layer_count, extension_options(state.config), run);
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

// Gaps wider than a layer leave the overhang without anything to lie on.
void check_gaps(const SliceState& state) {
  const InterfaceOptions options = solid_options(state.config).interface;
  const double layer_mm = 1.0 / (state.layer_count * state.field.report.grad_median);
  if (options.top_gap_mm > layer_mm) {
    const char* layers = config_value(state.config, "layers.count").is_null() ? "layers.thickness_mm" : "layers.count";
    throw Error(ErrorKind::usage, std::string("config keys support.top_gap_mm and ") + layers,
                format("the gap of %g mm is larger than a layer, which is %.3g mm thick", options.top_gap_mm, layer_mm),
                "make the gap smaller or the layers thicker");
  }
}

void skeleton(SliceState& state, const RunContext& run) {
  if (!state.supported) return;
  check_gaps(state);
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

// The baseline starts from the same leaves as the tree and samples its rays every half layer.
std::shared_ptr<const Solid> envelope_solid(const SliceState& state, double alpha_mm, const RunContext& run) {
  const SkeletonOptions tree = skeleton_options(state.config);
  const auto leaves = place_leaves(state.model.model, state.field.field, state.overhang, effective_leaf_spacing(tree), run);
  const double half_layer_mm = 0.5 / (state.layer_count * state.field.report.grad_median);
  return build_envelope(state.model.model, leaves,
                        {.alpha_mm = alpha_mm, .leaf_radius_mm = tree.leaf_radius_mm, .sample_step_mm = half_layer_mm}, run)
      .solid;
}

void solid(SliceState& state, const RunContext& run) {
  if (!state.supported) return;
  const SolidOptions options = solid_options(state.config);
  std::vector<Contact> contacts;
  if (options.method == SupportMethod::envelope) {
    state.solid = envelope_solid(state, options.envelope_alpha_mm, run);
  } else {
    const auto stands = stands_on_model(state.skeleton.skeleton, state.domain.domain, state.extension.field);
    state.solid = std::make_shared<ConvolutionSolid>(state.skeleton.skeleton, options.convolution, stands, run);
    contacts = contacts_of(state.skeleton.skeleton, stands);
  }
  state.solid = with_interface(std::move(state.solid), state.model.model, state.field.field, state.overhang, state.layer_count,
                               options.interface, contacts);
}

// ---------------------------------------------------------------------------------------------------------- trim

Json removed_json(const std::vector<RemovedPiece>& removed) {
  Json list = Json::array();
  for (const RemovedPiece& piece : removed) {
    list.push_back({{"layer", piece.layer}, {"pass", piece.pass}, {"area_mm2", piece.area_mm2},
                    {"centroid_mm", {piece.centroid.x(), piece.centroid.y(), piece.centroid.z()}},
                    {"reason", piece.floating ? "floating" : "small"}});
  }
  return list;
}

void trim(SliceState& state, const RunContext& run) {
  if (state.supported) {
    state.trim = trim_layers(state.domain.domain, state.extension.field, state.layers.stack, *state.solid, trim_options(state.config), run);
  } else {
    state.trim.stack = std::move(state.layers.stack);
  }
  state.layers.stack = {};
  state.solid.reset();
  const TrimReport& report = state.trim.report;
  state.add_checks(report.checks);
  state.report["layers"]["support_printed"] = report.support_layers;
  state.report["support"] = {{"method", state.supported ? config_value(state.config, "support.method") : Json("none")},
                             {"volume_mm3", report.printed_volume_mm3[1]},
                             {"untrimmed_volume_mm3", report.untrimmed_volume_mm3[1]},
                             {"area_mm2", report.areas.kept_mm2 + report.areas.in_passes_mm2},
                             {"pieces", report.support_pieces},
                             {"pieces_in_passes", report.pieces_in_passes},
                             {"passes_max", report.passes_max},
                             {"max_height_mm", report.max_height_mm},
                             {"height_p50_mm", report.support_height_p50_mm},
                             {"height_p99_mm", report.support_height_p99_mm},
                             {"removed_pieces", removed_json(report.removed)}};
}

// ------------------------------------------------------------------------------------------------------ toolpath

Json by_material(const std::array<double, kMaterialCount>& values) { return {{"model", values[0]}, {"support", values[1]}}; }

void toolpath(SliceState& state, const RunContext& run) {
  state.toolpath = plan_toolpaths(state.domain.domain, state.extension.field, state.trim.stack, toolpath_options(state.config), run);
  state.toolpath.toolpaths.points.shrink_to_fit();  // it grew by doubling, and stays to the end
  const ToolpathReport& report = state.toolpath.report;
  state.add_checks(report.checks);
  Json unprinted = Json::array();
  for (const UnprintedPiece& piece : report.unprinted) {
    unprinted.push_back({{"layer", piece.layer}, {"material", static_cast<int>(piece.material)}, {"area_mm2", piece.area_mm2},
                         {"position_mm", {piece.position.x(), piece.position.y(), piece.position.z()}}});
  }
  state.report["toolpath"] = {{"paths", report.paths},
                              {"points", report.points},
                              {"length_mm", by_material(report.length_mm)},
                              {"volume_mm3", by_material(report.volume_mm3)},
                              {"layer_volume_mm3", by_material(report.layer_volume_mm3)},
                              {"pieces", report.pieces},
                              {"pieces_without_path", report.pieces_without_path},
                              {"dots", report.dots},
                              {"dust_pieces", report.dust_pieces},
                              {"dust_area_mm2", report.dust_area_mm2},
                              {"rings", report.rings},
                              {"centre_lines", report.centre_lines},
                              {"lines", report.lines},
                              {"sparse_pieces", report.sparse_pieces},
                              {"interface_pieces", report.interface_pieces},
                              {"overhang_mm", report.overhang_mm},
                              {"slowed_mm", report.slowed_mm},
                              {"max_flow_mm3_s", report.max_flow_mm3_s},
                              {"laying_time_s", report.laying_time_s},
                              {"groups", report.groups},
                              {"batched_layers", report.batched_layers},
                              {"jumps", report.jumps},
                              {"jumps_inside_pieces", report.jumps_inside_pieces},
                              {"naive_jumps", report.naive_jumps},
                              {"naive_jumps_inside_pieces", report.naive_jumps_inside_pieces},
                              {"retractions", report.retractions},
                              {"min_height_mm", report.min_height_mm},
                              {"max_height_mm", report.max_height_mm},
                              {"unprinted", unprinted}};
  state.report["print"] = {{"time_s", report.time_s},
                           {"filament_mm", by_material(report.filament_mm)},
                           {"material_changes", report.material_changes}};
}

// --------------------------------------------------------------------------------------------------- certificate

void certify_paths(SliceState& state, const RunContext& run) {
  state.toolpath_certificate = certify_toolpaths(state.domain.domain, state.extension.field, state.trim.stack,
                                                 state.toolpath.toolpaths, toolpath_certificate_options(state.config), run);
  const ToolpathCertificate& proof = state.toolpath_certificate;
  state.add_checks(proof.checks);
  Json& toolpath = state.report["toolpath"];
  toolpath["covered_fraction"] = proof.covered_fraction;
  toolpath["overlap"] = proof.overlap;
  if (proof.sparse_samples > 0) toolpath["sparse_covered_fraction"] = proof.sparse_covered_fraction;
  toolpath["spacing_mm"] = {{"p5", proof.spacing_p5_mm}, {"median", proof.spacing_median_mm}, {"p95", proof.spacing_p95_mm}};
  toolpath["max_point_distance_mm"] = proof.max_point_distance_mm;
  toolpath["segments_off_layer"] = proof.segments_off_layer;
  toolpath["max_layer_volume_error"] = proof.max_layer_volume_error;
}

void certify_support_standing(SliceState& state, const RunContext& run) {
  const bool tree = state.supported && config_value(state.config, "support.method") == "tree";
  SupportCertificateOptions options = certificate_options(state.config);
  options.enforced_faces = state.overhang.enforced;
  state.certificate =
      certify_support(state.model.model, state.overhang.blocked, state.domain.domain, state.extension.field, state.trim.stack,
                      tree ? &state.skeleton.skeleton : nullptr, options, run);
  const SupportCertificate& proof = state.certificate;
  if (state.supported) state.add_checks(proof.checks);
  Json uncovered = Json::array(), floating = Json::array();
  for (const auto& face : proof.uncovered) uncovered.push_back({{"face", face.face}, {"area_mm2", face.area_mm2}});
  for (const auto& piece : proof.floating) {
    floating.push_back({{"layer", piece.layer}, {"pass", piece.pass}, {"area_mm2", piece.area_mm2}, {"centroid_mm", vec_json(piece.centroid)}});
  }
  Json& support = state.report["support"];
  support["covered_overhang_fraction"] = proof.covered_fraction;
  support["unsupported_area_mm2"] = proof.uncovered_area_mm2;
  support["covered_without_support_fraction"] = proof.floor_fraction;
  support["blocked_area_mm2"] = proof.blocked_area_mm2;
  support["floating_pieces"] = proof.floating.size();
  support["floating"] = floating;
  support["uncovered_faces"] = uncovered;
}

void certificate(SliceState& state, const RunContext& run) {
  certify_support_standing(state, run);
  certify_paths(state, run);
}

// ------------------------------------------------------------------------------------------------- motion, emit

void motion(SliceState& state, const RunContext& run) {
  const Machine machine = machine_from_config(config_value(state.config, "machine"));
  state.motion = plan_motion(state.toolpath.toolpaths, machine, {}, run);
  reorder_paths(state.toolpath.toolpaths, state.motion.path_order);
  raise_points(state.toolpath.toolpaths, state.motion.raised);
  const MotionReport& report = state.motion.report;
  state.add_checks(report.checks);
  Json unreachable = Json::array(), collisions = Json::array();
  for (const UnreachableWaypoint& w : report.unreachable) {
    unreachable.push_back({{"path", w.path}, {"point", w.point}, {"tip_mm", vec_json(w.tip_mm)}, {"axis", vec_json(w.axis)}, {"reason", w.reason}});
  }
  for (const MotionCollision& c : report.collisions) {
    collisions.push_back({{"path", c.path}, {"point", c.point}, {"tip_mm", vec_json(c.tip_mm)}, {"contact_mm", vec_json(c.contact_mm)},
                          {"depth_mm", c.depth_mm}, {"what", c.what}});
  }
  if (!report.unreachable.empty()) {
    const UnreachableWaypoint& w = report.unreachable.front();
    run.log(LogLevel::error, format("the arm cannot reach path %d, point %d: %s", w.path, w.point, w.reason.c_str()));
  } else if (!report.collisions.empty()) {
    const MotionCollision& c = report.collisions.front();
    run.log(LogLevel::error, format("collision on path %d, point %d: %s", c.path, c.point, c.what.c_str()));
  }
  state.report["motion"] = {{"waypoints", report.waypoints},
                            {"parts", 0},
                            {"travel_mm", report.travel_mm},
                            {"max_tilt_deg", report.max_tilt_deg},
                            {"tilt_deviation_median_deg", report.tilt_deviation_median_deg},
                            {"tilt_deviation_p95_deg", report.tilt_deviation_p95_deg},
                            {"tilt_deviation_max_deg", report.tilt_deviation_max_deg},
                            {"unreachable", report.unreachable_waypoints},
                            {"collisions", report.colliding_waypoints + report.colliding_travels},
                            {"raised_points", state.motion.raised.size()},
                            {"max_raise_mm", report.max_raise_mm},
                            {"min_singularity_metric", report.min_singularity_metric},
                            {"max_joint_speed_ratio", report.max_joint_speed_ratio},
                            {"rotation_limited", report.rotation_limited},
                            {"stops", report.stops},
                            {"unreachable_places", unreachable},
                            {"collision_places", collisions}};
}

void emit(SliceState& state, const RunContext& run) {
  if (!state.robot_ok()) return;
  const Machine machine = machine_from_config(config_value(state.config, "machine"));
  state.emitted = emit_robot(state.toolpath.toolpaths, state.motion.motion, machine,
                             {.title = state.model.model.name, .spool_folder = state.spool_folder}, run);
  const EmitReport& report = state.emitted.report;
  state.add_checks(report.checks);
  state.report["motion"]["parts"] = state.emitted.parts.size();
  state.report["motion"]["gates"] = report.gates;
  state.report["print"] = {{"time_s", report.time_s},
                           {"filament_mm", {{"model", report.filament_mm[0]}, {"support", report.filament_mm[1]}}},
                           {"printed_filament_mm", {{"model", report.printed_filament_mm[0]}, {"support", report.printed_filament_mm[1]}}},
                           {"material_changes", report.material_changes}};
}

}  // namespace

std::span<const Stage> slice_stages() {
  static constexpr Stage kStages[] = {
      {"load", 0.02, load},           {"field", 0.02, field},     {"overhang", 0.01, overhang}, {"hull", 0.05, hull},
      {"domain", 0.08, domain},       {"extension", 0.12, extension}, {"layers", 0.05, layers}, {"skeleton", 0.02, skeleton},
      {"solid", 0.02, solid},         {"trim", 0.13, trim},       {"toolpath", 0.20, toolpath}, {"certificate", 0.08, certificate},
      {"motion", 0.15, motion},       {"emit", 0.05, emit},
  };
  return kStages;
}

}  // namespace curvesup
