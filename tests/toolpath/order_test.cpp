#include "toolpath/order.h"

#include <gtest/gtest.h>

#include "curvesup/toolpath/plan_toolpaths.h"
#include "toolpath/sheets.h"

namespace curvesup {
namespace {

// Adds a flat strip 12 x 6 mm as one sheet of 0.8 mm thick layers, the middle of layer 0 at z = 10.4.
void add_sheet(sheets::NamedSheet& to, Index layer, Material material, int pass, int passes, double y) {
  const double middle = 10.0 + 0.8 * (layer + (pass + 0.5) / passes);
  const auto strip = sheets::mapped_grid(
      12, 6, [&](double u, double v) { return Vec3(12.0 * u, y + 6.0 * v, middle); }, 0.8);
  to.stack.count = strip.stack.count;
  Sheet sheet{.layer = layer, .pass = pass, .passes = passes, .material = material};
  sheet.iso_value = (layer + (pass + 0.5) / passes) / strip.stack.count;
  sheet.first_triangle = static_cast<Index>(to.stack.triangles.size());
  sheet.triangle_count = static_cast<Index>(strip.stack.triangles.size());
  const Index first_vertex = static_cast<Index>(to.stack.vertices.size());
  to.stack.vertices.insert(to.stack.vertices.end(), strip.stack.vertices.begin(), strip.stack.vertices.end());
  for (auto triangle : strip.stack.triangles) {
    for (Index& v : triangle) v += first_vertex;
    to.stack.triangle_tet.push_back(static_cast<Index>(to.stack.triangles.size()));
    to.stack.triangles.push_back(triangle);
  }
  to.gradient.insert(to.gradient.end(), strip.gradient.begin(), strip.gradient.end());
  to.stack.sheets.push_back(sheet);
}

// One letter a run of paths: m, s, or S for an upper pass of support.
std::string printed(const sheets::NamedSheet& sheets) {
  const Toolpaths toolpaths = plan_toolpaths(sheets.gradient, sheets.stack).toolpaths;
  std::string text;
  for (const Path& path : toolpaths.paths) {
    const char letter = path.material == Material::model ? 'm' : path.pass > 0 ? 'S' : 's';
    if (text.empty() || text.back() != letter) text += letter;
  }
  return text;
}

// A layer of the model, then one in which support lies beside it, in two passes, `gap` away.
sheets::NamedSheet two_layers(double gap, int passes) {
  sheets::NamedSheet sheets;
  add_sheet(sheets, 0, Material::model, 0, 1, 0.0);
  for (int pass = 0; 2 * pass < passes; ++pass) add_sheet(sheets, 1, Material::support, pass, passes, 6.0 + gap);
  add_sheet(sheets, 1, Material::model, 0, 1, 0.0);
  for (int pass = (passes + 1) / 2; pass < passes; ++pass) add_sheet(sheets, 1, Material::support, pass, passes, 6.0 + gap);
  return sheets;
}

TEST(PrintOrder, GoesOnWithTheMaterialThatWasLaidLast) { EXPECT_EQ(printed(two_layers(0.0, 1)), "ms"); }

TEST(PrintOrder, LowPassesOfSupportBesideTheModelComeBeforeIt) { EXPECT_EQ(printed(two_layers(0.0, 2)), "msSm"); }

TEST(PrintOrder, LowPassesFarFromTheModelAskForNoChange) { EXPECT_EQ(printed(two_layers(3.0, 2)), "msS"); }

TEST(PrintOrder, WhatRisesLessIsLaidFirst) {
  // The second of three passes has the iso-value of a single pass, and ends below it.
  sheets::NamedSheet sheets;
  add_sheet(sheets, 0, Material::support, 0, 3, 8.0);
  add_sheet(sheets, 0, Material::support, 0, 1, 0.0);
  add_sheet(sheets, 0, Material::support, 1, 3, 8.0);
  add_sheet(sheets, 0, Material::support, 2, 3, 8.0);
  const Toolpaths toolpaths = plan_toolpaths(sheets.gradient, sheets.stack).toolpaths;
  double top = 0.0;
  for (const Path& path : toolpaths.paths) {
    const PathPoint& point = toolpaths.points[path.first_point];
    EXPECT_GE(point.position.z() + point.tip_offset_mm, top - 1e-9);
    top = point.position.z() + point.tip_offset_mm;
  }
}

}  // namespace
}  // namespace curvesup
