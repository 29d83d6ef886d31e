#include "curvesup/preview/preview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/preview/inspect.h"
#include "helpers/shapes.h"
#include "helpers/toolpath_shapes.h"
#include "preview/print_clock.h"
#include "preview/scene.h"
#include "preview/thin.h"

namespace curvesup {
namespace {

using Json = nlohmann::ordered_json;

Json scene_of(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"scene\">";
  const std::size_t begin = page.find(open) + open.size();
  return Json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

// A flat square [0, 10]^2 at z = 1 of 2 * cells^2 triangles, as sheet of layer 0, with a square hole when asked for.
LayerStack square_sheet(int cells, bool hole = false) {
  LayerStack stack;
  stack.count = 1;
  const double step = 10.0 / cells;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) stack.vertices.emplace_back(i * step, j * step, 1.0);
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      if (hole && std::abs(i + 0.5 - 0.5 * cells) < 0.2 * cells && std::abs(j + 0.5 - 0.5 * cells) < 0.2 * cells) continue;
      const Index a = j * (cells + 1) + i, b = a + 1, c = a + cells + 1, d = c + 1;
      stack.triangles.push_back({a, b, d});
      stack.triangles.push_back({a, d, c});
    }
  }
  stack.triangle_tet.assign(stack.triangles.size(), 0);
  Sheet sheet;
  sheet.triangle_count = static_cast<Index>(stack.triangles.size());
  sheet.material = Material::support;
  stack.sheets.push_back(sheet);
  return stack;
}

double length(const std::vector<Vec3>& chain) {
  double sum = 0.0;
  for (std::size_t i = 1; i < chain.size(); ++i) sum += (chain[i] - chain[i - 1]).norm();
  return sum;
}

struct Block {
  Model model = shapes::block_on_legs();
  Toolpaths toolpaths = shapes::flat_rings(12.0, 4);
  LayerStack layers = square_sheet(20);
  Overhang overhang;
  Skeleton skeleton;
  std::vector<Check> checks = {check_at_most("motion.collisions", 2, 0, "nozzle </script><b>touches"),
                               check_at_most("emit.volume", 0, 1)};
  std::vector<PreviewMark> marks = {{"motion.collisions", Vec3(15, 5, 18), "path 3"}};

  Block() {
    overhang.faces = {0, 1, 2};
    skeleton.nodes = {{Vec3(15, 5, 12)}, {Vec3(15, 5, 0)}};
    skeleton.edges = {{0, 1, 1, 0.8, 0}};
  }
  [[nodiscard]] PreviewInput input() const {
    PreviewInput in;
    in.model = &model;
    in.overhang = &overhang;
    in.skeleton = &skeleton;
    in.layers = &layers;
    in.toolpaths = &toolpaths;
    in.checks = checks;
    in.marks = marks;
    in.report_json = R"({"print": {"time_s": 60}, "checks": [], "stages": [{"name": "hull", "wall_s": 1.25}]})";
    in.config_json = R"({"layers": {"count": 80}})";
    return in;
  }
};

TEST(Thin, DropsWhatTheChordCovers) {
  std::vector<Vec3> arc;
  for (int i = 0; i <= 500; ++i) {
    const double a = std::numbers::pi * i / 500;
    arc.emplace_back(10 * std::cos(a), 10 * std::sin(a), 0.01 * i);
  }
  const auto kept = thin_polyline(arc, 0.05);
  EXPECT_LT(kept.size(), 60u);
  EXPECT_EQ(kept.front(), 0);
  EXPECT_EQ(kept.back(), 500);
  for (std::size_t k = 1; k < kept.size(); ++k) {
    for (Index i = kept[k - 1]; i <= kept[k]; ++i) {
      EXPECT_LE((closest_point_on_segment(arc[i], arc[kept[k - 1]], arc[kept[k]]) - arc[i]).norm(), 0.05 + 1e-12);
    }
  }
}

TEST(Thin, KeepsCornersAndWhatIsAskedFor) {
  const std::vector<Vec3> corner = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(2, 1, 0), Vec3(2, 2, 0)};
  EXPECT_EQ(thin_polyline(corner, 0.01), (std::vector<Index>{0, 2, 4}));
  const auto all = thin_polyline(corner, 0.01, [](Index, Index) { return true; });
  EXPECT_EQ(all.size(), corner.size());
  EXPECT_EQ(thin_polyline({}, 0.01).size(), 0u);
  EXPECT_EQ(thin_polyline(std::vector<Vec3>{Vec3::Zero()}, 0.01).size(), 1u);
}

TEST(Thin, SheetKeepsItsPlaceAndNearlyItsArea) {
  const LayerStack stack = square_sheet(100);
  SheetReader reader(stack);
  reader.read(stack.sheets[0]);
  const CoarseSheet coarse = reader.coarse(1.0);
  EXPECT_LT(coarse.triangles.size(), 300u);
  double area = 0.0;
  for (const auto& t : coarse.triangles) {
    const Vec3 n = area_normal(coarse.vertices[t[0]], coarse.vertices[t[1]], coarse.vertices[t[2]]);
    EXPECT_GE(n.z(), 0.0);
    area += 0.5 * n.norm();
  }
  EXPECT_GT(area, 98.0);  // corners may be cut, borders not moved inwards
  EXPECT_LT(area, 100.0 + 1e-9);
}

// A sheet bent so sharply that moving vertices to the means of their cells turns triangles over.
TEST(Thin, CoarseTrianglesKeepTheirSide) {
  LayerStack stack = square_sheet(60);
  for (Vec3& v : stack.vertices) v.z() = 0.8 * std::abs(std::fmod(v.x() + 0.3 * v.y(), 1.4) - 0.7);
  SheetReader reader(stack);
  reader.read(stack.sheets[0]);
  const CoarseSheet coarse = reader.coarse(0.45);
  ASSERT_GT(coarse.triangles.size(), 200u);
  for (const auto& t : coarse.triangles) {
    EXPECT_GE(area_normal(coarse.vertices[t[0]], coarse.vertices[t[1]], coarse.vertices[t[2]]).z(), -1e-12);
  }
}

TEST(Thin, BordersAreClosedChains) {
  const LayerStack stack = square_sheet(20, true);
  SheetReader reader(stack);
  reader.read(stack.sheets[0]);
  const auto chains = reader.borders();
  ASSERT_EQ(chains.size(), 2u);
  double total = 0.0;
  for (const auto& chain : chains) {
    EXPECT_EQ(chain.front(), chain.back());
    total += length(chain);
  }
  EXPECT_NEAR(total, 40.0 + 16.0, 1e-9);
}

TEST(Scene, PositionsAndDirectionsSurviveRounding) {
  QuantisedBox box;
  box.include(Vec3(-3, 0, 2));
  box.include(Vec3(97, 0, 52));
  for (const Vec3& p : {Vec3(-3, 0, 2), Vec3(97, 0, 52), Vec3(12.3456, 0, 33.3)}) {
    std::vector<std::uint16_t> q;
    box.add(p, q);
    const Vec3 back = box.low + (box.high - box.low).cwiseProduct(Vec3(q[0], q[1], q[2]) / 65535.0);
    EXPECT_LT((back - p).norm(), 0.002);
  }
  for (const Vec3& raw : {Vec3(0, 0, 1), Vec3(0, 0, -1), Vec3(1, -2, 0.3), Vec3(-1, 0.4, -2), Vec3(0.2, -0.1, -0.05)}) {
    const Vec3 n = raw.normalized();
    std::vector<std::int8_t> q;
    add_direction(n, q);
    Vec3 back(q[0] / 127.0, q[1] / 127.0, 0.0);
    back.z() = 1.0 - std::abs(back.x()) - std::abs(back.y());
    if (back.z() < 0.0) {
      back.head<2>() = Eigen::Vector2d((1 - std::abs(back.y())) * (back.x() < 0 ? -1 : 1), (1 - std::abs(back.x())) * (back.y() < 0 ? -1 : 1));
    }
    EXPECT_GT(back.normalized().dot(n), std::cos(1.0 * std::numbers::pi / 180));
  }
}

TEST(Scene, Base64) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("\xff\xfe\xfd\x01"), "//79AQ==");
}

TEST(PrintClock, FeedsAndJumps) {
  Toolpaths toolpaths;
  const std::vector<Vec3> up(3, Vec3::UnitZ());
  shapes::add_path(toolpaths, {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(30, 0, 0)}, up, 0, Material::model, false, 0.6, 0.8, 10.0);
  shapes::add_path(toolpaths, {Vec3(80, 0, 0), Vec3(90, 0, 0), Vec3(90, 5, 0)}, up, 0, Material::model, false, 0.6, 0.8, 5.0);
  const PrintClock clock = run_clock(toolpaths, nullptr);
  EXPECT_FLOAT_EQ(clock.point_s[1], 1.0);
  EXPECT_FLOAT_EQ(clock.point_s[2], 3.0);
  EXPECT_FLOAT_EQ(clock.point_s[3], 3.0 + 50.0 / 50.0 + 1.5);
  EXPECT_DOUBLE_EQ(clock.end_s, 5.5 + 3.0);
  ASSERT_EQ(clock.travels.size(), 1u);
  EXPECT_EQ(clock.travels[0].tips.back(), Vec3(80, 0, 0));
}

TEST(PrintClock, FollowsTheMotion) {
  Toolpaths toolpaths;
  const std::vector<Vec3> up(3, Vec3::UnitZ());
  shapes::add_path(toolpaths, {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(40, 0, 0)}, up, 0);
  Motion motion;
  motion.part_rotation_rad = 0.5 * std::numbers::pi;
  motion.part_offset_mm = Vec3(100, 0, 0);
  Travel travel;
  travel.tip_mm = Vec3(100, 0, 0);
  travel.duration_s = 7.0;
  motion.travels = {travel};
  Waypoint first, last;
  first.point = 0;
  first.tip_mm = Vec3(100, 0, 0);
  last.point = 2;
  last.duration_s = 8.0;
  last.tip_mm = Vec3(100, 40, 0);
  last.axis = Vec3(0, 0.6, 0.8);  // leans along +y of the platform, that is +x of the part
  motion.waypoints = {first, last};
  PathMotion chain;
  chain.waypoint_count = 2;
  chain.travel_count = 1;
  motion.paths = {chain};
  motion.final_travel = 1;
  const PrintClock clock = run_clock(toolpaths, &motion);
  EXPECT_FLOAT_EQ(clock.point_s[0], 7.0);
  EXPECT_FLOAT_EQ(clock.point_s[1], 9.0);  // a quarter of the way
  EXPECT_FLOAT_EQ(clock.point_s[2], 15.0);
  EXPECT_LT((clock.axis[2] - Eigen::Vector3f(0.6f, 0.0f, 0.8f)).norm(), 1e-6f);
}

TEST(PreviewPage, HoldsEverythingAndNothingThatLoads) {
  const Block block;
  const std::string page = preview_html(block.input(), {.title = "a <block> & more"});
  EXPECT_NE(page.find("<title>a &lt;block&gt; &amp; more</title>"), std::string::npos);
  EXPECT_EQ(count_of(page, "</script>"), 5u) << "a text of the report ends a script";
  EXPECT_EQ(page.find("@@"), std::string::npos);
  EXPECT_EQ(page.find("<script src"), std::string::npos);
  EXPECT_EQ(page.find("<link rel=\"stylesheet"), std::string::npos);
  const Json scene = scene_of(page);
  EXPECT_EQ(scene["checks"][0]["detail"], "nozzle </script><b>touches");
  EXPECT_EQ(scene["checks"][0]["places"][0]["at"], Json({15.0, 5.0, 18.0}));
  EXPECT_EQ(scene["buffers"]["model_faces"]["count"], 3 * block.model.boundary.size());
  EXPECT_EQ(scene["buffers"]["path_counts"]["count"], block.toolpaths.paths.size());
  EXPECT_EQ(scene["buffers"]["edge_radius"]["count"], 1);
}

TEST(PreviewPage, SameBytesAndNoTimes) {
  const Block block;
  const std::string page = preview_html(block.input());
  EXPECT_EQ(page, preview_html(block.input()));
  PreviewInput slower = block.input();
  slower.report_json = R"({"print": {"time_s": 60}, "checks": [], "stages": [{"name": "hull", "wall_s": 9.5}]})";
  EXPECT_EQ(page, preview_html(slower));
  EXPECT_FALSE(scene_of(page)["report"].contains("stages"));
}

TEST(PreviewPage, StandsMissingStages) {
  const std::string page = preview_html({});
  EXPECT_TRUE(scene_of(page)["report"].is_null());
  Block block;
  PreviewInput input = block.input();
  input.toolpaths = nullptr;
  input.skeleton = nullptr;
  EXPECT_FALSE(scene_of(preview_html(input))["buffers"].contains("path_positions"));
}

TEST(PreviewPage, GetsCoarserUntilItIsSmallEnough) {
  Block block;
  block.toolpaths = shapes::flat_rings(40.0, 60);
  const std::string fine = preview_html(block.input());
  PreviewOptions options;
  options.max_bytes = fine.size() - 100'000;
  EXPECT_LE(preview_html(block.input(), options).size(), options.max_bytes);
}

// What changes from point to point must not hold all of them.
TEST(PreviewPage, GetsSmallEnoughHoweverHeightsAndTiltsChange) {
  Block block;
  block.toolpaths = shapes::flat_rings(40.0, 60);
  const PreviewInput input = block.input();
  const std::size_t even = preview_html(input).size();
  for (std::size_t i = 0; i < block.toolpaths.points.size(); ++i) {
    PathPoint& point = block.toolpaths.points[i];
    point.height_mm = i % 2 ? 0.2 : 0.9;
    point.normal = Vec3(0.5 * std::sin(0.7 * static_cast<double>(i)), 0, 1).normalized();
  }
  EXPECT_GT(preview_html(input).size(), even + 30'000);
  PreviewOptions options;
  options.max_bytes = even;
  EXPECT_LE(preview_html(input, options).size(), options.max_bytes);
}

TEST(PreviewPage, DoesNotDependOnTheThreads) {
  Block block;
  block.toolpaths = Toolpaths();
  for (int copy = 0; copy < 300; ++copy) {
    for (const double y : {0.0, 1.0, 2.0, 3.0}) {
      shapes::add_path(block.toolpaths, {Vec3(copy, y, 0), Vec3(copy, y, 0.5 * copy), Vec3(copy + 1, y, 1)},
                       std::vector<Vec3>(3, Vec3::UnitZ()), copy);
    }
  }
  const Sheet sheet = block.layers.sheets[0];
  block.layers.sheets.assign(50, sheet);
  for (int k = 0; k < 50; ++k) block.layers.sheets[k].layer = k;
  RunContext three;
  three.threads = 3;
  const std::string page = preview_html(block.input());
  EXPECT_TRUE(page == preview_html(block.input(), {}, three));
  EXPECT_EQ(scene_of(page)["buffers"]["path_counts"]["count"], 1200);
  EXPECT_EQ(scene_of(page)["buffers"]["support_layers_sheet_layer"]["count"], 50);
}

TEST(InspectPage, MarksBadElements) {
  TetMesh mesh = shapes::brick_mesh(Vec3(0, 0, 0), Vec3(4, 4, 4), {2, 2, 2});
  std::swap(mesh.tets[7][2], mesh.tets[7][3]);
  mesh.tets[9][3] = 9999;
  mesh.vertices.push_back(Vec3(std::nan(""), 0, 0));
  const MeshDiagnosis diagnosis = diagnose_mesh(mesh);
  const std::string page = inspect_html(diagnosis, mesh, "bad.tet");
  const Json scene = scene_of(page);
  ASSERT_FALSE(diagnosis.problems.empty());
  EXPECT_EQ(scene["checks"].size(), diagnosis.problems.size());
  EXPECT_EQ(scene["report"]["mesh"]["usable"], diagnosis.usable());
  for (std::size_t i = 0; i < diagnosis.problems.size(); ++i) {
    EXPECT_EQ(scene["checks"][i]["value"], diagnosis.problems[i].count());
    if (diagnosis.problems[i].name == "inverted_tets") {
      EXPECT_EQ(scene["checks"][i]["places"].size(), 1u);
    }
  }
  EXPECT_GE(scene["buffers"]["bad_triangles"]["count"].get<int>(), 4 * 9);
}

}  // namespace
}  // namespace curvesup
