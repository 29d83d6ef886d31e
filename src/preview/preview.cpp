#include "curvesup/preview/preview.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
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
  double loose = 1.0;      // times as much as at first may tilt, height, width and speed change between drawn points
  std::size_t stride = 1;  // 1: every sheet and path is drawn, n: every n-th
};

template <class T>
void append(std::vector<T>& to, const std::vector<T>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

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
  // By sheet: its layer (support begins below 0), and how many triangles and outline chains it has.
  std::vector<std::int32_t> layer;
  std::vector<std::uint32_t> triangle_count, chain_count;

  void add(const SheetBuffers& more) {
    const auto base = static_cast<std::uint32_t>(vertices.size() / 3);
    for (const std::uint32_t v : more.triangles) triangles.push_back(base + v);
    append(vertices, more.vertices);
    append(outline, more.outline);
    append(outline_counts, more.outline_counts);
    append(layer, more.layer);
    append(triangle_count, more.triangle_count);
    append(chain_count, more.chain_count);
  }
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
  out.layer.push_back(static_cast<std::int32_t>(sheet.layer));
  out.triangle_count.push_back(static_cast<std::uint32_t>(coarse.triangles.size()));
  out.chain_count.push_back(static_cast<std::uint32_t>(chains.size()));
}

SheetBuffers draw_sheets(const LayerStack& stack, Material material, const Detail& detail, const QuantisedBox& box,
                         const RunContext& run) {
  constexpr std::size_t kGrain = 16;
  std::vector<const Sheet*> sheets;
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material == material && sheet.triangle_count > 0) sheets.push_back(&sheet);
  }
  const std::size_t drawn = chunk_count(sheets.size(), detail.stride);
  // About two triangles a grid cell.
  const double cell = std::max(0.4, std::sqrt(2.0 * material_area(stack, material) / detail.triangles));
  std::vector<SheetBuffers> parts(chunk_count(drawn, kGrain));
  parallel_for(drawn, kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    SheetReader reader(stack);
    for (std::size_t i = begin; i < end; ++i) {
      reader.read(*sheets[i * detail.stride]);
      add_sheet(reader, *sheets[i * detail.stride], cell, detail, box, parts[chunk]);
    }
  });
  SheetBuffers all;
  for (const SheetBuffers& part : parts) all.add(part);
  return all;
}

void add_layers(const LayerStack& stack, const Detail& detail, const QuantisedBox& box, Scene& scene,
                const RunContext& run) {
  for (const Material material : {Material::model, Material::support}) {
    const SheetBuffers buffers = draw_sheets(stack, material, detail, box, run);
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

// Largest values of the toolpaths: what the bytes of a drawn point are fractions of.
struct Maxima {
  double height = 0.0, width = 0.0, feed = 0.0;
};

Maxima maxima_of(const Toolpaths& toolpaths) {
  Maxima most;
  for (const PathPoint& point : toolpaths.points) {
    most.height = std::max(most.height, point.height_mm);
    most.width = std::max(most.width, point.width_mm);
    most.feed = std::max(most.feed, point.feed_mm_s);
  }
  return most;
}

struct PathBuffers {
  std::vector<std::uint16_t> positions;
  std::vector<std::int16_t> layers;
  std::vector<std::int8_t> axes;
  std::vector<std::uint8_t> heights, widths, feeds, kinds;  // kind: bit 0 support, bits 1.. PathKind
  std::vector<std::uint32_t> counts;
  std::vector<float> times;

  void add(const PathBuffers& more) {
    append(positions, more.positions);
    append(layers, more.layers);
    append(axes, more.axes);
    append(heights, more.heights);
    append(widths, more.widths);
    append(feeds, more.feeds);
    append(kinds, more.kinds);
    append(counts, more.counts);
    append(times, more.times);
  }
};

class PathPainter {
 public:
  PathPainter(const Toolpaths& toolpaths, const PrintClock& clock, const Detail& detail, const QuantisedBox& box)
      : toolpaths_(toolpaths), clock_(clock), detail_(detail), box_(box), most_(maxima_of(toolpaths)) {}

  [[nodiscard]] const Maxima& maxima() const { return most_; }

  void draw(const Path& path, std::vector<Vec3>& line, PathBuffers& out) const {
    const PathPoint* points = toolpaths_.points.data() + path.first_point;
    line.clear();
    for (Index i = 0; i < path.point_count; ++i) line.push_back(points[i].position);
    const auto differs = [&](Index a, Index b) {
      const float turn = clock_.axis[path.first_point + a].dot(clock_.axis[path.first_point + b]);
      const double loose = detail_.loose;
      return turn < 1.0 - 0.008 * loose * loose || std::abs(points[a].height_mm - points[b].height_mm) > 0.08 * loose * most_.height ||
             std::abs(points[a].width_mm - points[b].width_mm) > 0.15 * loose * most_.width ||
             (a > 0 && std::abs(points[a].feed_mm_s - points[b].feed_mm_s) > 0.05 * loose * most_.feed);
    };
    const std::vector<Index> kept = thin_polyline(line, detail_.path_mm, differs);
    for (const Index i : kept) {
      box_.add(line[i], out.positions);
      add_direction(clock_.axis[path.first_point + i].cast<double>(), out.axes);
      out.heights.push_back(of_maximum(points[i].height_mm, most_.height));
      out.widths.push_back(of_maximum(points[i].width_mm, most_.width));
      out.feeds.push_back(of_maximum(points[i].feed_mm_s, most_.feed));
    }
    out.counts.push_back(static_cast<std::uint32_t>(kept.size()));
    out.layers.push_back(static_cast<std::int16_t>(std::clamp<Index>(path.layer, INT16_MIN, INT16_MAX)));
    out.kinds.push_back(static_cast<std::uint8_t>(static_cast<int>(path.material) | static_cast<int>(path.kind) << 1));
    const Index last = path.first_point + path.point_count - 1;
    out.times.push_back(path.point_count > 0 ? clock_.point_s[path.first_point] : 0.0f);
    out.times.push_back(path.point_count > 0 ? clock_.point_s[last] : 0.0f);
  }

 private:
  const Toolpaths& toolpaths_;
  const PrintClock& clock_;
  const Detail& detail_;
  const QuantisedBox& box_;
  Maxima most_;
};

void add_toolpaths(const Toolpaths& toolpaths, const PrintClock& clock, const Detail& detail, const QuantisedBox& box,
                   Scene& scene, const RunContext& run) {
  constexpr std::size_t kGrain = 512;
  const PathPainter painter(toolpaths, clock, detail, box);
  const std::size_t drawn = chunk_count(toolpaths.paths.size(), detail.stride);
  std::vector<PathBuffers> parts(chunk_count(drawn, kGrain));
  parallel_for(drawn, kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    std::vector<Vec3> line;
    for (std::size_t i = begin; i < end; ++i) painter.draw(toolpaths.paths[i * detail.stride], line, parts[chunk]);
  });
  PathBuffers all;
  for (const PathBuffers& part : parts) all.add(part);
  const Maxima& most = painter.maxima();
  scene.info["paths"] = {{"max_height_mm", most.height}, {"max_width_mm", most.width}, {"max_feed_mm_s", most.feed},
                         {"end_s", clock.end_s}};
  scene.add("path_positions", all.positions);
  scene.add("path_layers", all.layers);
  scene.add("path_axes", all.axes);
  scene.add("path_heights", all.heights);
  scene.add("path_widths", all.widths);
  scene.add("path_feeds", all.feeds);
  scene.add("path_kinds", all.kinds);
  scene.add("path_counts", all.counts);
  scene.add("path_times", all.times);
}

void add_texts(const PreviewInput& input, const PreviewOptions& options, Scene& scene) {
  scene.info["title"] = options.title;
  scene.info["nozzle"] = {{"half_angle_rad", options.nozzle_half_angle.radians()}, {"length_mm", options.nozzle_length_mm}};
  Json checks = Json::array();
  for (const Check& check : input.checks) {
    Json places = Json::array();
    for (const PreviewMark& mark : input.marks) {
      if (mark.check != check.name) continue;
      places.push_back({{"at", numbers(mark.position)}, {"text", mark.text}});
      if (mark.path != kNone) places.back()["path"] = mark.path;
      if (mark.layer) places.back()["layer"] = *mark.layer;
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

// What does not depend on the detail.
Scene fixed_scene(const PreviewInput& input, const PreviewOptions& options, const PrintClock& clock, const QuantisedBox& box) {
  Scene scene;
  add_texts(input, options, scene);
  scene.add_box("box", box);
  if (input.model) add_model(input, box, scene);
  if (input.skeleton) add_skeleton(*input.skeleton, box, scene);
  if (input.toolpaths) add_travels(clock, scene);
  return scene;
}

void add_drawing(const PreviewInput& input, const PrintClock& clock, const Detail& detail, const QuantisedBox& box, Scene& scene,
                 const RunContext& run) {
  if (input.layers) add_layers(*input.layers, detail, box, scene, run);
  if (input.toolpaths) add_toolpaths(*input.toolpaths, clock, detail, box, scene, run);
}

// Bytes of the drawing in the page, from every 16th sheet and path.
double expected_bytes(const PreviewInput& input, const PrintClock& clock, Detail detail, const QuantisedBox& box, const RunContext& run) {
  constexpr double kBase64 = 4.0 / 3.0;
  detail.stride = 16;
  Scene sample;
  add_drawing(input, clock, detail, box, sample, run);
  return kBase64 * static_cast<double>(detail.stride * sample.bytes());
}

}  // namespace

std::string preview_html(const PreviewInput& input, const PreviewOptions& options, const RunContext& run) {
  // Each round halves the triangles and doubles the tolerances; sixteen rounds leave nothing to coarsen.
  constexpr int kRounds = 16;
  const auto coarser = [](const Detail& d) { return Detail{2.0 * d.path_mm, 2.0 * d.outline_mm, 0.5 * d.triangles, 2.0 * d.loose, d.stride}; };
  const PrintClock clock = input.toolpaths ? run_clock(*input.toolpaths, input.motion) : PrintClock{};
  const QuantisedBox box = scene_box(input);
  const Scene fixed = fixed_scene(input, options, clock, box);
  const double room = static_cast<double>(options.max_bytes) - static_cast<double>(fixed.page(options.title).size());

  Detail detail{options.path_tolerance_mm, options.outline_tolerance_mm, static_cast<double>(options.layer_triangles)};
  int round = 0;
  for (; round < kRounds && expected_bytes(input, clock, detail, box, run) > room; ++round) detail = coarser(detail);
  for (;; ++round, detail = coarser(detail)) {
    Scene scene = fixed;
    add_drawing(input, clock, detail, box, scene, run);
    std::string page = scene.page(options.title);
    if (page.size() <= options.max_bytes || round >= kRounds) return page;
  }
}

std::vector<PreviewMark> marks_of(const MotionReport& report) {
  std::vector<PreviewMark> marks;
  for (const UnreachableWaypoint& place : report.unreachable) {
    marks.push_back({"motion.unreachable", place.tip_mm, format("path %d: %s", place.path, place.reason.c_str()), place.path});
  }
  for (const MotionCollision& place : report.collisions) {
    marks.push_back({"motion.collisions", place.contact_mm,
                     format("path %d: %s, %.2f mm deep", place.path, place.what.c_str(), place.depth_mm), place.path});
  }
  return marks;
}

std::vector<PreviewMark> marks_of(const ToolpathReport& report) {
  std::vector<PreviewMark> marks;
  for (const UnprintedPiece& piece : report.unprinted) {
    marks.push_back({"toolpath.pieces_without_path", piece.position,
                     format("layer %d: %.3f mm2 of %s without a path", piece.layer, piece.area_mm2,
                            piece.material == Material::model ? "model" : "support"), kNone, piece.layer});
  }
  return marks;
}

}  // namespace curvesup
