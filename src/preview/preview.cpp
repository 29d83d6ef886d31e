#include "curvesup/preview/preview.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "print_clock.h"
#include "scene.h"
#include "thin.h"

namespace curvesup {

namespace {

using Json = nlohmann::ordered_json;

// How far the drawing may leave the truth; grows until the page is small enough.
struct Detail {
  double path_mm, outline_mm, triangles;
};

Json parse(const std::string& text, const char* what) {
  if (text.empty()) return nullptr;
  try {
    return Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw Error(ErrorKind::internal, "preview", format("%s is no JSON: %s", what, error.what()));
  }
}

Json numbers(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

QuantisedBox scene_box(const PreviewInput& input) {
  QuantisedBox box;
  if (input.model) {
    for (const BoundaryFace& face : input.model->boundary) {
      for (const Index v : face.vertices) box.include(input.model->mesh.vertices[v]);
    }
  }
  if (input.skeleton) {
    for (const SkeletonNode& node : input.skeleton->nodes) box.include(node.position);
  }
  if (input.layers) {
    for (const Vec3& v : input.layers->vertices) box.include(v);
  }
  if (input.toolpaths) {
    for (const PathPoint& point : input.toolpaths->points) box.include(point.position);
  }
  return box;
}

void add_model(const PreviewInput& input, const QuantisedBox& box, Scene& scene) {
  const Model& model = *input.model;
  std::vector<Index> local(model.mesh.vertices.size(), kNone);
  std::vector<std::uint16_t> vertices;
  std::vector<std::uint32_t> faces, overhang;
  for (const BoundaryFace& face : model.boundary) {
    for (const Index v : face.vertices) {
      if (local[v] == kNone) {
        local[v] = static_cast<Index>(vertices.size() / 3);
        box.add(model.mesh.vertices[v], vertices);
      }
      faces.push_back(static_cast<std::uint32_t>(local[v]));
    }
  }
  if (input.overhang) overhang.assign(input.overhang->faces.begin(), input.overhang->faces.end());
  scene.add("model_vertices", vertices);
  scene.add("model_faces", faces);
  scene.add("overhang_faces", overhang);
}

void add_skeleton(const Skeleton& skeleton, const QuantisedBox& box, Scene& scene) {
  std::vector<std::uint16_t> ends;  // upper and lower end of each edge
  std::vector<float> radius;
  std::vector<std::uint32_t> branches;
  for (const SkeletonEdge& edge : skeleton.edges) {
    box.add(skeleton.nodes[edge.upper].position, ends);
    box.add(skeleton.nodes[edge.lower].position, ends);
    radius.push_back(static_cast<float>(edge.radius_mm));
    branches.push_back(static_cast<std::uint32_t>(edge.branch_count));
  }
  scene.add("edge_ends", ends);
  scene.add("edge_radius", radius);
  scene.add("edge_branches", branches);
}

double material_area(const LayerStack& stack, Material material) {
  double twice = 0.0;
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != material) continue;
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& c = stack.triangles[t];
      twice += area_normal(stack.vertices[c[0]], stack.vertices[c[1]], stack.vertices[c[2]]).norm();
    }
  }
  return 0.5 * twice;
}

// Sheets of one material as coarse triangles and border lines.
struct SheetBuffers {
  std::vector<std::uint16_t> vertices, outline;
  std::vector<std::uint32_t> triangles, outline_counts;
  // By sheet: its layer, and how many triangles and outline chains it has.
  std::vector<std::uint32_t> layer, triangle_count, chain_count;
};

void add_sheet(const SheetReader& reader, const Sheet& sheet, double cell_mm, const Detail& detail, const QuantisedBox& box,
               SheetBuffers& out) {
  const CoarseSheet coarse = reader.coarse(cell_mm);
  const auto base = static_cast<std::uint32_t>(out.vertices.size() / 3);
  for (const Vec3& v : coarse.vertices) box.add(v, out.vertices);
  for (const auto& t : coarse.triangles) {
    for (const Index v : t) out.triangles.push_back(base + static_cast<std::uint32_t>(v));
  }
  const auto chains = reader.borders();
  for (const auto& chain : chains) {
    const std::vector<Index> kept = thin_polyline(chain, detail.outline_mm);
    for (const Index i : kept) box.add(chain[i], out.outline);
    out.outline_counts.push_back(static_cast<std::uint32_t>(kept.size()));
  }
  out.layer.push_back(static_cast<std::uint32_t>(sheet.layer));
  out.triangle_count.push_back(static_cast<std::uint32_t>(coarse.triangles.size()));
  out.chain_count.push_back(static_cast<std::uint32_t>(chains.size()));
}

void add_layers(const LayerStack& stack, const Detail& detail, const QuantisedBox& box, Scene& scene,
                const RunContext& run) {
  SheetReader reader(stack);
  for (const Material material : {Material::model, Material::support}) {
    // About two triangles a grid cell.
    const double cell = std::max(0.4, std::sqrt(2.0 * material_area(stack, material) / detail.triangles));
    SheetBuffers buffers;
    for (const Sheet& sheet : stack.sheets) {
      if (sheet.material != material || sheet.triangle_count == 0) continue;
      run.check_stop();
      reader.read(sheet);
      add_sheet(reader, sheet, cell, detail, box, buffers);
    }
    const std::string name = material == Material::model ? "model_layers_" : "support_layers_";
    scene.add((name + "vertices").c_str(), buffers.vertices);
    scene.add((name + "triangles").c_str(), buffers.triangles);
    scene.add((name + "outline").c_str(), buffers.outline);
    scene.add((name + "outline_counts").c_str(), buffers.outline_counts);
    scene.add((name + "sheet_layer").c_str(), buffers.layer);
    scene.add((name + "sheet_triangles").c_str(), buffers.triangle_count);
    scene.add((name + "sheet_chains").c_str(), buffers.chain_count);
  }
}

void add_travels(const PrintClock& clock, Scene& scene) {
  QuantisedBox box;
  for (const auto& travel : clock.travels) {
    for (const Vec3& tip : travel.tips) box.include(tip);
  }
  std::vector<std::uint16_t> points;
  std::vector<std::uint32_t> counts;
  std::vector<float> times;
  for (const auto& travel : clock.travels) {
    for (const Vec3& tip : travel.tips) box.add(tip, points);
    counts.push_back(static_cast<std::uint32_t>(travel.tips.size()));
    times.push_back(static_cast<float>(travel.begin_s));
    times.push_back(static_cast<float>(travel.end_s));
  }
  scene.add_box("travel_box", box);
  scene.add("travel_points", points);
  scene.add("travel_counts", counts);
  scene.add("travel_times", times);
}

std::uint8_t of_maximum(double value, double maximum) {
  return static_cast<std::uint8_t>(maximum > 0.0 ? std::lround(255.0 * std::clamp(value / maximum, 0.0, 1.0)) : 0);
}

void add_toolpaths(const Toolpaths& toolpaths, const Motion* motion, const Detail& detail, const QuantisedBox& box,
                   Scene& scene) {
  const PrintClock clock = run_clock(toolpaths, motion);
  double max_height = 0.0, max_width = 0.0, max_feed = 0.0;
  for (const PathPoint& point : toolpaths.points) {
    max_height = std::max(max_height, point.height_mm);
    max_width = std::max(max_width, point.width_mm);
    max_feed = std::max(max_feed, point.feed_mm_s);
  }
  std::vector<std::uint16_t> positions, layers;
  std::vector<std::int8_t> axes;
  std::vector<std::uint8_t> heights, widths, feeds, kinds;  // kind: bit 0 support, bits 1.. PathKind
  std::vector<std::uint32_t> counts;
  std::vector<float> times;
  std::vector<Vec3> line;
  for (const Path& path : toolpaths.paths) {
    const PathPoint* points = toolpaths.points.data() + path.first_point;
    line.clear();
    for (Index i = 0; i < path.point_count; ++i) line.push_back(points[i].position);
    const auto differs = [&](Index a, Index b) {
      const double turn = clock.axis[path.first_point + a].dot(clock.axis[path.first_point + b]);
      return turn < 0.992 || std::abs(points[a].height_mm - points[b].height_mm) > 0.08 * max_height ||
             std::abs(points[a].width_mm - points[b].width_mm) > 0.15 * max_width ||
             (a > 0 && std::abs(points[a].feed_mm_s - points[b].feed_mm_s) > 0.05 * max_feed);
    };
    const std::vector<Index> kept = thin_polyline(line, detail.path_mm, differs);
    for (const Index i : kept) {
      box.add(line[i], positions);
      add_direction(clock.axis[path.first_point + i], axes);
      heights.push_back(of_maximum(points[i].height_mm, max_height));
      widths.push_back(of_maximum(points[i].width_mm, max_width));
      feeds.push_back(of_maximum(points[i].feed_mm_s, max_feed));
    }
    counts.push_back(static_cast<std::uint32_t>(kept.size()));
    layers.push_back(static_cast<std::uint16_t>(std::clamp<Index>(path.layer, 0, 65535)));
    kinds.push_back(static_cast<std::uint8_t>(static_cast<int>(path.material) | static_cast<int>(path.kind) << 1));
    const Index last = path.first_point + path.point_count - 1;
    times.push_back(static_cast<float>(path.point_count > 0 ? clock.point_s[path.first_point] : 0.0));
    times.push_back(static_cast<float>(path.point_count > 0 ? clock.point_s[last] : 0.0));
  }
  scene.info["paths"] = {{"max_height_mm", max_height}, {"max_width_mm", max_width}, {"max_feed_mm_s", max_feed},
                         {"end_s", clock.end_s}};
  scene.add("path_positions", positions);
  scene.add("path_layers", layers);
  scene.add("path_axes", axes);
  scene.add("path_heights", heights);
  scene.add("path_widths", widths);
  scene.add("path_feeds", feeds);
  scene.add("path_kinds", kinds);
  scene.add("path_counts", counts);
  scene.add("path_times", times);
  add_travels(clock, scene);
}

void add_texts(const PreviewInput& input, const PreviewOptions& options, Scene& scene) {
  scene.info["title"] = options.title;
  scene.info["nozzle"] = {{"half_angle_rad", options.nozzle_half_angle.radians()}, {"length_mm", options.nozzle_length_mm}};
  Json checks = Json::array();
  for (const Check& check : input.checks) {
    Json places = Json::array();
    for (const PreviewMark& mark : input.marks) {
      if (mark.check == check.name) places.push_back({{"at", numbers(mark.position)}, {"text", mark.text}});
    }
    checks.push_back({{"name", check.name}, {"ok", check.ok}, {"value", check.value}, {"limit", check.limit},
                      {"detail", check.detail}, {"places", places}});
  }
  scene.info["checks"] = checks;
  Json report = parse(input.report_json, "the report");
  if (report.is_object()) {
    report.erase("stages");
    report.erase("checks");
  }
  scene.info["report"] = report;
  scene.info["config"] = parse(input.config_json, "the config");
  Json files = Json::array();
  for (const PreviewFile& file : input.files) {
    files.push_back({{"path", file.path}, {"bytes", file.bytes}, {"what", file.what}});
  }
  scene.info["files"] = files;
  Json plots = Json::array();
  for (const Plot& plot : input.plots) {
    plots.push_back({{"name", plot.name}, {"title", plot.title}, {"caption", plot.caption}, {"png", base64(plot.png)}});
  }
  scene.info["plots"] = plots;
}

std::string page_at(const PreviewInput& input, const PreviewOptions& options, const Detail& detail,
                    const RunContext& run) {
  Scene scene;
  add_texts(input, options, scene);
  const QuantisedBox box = scene_box(input);
  scene.add_box("box", box);
  if (input.model) add_model(input, box, scene);
  if (input.skeleton) add_skeleton(*input.skeleton, box, scene);
  if (input.layers) add_layers(*input.layers, detail, box, scene, run);
  if (input.toolpaths) add_toolpaths(*input.toolpaths, input.motion, detail, box, scene);
  return scene.page(options.title);
}

}  // namespace

std::string preview_html(const PreviewInput& input, const PreviewOptions& options, const RunContext& run) {
  Detail detail{options.path_tolerance_mm, options.outline_tolerance_mm, static_cast<double>(options.layer_triangles)};
  // Each round halves the triangles and doubles the tolerances; sixteen rounds leave nothing to coarsen.
  for (int round = 0;; ++round) {
    std::string page = page_at(input, options, detail, run);
    if (page.size() <= options.max_bytes || round == 16) return page;
    detail = {2.0 * detail.path_mm, 2.0 * detail.outline_mm, 0.5 * detail.triangles};
  }
}

std::vector<PreviewMark> marks_of(const MotionReport& report) {
  std::vector<PreviewMark> marks;
  for (const UnreachableWaypoint& place : report.unreachable) {
    marks.push_back({"motion.unreachable", place.tip_mm, format("path %d: %s", place.path, place.reason.c_str())});
  }
  for (const MotionCollision& place : report.collisions) {
    marks.push_back({"motion.collisions", place.contact_mm,
                     format("path %d: %s, %.2f mm deep", place.path, place.what.c_str(), place.depth_mm)});
  }
  return marks;
}

std::vector<PreviewMark> marks_of(const ToolpathReport& report) {
  std::vector<PreviewMark> marks;
  for (const UnprintedPiece& piece : report.unprinted) {
    marks.push_back({"toolpath.pieces_without_path", piece.position,
                     format("layer %d: %.3f mm2 of %s without a path", piece.layer, piece.area_mm2,
                            piece.material == Material::model ? "model" : "support")});
  }
  return marks;
}

}  // namespace curvesup
