#include "toolpath/order.h"

#include <gtest/gtest.h>

#include <algorithm>

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
std::string printed(const sheets::NamedSheet& sheets, const ToolpathOptions& options = {}) {
  const Toolpaths toolpaths = plan_toolpaths(sheets.gradient, sheets.stack, options).toolpaths;
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

// Four layers of model and of support, `gap` apart.
sheets::NamedSheet towers(double gap) {
  sheets::NamedSheet sheets;
  for (Index k = 0; k < 4; ++k) {
    add_sheet(sheets, k, Material::model, 0, 1, 0.0);
    add_sheet(sheets, k, Material::support, 0, 1, 6.0 + gap);
  }
  return sheets;
}

TEST(PrintOrder, SupportIsLaidAheadWhereTheNozzleMeetsNoneOfIt) {
  ToolpathOptions options;
  EXPECT_EQ(printed(towers(6.0), options), "smsms");
  options.support_batch_layers = 4;
  EXPECT_EQ(printed(towers(6.0), options), "sm");
  EXPECT_EQ(printed(towers(1.0), options), "smsms");  // the model would be laid beside higher support
  options.support_batch_layers = 2;
  EXPECT_EQ(printed(towers(6.0), options), "smsm");
  const auto report = plan_toolpaths(towers(6.0).gradient, towers(6.0).stack, options).report;
  EXPECT_EQ(report.batched_layers, 2);
  EXPECT_EQ(report.groups, 2);
  EXPECT_EQ(report.material_changes, 3);
}

TEST(PrintOrder, SupportThatStandsOnTheModelWaitsForIt) {
  sheets::NamedSheet sheets;
  for (Index k = 0; k < 2; ++k) add_sheet(sheets, k, Material::model, 0, 1, 0.0);
  add_sheet(sheets, 2, Material::support, 0, 1, 0.0);
  ToolpathOptions options;
  options.support_batch_layers = 5;
  EXPECT_EQ(printed(sheets, options), "ms");
}

TEST(PrintOrder, TravelBetweenPiecesIsShort) {
  // 36 pieces in a square: there and back takes 35 steps of one pitch; a tour in the order of the rows takes more.
  std::vector<Vec3> centres;
  for (int i = 0; i < 36; ++i) centres.push_back(Vec3(10.0 * (i * 7 % 36 % 6), 10.0 * (i * 7 % 36 / 6), 0.0));
  const auto tour = toolpath::short_tour(centres, Vec3(-5, -5, 0));
  std::vector<Index> sorted = tour;
  std::sort(sorted.begin(), sorted.end());
  for (Index i = 0; i < 36; ++i) EXPECT_EQ(sorted[i], i);
  double length = 0.0;
  for (std::size_t i = 1; i < tour.size(); ++i) length += (centres[tour[i]] - centres[tour[i - 1]]).norm();
  EXPECT_GE(length, 350.0 - 1e-9);
  EXPECT_LE(length, 1.1 * 350.0);
}

TEST(PrintOrder, BeadsOverNothingAreSlower) {
  // The second layer reaches 6 mm farther than the first.
  sheets::NamedSheet sheets;
  add_sheet(sheets, 0, Material::model, 0, 1, 0.0);
  add_sheet(sheets, 1, Material::model, 0, 1, 0.0);
  add_sheet(sheets, 1, Material::support, 0, 1, 6.0);
  ToolpathOptions options;
  options.overhang_speed_factor = 0.5;
  options.max_flow_mm3_s = 1e6;
  options.min_layer_time_s = 0.0;
  const auto result = plan_toolpaths(sheets.gradient, sheets.stack, options);
  for (const Path& path : result.toolpaths.paths) {
    if (path.layer == 0) continue;
    for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
      EXPECT_EQ(result.toolpaths.points[k].feed_mm_s, path.material == Material::support ? 5.0 : 10.0) << result.toolpaths.points[k].position.transpose();
    }
  }
  EXPECT_GT(result.report.overhang_mm, 60.0);
}

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
