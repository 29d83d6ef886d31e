#include "curvesup/trim/trim.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

#include "curvesup/core/error.h"
#include "curvesup/layers/layers.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/solid/convolution_solid.h"
#include "helpers/brick_domain.h"
#include "helpers/closed_form_solids.h"
#include "helpers/layer_stacks.h"
#include "layers/sheet_edges.h"

namespace curvesup {
namespace {

using shapes::Capsules;
using shapes::sheet_area;

bool all_ok(const std::vector<Check>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.ok; });
}

// A column of support 20 x 20 x 16 on the platform, under planar layers of `thickness`.
struct Column {
  Domain domain;
  ScalarField field;
  LayerStack layers;
};

Column planar_column(double cell, double thickness) {
  Column column;
  const int n = static_cast<int>(20.0 / cell + 0.5), m = std::max(1, static_cast<int>(16.0 / cell + 0.5));
  column.domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {n, n, m}, [](const Vec3&) { return false; });
  column.field = shapes::sampled_field(column.domain, [](const Vec3& p) { return p.z() / 16.0; });
  column.layers = slice_layers(column.domain, column.field, static_cast<int>(16.0 / thickness + 0.5)).stack;
  return column;
}

// Area of the solid on a plane z by a fine raster.
double raster_area(const Solid& solid, double z, double step) {
  double area = 0.0;
  for (double x = 0.5 * step; x < 20.0; x += step) {
    for (double y = 0.5 * step; y < 20.0; y += step) area += solid.value(Vec3(x, y, z)) >= 0.0 ? step * step : 0.0;
  }
  return area;
}

TEST(Trim, ThinStrutsAreFoundAtAnyTriangleSize) {
  // Radius 0.8: upright, oblique, and lying almost in a layer; triangles up to 14 mm long.
  const Capsules solid({{{6.3, 6.1, -2}, {6.3, 6.1, 20}, 0.8},
                        {{12.2, 4.0, -2}, {16.0, 15.0, 20}, 0.8},
                        {{3.0, 13.0, 7.3}, {10.0, 15.5, 8.9}, 0.8}});
  for (const double cell : {10.0, 5.0, 2.0, 1.0}) {
    const Column column = planar_column(cell, 2.0);
    const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid, {.remove_floating = false});
    EXPECT_TRUE(all_ok(result.report.checks));
    ASSERT_EQ(result.stack.sheets.size(), 8u) << "cell " << cell;
    for (const Sheet& sheet : result.stack.sheets) {
      const double expected = raster_area(solid, 16.0 * sheet.iso_value, 0.02);
      EXPECT_NEAR(sheet_area(result.stack, sheet) / expected, 1.0, 0.01) << "cell " << cell << " layer " << sheet.layer;
    }
  }
}

// What a gap leaves of a trunk may be much thinner than a strut; the solid says so, and such a strip is not lost between samples.
TEST(Trim, ThinRestsOfAStrutAreFound) {
  class Slice final : public Capsules {
   public:
    using Capsules::Capsules;
    [[nodiscard]] double value(const Vec3& p) const override {
      return std::min(Capsules::value(p), 0.2 - std::abs(0.8 * (p.x() - 9.3) + 0.6 * (p.y() - 8.1)));
    }
    [[nodiscard]] double thinnest_rest(const Vec3&, double) const override { return 0.5; }
  };
  const Slice solid({{{9.3, 8.1, -2}, {9.3, 8.1, 20}, 2.3}});
  for (const double cell : {10.0, 5.0, 2.0}) {
    const Column column = planar_column(cell, 2.0);
    const TrimResult result =
        trim_layers(column.domain, column.field, column.layers, solid, {.edge_length_mm = 0.8, .remove_floating = false});
    ASSERT_EQ(result.stack.sheets.size(), 8u) << "cell " << cell;
    for (const Sheet& sheet : result.stack.sheets) {
      EXPECT_NEAR(sheet_area(result.stack, sheet) / raster_area(solid, 16.0 * sheet.iso_value, 0.02), 1.0, 0.03) << "cell " << cell;
    }
  }
}

TEST(Trim, TrianglesFollowTheLocalStrutRadius) {
  // A thin strut beside a thick trunk: long edges at the trunk must not cost the thin one anything.
  const std::vector<Strut> struts = {{{7, 9, -9}, {8, 9, 30}, 4.0}, {{16.5, 6, -9}, {15.5, 15, 30}, 0.8}};
  const ConvolutionSolid solid(struts), thick(std::vector<Strut>{struts[0]});
  const Column column = planar_column(5.0, 2.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_TRUE(all_ok(result.report.checks));
  ASSERT_EQ(result.stack.sheets.size(), 8u);
  EXPECT_EQ(result.report.support_pieces, 16);
  for (const Sheet& sheet : result.stack.sheets) {
    EXPECT_NEAR(sheet_area(result.stack, sheet) / raster_area(solid, 16.0 * sheet.iso_value, 0.02), 1.0, 0.005);
  }
  const TrimResult alone = trim_layers(column.domain, column.field, column.layers, thick);
  for (const Sheet& sheet : alone.stack.sheets) {
    EXPECT_LT(sheet.triangle_count, 400) << "the trunk does not need edges of 0.4 mm";
  }
}

TEST(Trim, AgreesWithCuttingEverythingFine) {
  const Capsules solid({{{6.3, 6.1, -2}, {13.3, 9.1, 20}, 0.8}, {{12.2, 4.0, -2}, {16.0, 15.0, 20}, 2.3}});
  const Column coarse = planar_column(5.0, 2.0), fine = planar_column(1.0, 2.0);
  const TrimResult fast = trim_layers(coarse.domain, coarse.field, coarse.layers, solid);
  TrimOptions brute;
  brute.edge_length_mm = 0.1;
  const TrimResult slow = trim_layers(fine.domain, fine.field, fine.layers, solid, brute);
  EXPECT_NEAR(fast.report.areas.kept_mm2 / slow.report.areas.kept_mm2, 1.0, 0.01);
}

TEST(Trim, SheetsHaveNoCracks) {
  const Capsules solid({{{6.3, 6.1, -2}, {13.3, 9.1, 20}, 1.7}, {{12.2, 4.0, -2}, {16.0, 15.0, 20}, 4.1}});
  const Domain domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {7, 6, 5}, [](const Vec3&) { return false; });
  const ScalarField field =
      shapes::sampled_field(domain, [](const Vec3& p) { return (p - Vec3(8, 8, -25)).norm() / 20.0; });
  const LayerStack layers = slice_layers(domain, field, 10).stack;
  const TrimResult result = trim_layers(domain, field, layers, solid);
  EXPECT_TRUE(all_ok(result.report.checks));
  for (const Sheet& sheet : result.stack.sheets) {
    const auto edges = sheet_edges({result.stack.triangles.data() + sheet.first_triangle, std::size_t(sheet.triangle_count)});
    for (const SheetEdge& edge : edges) {
      EXPECT_TRUE(edge.manifold());
      if (!edge.border()) continue;
      // A border is the solid's surface, the platform or the end of the domain; a crack would be deep inside. It may run
      // outside by less than half an edge only across the crease between the two capsules.
      const Vec3 p = 0.5 * (result.stack.vertices[edge.low] + result.stack.vertices[edge.high]);
      const bool end = p.z() < 1e-9 || p.x() < 1e-6 || p.y() < 1e-6 || p.x() > 20 - 1e-6 || p.y() > 20 - 1e-6 || p.z() > 16 - 1e-6;
      EXPECT_TRUE(end || (solid.value(p) < 0.02 && solid.value(p) > -0.2)) << p.transpose() << " value " << solid.value(p);
    }
  }
}

TEST(Trim, BordersLieOnTheSolid) {
  const Capsules solid({{{10.3, 9.1, -2}, {10.3, 9.1, 20}, 3.0}});
  const Column column = planar_column(2.0, 2.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  for (const Sheet& sheet : result.stack.sheets) {
    const auto edges = sheet_edges({result.stack.triangles.data() + sheet.first_triangle, std::size_t(sheet.triangle_count)});
    for (const SheetEdge& edge : edges) {
      if (!edge.border()) continue;
      const Vec3 &a = result.stack.vertices[edge.low], &b = result.stack.vertices[edge.high];
      EXPECT_NEAR(solid.value(a), 0.0, 0.02);
      EXPECT_NEAR(solid.value(0.5 * (a + b)), 0.0, 0.02);
    }
    EXPECT_NEAR(sheet_area(result.stack, sheet) / (std::numbers::pi * 9.0), 1.0, 0.002);
  }
}

TEST(Trim, SmallPiecesAreRemovedAndListed) {
  const Capsules solid({{{6, 6, -2}, {6, 6, 20}, 1.0}, {{14, 14, 7}, {14, 14, 7}, 0.25}});
  const Column column = planar_column(2.0, 2.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_TRUE(all_ok(result.report.checks));
  ASSERT_EQ(result.report.removed.size(), 1u);
  EXPECT_EQ(result.report.removed[0].layer, 3);
  EXPECT_NEAR(result.report.removed[0].area_mm2, std::numbers::pi * 0.0625, 0.01);
  EXPECT_NEAR((result.report.removed[0].centroid - Vec3(14, 14, 7)).norm(), 0.0, 0.01);
  EXPECT_EQ(result.report.support_pieces, 8);
  EXPECT_NEAR(result.report.areas.untrimmed_mm2, 8 * 400.0, 1e-6);
}

TEST(Trim, PiecesThatNothingCarriesAreRemovedAndListed) {
  // Beside a post: a block in the air two layers high, and a post that stands on nothing but is tall.
  const Capsules solid({{{4, 4, -2}, {4, 4, 20}, 1.5}, {{14, 6, 6.2}, {14, 6, 7.8}, 2.0}, {{14, 15, 5.5}, {14, 15, 30}, 1.5}});
  const Column column = planar_column(2.0, 1.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_TRUE(all_ok(result.report.checks));
  ASSERT_FALSE(result.report.removed.empty());
  for (const RemovedPiece& piece : result.report.removed) {
    EXPECT_TRUE(piece.floating);
    EXPECT_LT((piece.centroid - Vec3(14, 6, piece.centroid.z())).norm(), 0.1) << "only the block goes: branches stand on the post";
  }
  for (const Sheet& sheet : result.stack.sheets) {
    const double z = 16.0 * sheet.iso_value;
    const double expected = std::numbers::pi * 2.25 * (z < 5.5 ? 1.0 : 2.0);
    if (z > 4.0 && z < 5.6) continue;  // the tip of the second post
    EXPECT_NEAR(sheet_area(result.stack, sheet), expected, 0.1) << "z = " << z;
  }
  EXPECT_NEAR(result.report.areas.removed_mm2, 2.0 * std::numbers::pi * (4.0 + 3.51 + 1.11), 0.5);
}

TEST(Trim, AThickTrunkOnAThinPostWidensAsThePostCarriesIt) {
  const Capsules solid({{{10, 10, -2}, {10, 10, 20}, 1.0}, {{10, 10, 9.0}, {10, 10, 30}, 3.5}});
  const Column column = planar_column(1.0, 1.0);
  const TrimResult whole = trim_layers(column.domain, column.field, column.layers, solid, {.remove_floating = false});
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_TRUE(all_ok(result.report.checks));
  ASSERT_EQ(result.stack.sheets.size(), 16u);
  double below = std::numbers::pi, cut = 0.0;
  for (std::size_t s = 0; s < 16; ++s) {
    const double area = sheet_area(result.stack, result.stack.sheets[s]);
    EXPECT_LT(area, below / 0.3) << "z = " << 16.0 * result.stack.sheets[s].iso_value;
    cut += sheet_area(whole.stack, whole.stack.sheets[s]) - area;
    below = area;
  }
  EXPECT_NEAR(below, std::numbers::pi * 3.5 * 3.5, 0.1);
  double listed = 0.0;
  for (const RemovedPiece& piece : result.report.removed) {
    EXPECT_TRUE(piece.floating);
    listed += piece.area_mm2;
  }
  EXPECT_GT(cut, 10.0);
  EXPECT_NEAR(listed, cut, 1e-6);
  EXPECT_EQ(result.report.support_pieces, 16);
}

TEST(Trim, WhatLiesOnATooSmallPieceIsRemovedToo) {
  // 0.28 mm2 at z = 7 would carry three tenths of each section of the strut over it.
  const Capsules solid({{{14, 14, 6.9}, {14, 14, 7.1}, 0.3}, {{14, 14, 8.6}, {14, 14, 20}, 0.55}});
  const Column column = planar_column(1.0, 2.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_EQ(result.report.removed.size(), 5u);
  EXPECT_EQ(result.report.support_pieces, 0);
  EXPECT_TRUE(all_ok(result.report.checks));
}

TEST(Trim, VolumeIsAreaTimesHeightCutAtThePlatform) {
  const Capsules solid({{{10, 10, -9}, {10, 10, 30}, 3.0}});
  const Column column = planar_column(2.0, 2.0);
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid);
  EXPECT_NEAR(result.report.untrimmed_volume_mm3[1], 20.0 * 20.0 * 16.0, 1e-6);
  EXPECT_NEAR(result.report.printed_volume_mm3[1] / (std::numbers::pi * 9.0 * 16.0), 1.0, 0.003);
}

TEST(TrimPasses, AThickColumnIsLaidInEqualPasses) {
  const Capsules solid({{{10, 10, -9}, {10, 10, 30}, 3.0}});
  const Column column = planar_column(5.0, 2.0);
  TrimOptions options;
  options.max_height_mm = 0.7;
  const TrimResult result = trim_layers(column.domain, column.field, column.layers, solid, options);
  EXPECT_TRUE(all_ok(result.report.checks));
  ASSERT_EQ(result.stack.sheets.size(), 24u);
  for (int s = 0; s < 24; ++s) {
    const Sheet& sheet = result.stack.sheets[s];
    EXPECT_EQ(sheet.layer, s / 3);
    EXPECT_EQ(sheet.pass, s % 3);
    EXPECT_EQ(sheet.passes, 3);
    const double z = (2 * s + 1) / 3.0;
    EXPECT_NEAR(result.stack.vertices[result.stack.triangles[sheet.first_triangle][0]].z(), z, 1e-9);
    EXPECT_NEAR(sheet_area(result.stack, sheet) / (std::numbers::pi * 9.0), 1.0, 0.005);
  }
  EXPECT_NEAR(result.report.support_height_p99_mm, 2.0 / 3.0, 1e-9);
  EXPECT_NEAR(result.report.printed_volume_mm3[1] / (std::numbers::pi * 9.0 * 16.0), 1.0, 0.005);
  EXPECT_EQ(result.report.areas.kept_mm2, 0.0);
}

TEST(TrimPasses, WithoutALimitNoBeadIsHigherThanWideWithinTheModelsOwnThickness) {
  // Layers of model and support are 2 mm thick all over.
  const Capsules solid({{{10, 10, -9}, {10, 10, 30}, 3.0}});
  const Domain domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {4, 4, 8}, [](const Vec3& p) { return p.x() > 15; });
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return p.z() / 16; });
  const LayerStack layers = slice_layers(domain, field, 8).stack;
  for (const auto& [width, height] : {std::pair(0.8, 2.4), std::pair(2.7, 2.7), std::pair(5.0, 3.0)}) {
    TrimOptions options;
    options.bead_width_mm = width;
    const TrimReport report = trim_layers(domain, field, layers, solid, options).report;
    EXPECT_NEAR(report.max_height_mm, height, 1e-9) << "beads of " << width << " mm";
    EXPECT_TRUE(all_ok(report.checks));
  }
}

TEST(TrimPasses, EachRegionHasItsOwnNumberAndJoinedRegionsTheLargest) {
  // Thickness falls with x from 2 to 1 mm. Two columns stay apart; two others meet in the upper half of layer 3 only.
  const Domain domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {10, 10, 8}, [](const Vec3&) { return false; });
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return p.z() * (1 + p.x() / 20) / 16; });
  const LayerStack layers = slice_layers(domain, field, 8).stack;
  const Capsules solid({{{4, 4, -9}, {4, 4, 30}, 1.0},
                        {{16, 4, -9}, {16, 4, 30}, 1.0},
                        {{4, 16, -9}, {4, 16, 30}, 1.0},
                        {{16, 16, -9}, {16, 16, 30}, 1.0},
                        {{4, 16, 8.4}, {16, 16, 5.6}, 0.5}});
  TrimOptions options;
  options.max_height_mm = 1.2;
  const TrimResult result = trim_layers(domain, field, layers, solid, options);
  EXPECT_TRUE(all_ok(result.report.checks));
  // How often the print passes through a point's column in each slab, by the sheet that does.
  const auto passes_at = [&](double x, double y, Index layer) {
    std::map<int, int> sheets_of_m;
    for (const Sheet& sheet : result.stack.sheets) {
      if (sheet.layer != layer) continue;
      for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
        const auto corner = [&](int c) { const Vec3& p = result.stack.vertices[result.stack.triangles[i][c]]; return Vec3(p.x(), p.y(), 0); };
        if ((closest_point_on_triangle(Vec3(x, y, 0), corner(0), corner(1), corner(2)) - Vec3(x, y, 0)).norm() > 0.1) continue;
        ++sheets_of_m[sheet.passes * 100 + sheet.pass];
        break;
      }
    }
    std::vector<int> keys;
    for (const auto& [key, count] : sheets_of_m) keys.push_back(key);
    return keys;
  };
  const std::vector<int> once = {100}, twice = {200, 201};
  for (Index k = 0; k < 7; ++k) {
    EXPECT_EQ(passes_at(4, 4, k), twice) << "layer " << k;
    EXPECT_EQ(passes_at(16, 4, k), once) << "layer " << k;
    EXPECT_EQ(passes_at(4, 16, k), twice) << "layer " << k;
  }
  Index joined = 0;
  for (Index k = 0; k < 7; ++k) joined += passes_at(16, 16, k) == twice;
  EXPECT_GE(joined, 1);  // where the bridge runs along the layer, both columns are one region
  EXPECT_LE(joined, 5);
  for (Index k = 0; k < 7; ++k) EXPECT_TRUE(passes_at(16, 16, k) == once || passes_at(16, 16, k) == twice) << "layer " << k;
}

// Layers 0.5 mm thick, but 3.3 mm over 4 mm2 where the field is nearly flat.
TEST(TrimPasses, ASpotThatIsThickerThanItsRegionGetsPassesOfItsOwn) {
  const Domain domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {10, 10, 8}, [](const Vec3&) { return false; });
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) {
    const bool spot = std::abs(p.x() - 11) < 1.1 && std::abs(p.y() - 11) < 1.1 && std::abs(p.z() - 8) < 0.1;
    return (p.z() + (spot ? 1.7 : 0.0)) / 16;
  });
  const LayerStack layers = slice_layers(domain, field, 32).stack;
  const Capsules solid({{{10, 10, -9}, {10, 10, 30}, 6.0}});
  const auto highest = [&](const TrimResult& result) { return result.report.support_height_max_mm; };
  TrimOptions options;
  options.max_height_mm = 0.75;
  options.max_passes = 1;
  const TrimResult once = trim_layers(domain, field, layers, solid, options);
  EXPECT_GT(highest(once), 1.5);
  options.max_passes = 12;
  const TrimResult result = trim_layers(domain, field, layers, solid, options);
  EXPECT_TRUE(all_ok(result.report.checks));
  EXPECT_LE(highest(result), 0.75);
  EXPECT_NEAR(result.report.printed_volume_mm3[1] / (std::numbers::pi * 36.0 * 16.0), 1.0, 0.01);
  std::map<std::tuple<Index, int, int>, int> sheets;
  double in_passes = 0.0, in_one = 0.0;
  for (const Sheet& sheet : result.stack.sheets) {
    const int same = ++sheets[{sheet.layer, sheet.passes, sheet.pass}];
    EXPECT_EQ(same, 1) << "layer " << sheet.layer;
    (sheet.passes > 1 ? in_passes : in_one) += sheet_area(result.stack, sheet);
  }
  EXPECT_GT(in_passes, 1.0);
  EXPECT_GT(in_one, 0.98 * std::numbers::pi * 36.0 * 32.0) << "the spot's region stays in one pass";
}

std::size_t model_triangles(const LayerStack& stack) {
  std::size_t sum = 0;
  for (const Sheet& sheet : stack.sheets) sum += sheet.material == Material::model ? sheet.triangle_count : 0;
  return sum;
}

// Ends of the border edges of the model's sheets.
std::set<std::array<double, 6>> model_border(const LayerStack& stack) {
  std::set<std::array<double, 6>> border;
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != Material::model) continue;
    for (const SheetEdge& edge : sheet_edges({stack.triangles.data() + sheet.first_triangle, std::size_t(sheet.triangle_count)})) {
      if (!edge.border()) continue;
      const Vec3 &a = stack.vertices[edge.low], &b = stack.vertices[edge.high];
      const std::array<double, 3> p = {a.x(), a.y(), a.z()}, q = {b.x(), b.y(), b.z()};
      const auto [low, high] = std::minmax(p, q);
      border.insert({low[0], low[1], low[2], high[0], high[1], high[2]});
    }
  }
  return border;
}

TEST(Trim, TheModelKeepsItsBorderAndSharesVerticesWithItsSupport) {
  const Domain domain = shapes::floating_block_domain();
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return (p - Vec3(10, 6, -40)).norm() / 20.0; });
  const LayerStack layers = slice_layers(domain, field, 30).stack;
  const Capsules solid({{{10, 0, -4}, {10, 0, 30}, 5.0}});
  const TrimResult result = trim_layers(domain, field, layers, solid);
  std::map<std::array<double, 3>, Index> model_vertex;
  Index shared = 0, split = 0;
  std::size_t model_sheets = 0;
  for (const Sheet& sheet : result.stack.sheets) {
    model_sheets += sheet.material == Material::model;
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      for (const Index v : result.stack.triangles[i]) {
        const Vec3& p = result.stack.vertices[v];
        if (sheet.material == Material::model) {
          model_vertex.try_emplace({p.x(), p.y(), p.z()}, v);
        } else if (const auto at = model_vertex.find({p.x(), p.y(), p.z()}); at != model_vertex.end()) {
          (at->second == v ? shared : split) += 1;
        }
      }
    }
  }
  EXPECT_GT(shared, 10);
  EXPECT_EQ(split, 0);
  EXPECT_NEAR(result.report.printed_volume_mm3[0] / result.report.untrimmed_volume_mm3[0], 1.0, 5e-4);
  std::size_t expected = 0;
  for (const Sheet& sheet : layers.sheets) expected += sheet.material == Material::model;
  EXPECT_EQ(model_sheets, expected);
  EXPECT_LT(model_triangles(result.stack), model_triangles(layers));
  EXPECT_EQ(model_border(result.stack), model_border(layers));
}

TEST(Trim, ThreadsDoNotChangeAByte) {
  const Capsules solid({{{6.3, 6.1, -2}, {13.3, 9.1, 20}, 0.8}, {{12.2, 4.0, -2}, {16.0, 15.0, 20}, 2.3}});
  const Column column = planar_column(2.0, 0.5);
  RunContext two;
  two.threads = 2;
  const TrimResult a = trim_layers(column.domain, column.field, column.layers, solid);
  const TrimResult b = trim_layers(column.domain, column.field, column.layers, solid, {}, two);
  ASSERT_EQ(a.stack.vertices.size(), b.stack.vertices.size());
  ASSERT_EQ(a.stack.triangles, b.stack.triangles);
  EXPECT_EQ(std::memcmp(a.stack.vertices.data(), b.stack.vertices.data(), a.stack.vertices.size() * sizeof(Vec3)), 0);
}

TEST(Trim, RefusesOptionsOutOfRange) {
  const Column column = planar_column(10.0, 4.0);
  const Capsules solid({});
  TrimOptions options;
  options.edge_length_mm = 0.0;
  EXPECT_THROW((void)trim_layers(column.domain, column.field, column.layers, solid, options), Error);
}

}  // namespace
}  // namespace curvesup
