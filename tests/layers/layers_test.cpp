#include "curvesup/layers/layers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "curvesup/core/error.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "helpers/brick_domain.h"
#include "helpers/layer_stacks.h"

namespace curvesup {
namespace {

using shapes::sheet_area;

Domain all_support(const Vec3& low, const Vec3& high, std::array<int, 3> cells) {
  return shapes::brick_domain(low, high, cells, [](const Vec3&) { return false; });
}

ScalarField radial(const Domain& domain, const Vec3& centre) {
  return shapes::sampled_field(domain, [&](const Vec3& p) { return (p - centre).norm() / 20.0; });
}

bool all_ok(const std::vector<Check>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.ok; });
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(Layers, PlanarLayersOfABlockHaveItsCrossSection) {
  const Domain domain = shapes::floating_block_domain();
  // Values of iso at k + 1/2 fall exactly on vertices (odd z): the tie rule has to hold.
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return (p.z() - 0.5) / 20.0; });
  const LayersResult result = slice_layers(domain, field, 20);
  EXPECT_TRUE(all_ok(result.report.checks));
  EXPECT_EQ(result.report.model_layers, 10);
  EXPECT_NEAR(result.report.thickness_p50_mm, 1.0, 1e-12);
  std::map<Index, std::array<double, 2>> area;
  for (const Sheet& sheet : result.stack.sheets) {
    EXPECT_DOUBLE_EQ(sheet.iso_value, (sheet.layer + 0.5) / 20.0);
    area[sheet.layer][static_cast<int>(sheet.material)] += sheet_area(result.stack, sheet);
  }
  for (const auto& [k, a] : area) {
    const double z = k + 1.0;
    EXPECT_NEAR(a[0] + a[1], 28.0 * 20.0, 1e-9) << "layer " << k;
    EXPECT_NEAR(a[0], z > 11 && z <= 21 ? 20.0 * 12.0 : 0.0, 1e-9) << "layer " << k;
  }
  EXPECT_EQ(area.begin()->first, 0);  // z = 1; the layer at z = 0 has no area above the platform
}

TEST(Layers, SphereHasItsArea) {
  const Domain domain = all_support(Vec3(-9, -9, 1), Vec3(9, 9, 19), {36, 36, 36});
  const LayersResult result = slice_layers(domain, radial(domain, Vec3(0, 0, 10)), 16);
  EXPECT_TRUE(all_ok(result.report.checks));
  for (const Sheet& sheet : result.stack.sheets) {
    const double r = 20.0 * sheet.iso_value;
    if (r < 3.0 || r > 8.9) continue;
    const double exact = 4.0 * std::numbers::pi * r * r;
    EXPECT_NEAR(sheet_area(result.stack, sheet) / exact, 1.0, 0.015) << "radius " << r;
  }
}

TEST(Layers, NormalsPointAlongTheGradient) {
  const Domain domain = shapes::floating_block_domain();
  const ScalarField field = radial(domain, Vec3(10, 6, -20));
  const LayersResult result = slice_layers(domain, field, 30);
  const LayerStack& stack = result.stack;
  for (std::size_t i = 0; i < stack.triangles.size(); ++i) {
    const auto& t = stack.triangles[i];
    const Vec3 n = area_normal(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
    if (n.norm() < 1e-9) continue;
    EXPECT_GT(n.normalized().dot(print_direction(field, stack.triangle_tet[i])), 0.999);
  }
}

TEST(Layers, ModelAndSupportShareTheirBorderById) {
  const Domain domain = shapes::floating_block_domain();
  const LayersResult result = slice_layers(domain, radial(domain, Vec3(10, 6, -20)), 60);
  EXPECT_TRUE(all_ok(result.report.checks));
  // Oracle of its own: no two vertices at one place in one layer, unless a mesh vertex lies on the surface.
  const LayerStack& stack = result.stack;
  std::map<Index, std::map<std::array<double, 3>, Index>> at;
  Index shared = 0;
  for (const Sheet& sheet : stack.sheets) {
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      for (const Index v : stack.triangles[i]) {
        const Vec3& p = stack.vertices[v];
        const auto [place, is_new] = at[sheet.layer].try_emplace({p.x(), p.y(), p.z()}, v);
        EXPECT_EQ(place->second, v);
        shared += !is_new && sheet.material == Material::support;
      }
    }
  }
  EXPECT_GT(shared, 0);
}

TEST(Layers, NothingIsBelowThePlatformAndTheCutIsClosed) {
  const Domain domain = shapes::floating_block_domain();
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return (p.z() + 0.8 * p.x()) / 20.0; });
  const LayersResult result = slice_layers(domain, field, 20);
  EXPECT_TRUE(all_ok(result.report.checks));
  const LayerStack& stack = result.stack;
  const Vec3 normal = Vec3(0.8, 0, 1).normalized();
  for (const Sheet& sheet : stack.sheets) {
    std::map<std::pair<Index, Index>, int> uses;
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      const auto& t = stack.triangles[i];
      for (int c = 0; c < 3; ++c) {
        EXPECT_GE(stack.vertices[t[c]].z(), 0.0);
        ++uses[std::minmax(t[c], t[(c + 1) % 3])];
      }
    }
    // What is left open lies on the hull, on the model or on the platform: inside the domain there is no crack.
    for (const auto& [edge, count] : uses) {
      if (count == 2) continue;
      const Vec3 middle = 0.5 * (stack.vertices[edge.first] + stack.vertices[edge.second]);
      const bool outer = middle.x() < -3.999 || middle.x() > 23.999 || middle.y() < -3.999 || middle.y() > 15.999 ||
                         middle.z() < 1e-12 || middle.z() > 24.999;
      const bool block = middle.x() > -0.001 && middle.x() < 20.001 && middle.y() > -0.001 && middle.y() < 12.001 &&
                         middle.z() > 10.999 && middle.z() < 21.001;
      EXPECT_TRUE(outer || block) << middle.transpose();
    }
  }
  // The plane z + 0.8 x = k + 1/2 inside the box [-4, 24] x [-4, 16] x [0, 25].
  std::map<Index, double> area;
  for (const Sheet& sheet : stack.sheets) area[sheet.layer] += sheet_area(stack, sheet);
  for (const auto& [k, a] : area) {
    const double c = k + 0.5;
    const double x0 = std::max(-4.0, (c - 25.0) / 0.8), x1 = std::min(24.0, c / 0.8);
    EXPECT_NEAR(a, 20.0 * (x1 - x0) / normal.z(), 1e-6) << "layer " << k;
  }
}

TEST(Layers, NegativeLayersExist) {
  const Domain domain = shapes::floating_block_domain();
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return (p.z() - 11.0) / 10.0; });
  const LayersResult result = slice_layers(domain, field, 10);
  EXPECT_EQ(result.stack.sheets.front().layer, -11);  // z = 0.5
  EXPECT_EQ(result.stack.sheets.front().material, Material::support);
  EXPECT_EQ(result.report.model_layers, 10);
  EXPECT_EQ(result.report.support_layers, 25);
}

TEST(Layers, SheetsAreInOrderAndTileTheTriangles) {
  const Domain domain = shapes::floating_block_domain();
  const LayerStack stack = slice_layers(domain, radial(domain, Vec3(10, 6, -20)), 40).stack;
  Index next = 0;
  for (std::size_t s = 0; s < stack.sheets.size(); ++s) {
    EXPECT_EQ(stack.sheets[s].first_triangle, next);
    EXPECT_GT(stack.sheets[s].triangle_count, 0);
    next += stack.sheets[s].triangle_count;
    if (s == 0) continue;
    const Sheet &a = stack.sheets[s - 1], &b = stack.sheets[s];
    EXPECT_TRUE(a.layer < b.layer || (a.layer == b.layer && a.material < b.material));
  }
  EXPECT_EQ(next, static_cast<Index>(stack.triangles.size()));
}

TEST(Layers, SubLevelsHaveEqualDistances) {
  const Domain domain = all_support(Vec3(-4, -4, 0), Vec3(4, 4, 8), {4, 4, 4});
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return p.z() / 8.0; });
  std::vector<Level> levels;
  for (int j = 0; j < 3; ++j) levels.push_back(make_level(1, j, 3, 4));
  std::vector<Index> tets(domain.mesh.tets.size());
  std::iota(tets.begin(), tets.end(), 0);
  const LayerStack stack = extract_levels(domain, field, 4, levels, tets);
  ASSERT_EQ(stack.sheets.size(), 3u);
  for (int j = 0; j < 3; ++j) {
    EXPECT_EQ(stack.sheets[j].pass, j);
    EXPECT_NEAR(sheet_area(stack, stack.sheets[j]), 64.0, 1e-9);
    EXPECT_NEAR(stack.vertices[stack.triangles[stack.sheets[j].first_triangle][0]].z(), 2.0 + (2 * j + 1) / 3.0, 1e-12);
    EXPECT_NEAR(local_thickness(stack, field, stack.sheets[j], stack.sheets[j].first_triangle), 2.0 / 3.0, 1e-12);
  }
}

TEST(Layers, ACrackIsFound) {
  Domain domain = shapes::floating_block_domain();
  const ScalarField field = radial(domain, Vec3(10, 6, -20));
  // Taking one support tet away from the middle of the block's floor opens the border of the support.
  for (Index t = domain.model_tets; t < static_cast<Index>(domain.mesh.tets.size()); ++t) {
    Index model_neighbours = 0, outside = 0;
    for (const Index n : domain.topology.neighbours[t]) {
      model_neighbours += n != kNone && n < domain.model_tets;
      outside += n == kNone;
    }
    if (model_neighbours == 0 || outside > 0) continue;
    domain.mesh.tets[t] = {domain.mesh.tets[t][0], domain.mesh.tets[t][0], domain.mesh.tets[t][0], domain.mesh.tets[t][0]};
  }
  const LayersResult result = slice_layers(domain, field, 60);
  const auto check = std::find_if(result.report.checks.begin(), result.report.checks.end(),
                                  [](const Check& c) { return c.name == "layers.border_gaps"; });
  ASSERT_NE(check, result.report.checks.end());
  EXPECT_FALSE(check->ok);
}

TEST(Layers, ThreadsDoNotChangeAByte) {
  const Domain domain = shapes::floating_block_domain(1.0);
  const ScalarField field = radial(domain, Vec3(10, 6, -20));
  RunContext two;
  two.threads = 2;
  const LayersResult a = slice_layers(domain, field, 80), b = slice_layers(domain, field, 80, two);
  EXPECT_TRUE(same_bytes(a.stack.vertices, b.stack.vertices));
  EXPECT_TRUE(same_bytes(a.stack.triangles, b.stack.triangles));
  EXPECT_TRUE(same_bytes(a.stack.triangle_tet, b.stack.triangle_tet));
  ASSERT_EQ(a.stack.sheets.size(), b.stack.sheets.size());
}

TEST(Layers, RefusesALayerCountOfZero) {
  const Domain domain = all_support(Vec3(0, 0, 0), Vec3(1, 1, 1), {1, 1, 1});
  EXPECT_THROW((void)slice_layers(domain, radial(domain, Vec3::Zero()), 0), Error);
}

}  // namespace
}  // namespace curvesup
