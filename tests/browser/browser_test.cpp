// Opens a page in headless Chromium. What the page shows is made here from the shipped block and simple layers and paths,
// so that the stored picture depends on the viewer and not on the support.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "curvesup/io/tet_file.h"
#include "curvesup/model/place.h"
#include "curvesup/overhang/overhang.h"
#include "curvesup/preview/preview.h"
#include "helpers/toolpath_shapes.h"

namespace curvesup {
namespace {

constexpr int kBelow = 3;

// Squares of side 2 r around the axis through (x, y), one a millimetre from z = 0.5 up; the numbers of layers begin below 0,
// as those of support do.
LayerStack square_layers(double x, double y, double r, int count, Material material) {
  LayerStack stack;
  stack.count = count;
  for (int k = 0; k < count; ++k) {
    const auto first = static_cast<Index>(stack.vertices.size());
    for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) stack.vertices.emplace_back(x + r * u, y + r * v, k + 0.5);
    Sheet sheet;
    sheet.layer = k - kBelow;
    sheet.material = material;
    sheet.first_triangle = static_cast<Index>(stack.triangles.size());
    sheet.triangle_count = 2;
    stack.triangles.push_back({first, first + 1, first + 2});
    stack.triangles.push_back({first, first + 2, first + 3});
    stack.sheets.push_back(sheet);
  }
  stack.triangle_tet.assign(stack.triangles.size(), 0);
  return stack;
}

std::string block_page() {
  const ModelResult block = load_model("block", read_tet_file(CURVESUP_DATA "/block/model.tet"));
  std::vector<double> height;
  for (const Vec3& v : block.model.mesh.vertices) height.push_back(v.z());
  const ScalarField field = make_scalar_field(block.model.mesh, height);
  const Overhang overhang = find_overhang(block.model, field);
  const Vec3 centre = 0.5 * (block.report.low + block.report.high);
  const LayerStack layers = square_layers(centre.x(), block.report.low.y() - 4.0, 3.0, static_cast<int>(block.report.high.z()), Material::support);
  Skeleton skeleton;
  skeleton.nodes = {{Vec3(centre.x(), centre.y(), 12)}, {Vec3(centre.x(), centre.y(), 0)}};
  skeleton.edges = {{0, 1, 1, 0.8, 0}};
  Toolpaths toolpaths;
  for (int k = 0; k < 12; ++k) shapes::add_ring(toolpaths, Vec3(centre.x(), centre.y(), k + 0.5), 8.0, 0.03 * k, k, 90);
  const std::vector<Check> checks = {check_at_most("motion.collisions", 1, 0), check_at_most("emit.volume", 0, 1)};
  const std::vector<PreviewMark> marks = {{"motion.collisions", Vec3(centre.x(), centre.y(), 12.0), "path 7", 7}};
  const std::vector<Plot> plots = make_plots({.toolpaths = &toolpaths});
  PreviewInput input;
  input.model = &block.model;
  input.overhang = &overhang;
  input.skeleton = &skeleton;
  input.layers = &layers;
  input.toolpaths = &toolpaths;
  input.checks = checks;
  input.marks = marks;
  input.plots = plots;
  input.report_json = R"({"print": {"time_s": 754, "material_changes": 3}, "model": {"volume_mm3": 4200}})";
  return preview_html(input, {.title = "block"});
}

TEST(Browser, PreviewPageWorks) {
  const std::string folder = CURVESUP_DATA "/../tests/browser/", page = CURVESUP_BINARY_DIR "/browser_test.html";
  std::ofstream(page, std::ios::binary) << block_page();
  const std::string command = "PYTHONDONTWRITEBYTECODE=1 python3 '" + folder + "check_page.py' '" + page + "' '" + folder +
                              "block.png' '" CURVESUP_BINARY_DIR "/browser_test.png' 2>&1";
  FILE* output = popen(command.c_str(), "r");
  ASSERT_NE(output, nullptr);
  std::string text;
  for (int c = std::fgetc(output); c != EOF; c = std::fgetc(output)) text += static_cast<char>(c);
  const int status = pclose(output);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  const char* ci = std::getenv("CI");
  if (code == 77 && (ci == nullptr || std::string(ci) != "true")) GTEST_SKIP() << text;
  EXPECT_EQ(code, 0) << text;
}

}  // namespace
}  // namespace curvesup
