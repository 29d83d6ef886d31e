#include "curvesup/hull/hull.h"

#include <gtest/gtest.h>

#include <map>

#include "curvesup/core/error.h"
#include "helpers/shapes.h"
#include "hull/convex_surface.h"

namespace curvesup {
namespace {

ScalarField height_field(const Model& model, const Vec3& direction = Vec3::UnitZ()) {
  std::vector<double> value;
  for (const Vec3& p : model.mesh.vertices) value.push_back(p.dot(direction) / 20.0);
  return make_scalar_field(model.mesh, value);
}

// The faces that look straight down, by brute force.
Overhang bottom_overhang(const Model& model, double height, const Vec3& direction) {
  std::vector<bool> used(model.mesh.vertices.size(), false);
  Overhang overhang;
  for (std::size_t f = 0; f < model.boundary.size(); ++f) {
    bool low = true;
    for (const Index v : model.boundary[f].vertices) low = low && std::abs(model.mesh.vertices[v].z() - height) < 1e-9;
    if (!low) continue;
    overhang.faces.push_back(static_cast<Index>(f));
    for (const Index v : model.boundary[f].vertices) used[v] = true;
  }
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    overhang.vertices.push_back(static_cast<Index>(v));
    overhang.vertex_direction.push_back(direction);
  }
  return overhang;
}

double signed_volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) sum += mesh.vertices[t[0]].cross(mesh.vertices[t[1]]).dot(mesh.vertices[t[2]]) / 6.0;
  return sum;
}

void expect_closed(const TriangleMesh& mesh) {
  std::map<std::pair<Index, Index>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) ++edges[{t[c], t[(c + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
  EXPECT_EQ(static_cast<Index>(mesh.vertices.size()) - static_cast<Index>(mesh.triangles.size()) / 2, 2);
  EXPECT_GT(signed_volume(mesh), 0.0);
}

// Outside the un-remeshed truth by brute force: signed distance to every face plane of a convex hull.
double depth_inside(const TriangleMesh& convex, const Vec3& p) {
  double depth = 1e300;
  for (const auto& t : convex.triangles) {
    const Vec3 n = area_normal(convex.vertices[t[0]], convex.vertices[t[1]], convex.vertices[t[2]]);
    if (n.norm() > 1e-12) depth = std::min(depth, n.normalized().dot(convex.vertices[t[0]] - p));
  }
  return depth;
}

TEST(Hull, IsClosedAroundAFloatingSlabAndBelowThePlatform) {
  const Model model = shapes::floating_slab();
  const HullResult result = build_hull(model, height_field(model), bottom_overhang(model, 12.0, -Vec3::UnitZ()), 40);
  expect_closed(result.surface);
  EXPECT_LT(result.report.low_z_mm, -1.5);
  EXPECT_GE(result.report.model_clearance_mm, 0.5 * result.report.margin_mm);
  EXPECT_GE(result.report.trajectory_clearance_mm, 0.5 * result.report.margin_mm);
  for (const Check& check : result.report.checks) EXPECT_TRUE(check.ok) << check.name;
  // Straight down: the box [0,30] x [0,10] x [0,18] enlarged by the margin, whose corners may be rounded.
  const double wide = 2.0 * result.report.margin_mm, box = (30.0 + wide) * (10.0 + wide) * (18.0 + wide);
  EXPECT_NEAR(signed_volume(result.surface), box, 0.08 * box);
  const TriangleMesh convex = convex_hull(result.surface.vertices);
  for (const Vec3& p : model.mesh.vertices) EXPECT_GT(depth_inside(convex, p), 1.5);
}

TEST(Hull, EdgesAreNearTheWantedLength) {
  const Model model = shapes::floating_slab();
  const HullResult result = build_hull(model, height_field(model), bottom_overhang(model, 12.0, -Vec3::UnitZ()), 40);
  double sum = 0.0;
  int count = 0;
  for (const auto& t : result.surface.triangles) {
    for (int c = 0; c < 3; ++c) {
      const double length = (result.surface.vertices[t[c]] - result.surface.vertices[t[(c + 1) % 3]]).norm();
      EXPECT_LT(length, 2.0 * result.report.edge_length_mm);
      sum += length;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, result.report.edge_length_mm, 0.3 * result.report.edge_length_mm);
}

// A trajectory that starts at angle theta from straight down and turns by alpha/20 a step walks the sum of the steps'
// sideways parts; the hull must reach that far plus nearly the margin.
TEST(Hull, FollowsTurningTrajectories) {
  const Model model = shapes::floating_slab();
  const Vec3 direction = Vec3(1, 0, -1).normalized();
  const int layers = 40;
  const ScalarField field = height_field(model);  // |grad G| = 1/20, so a layer is 0.5 mm
  const HullResult result = build_hull(model, field, bottom_overhang(model, 12.0, direction), layers);
  const double turn = 2.25 * std::numbers::pi / 180.0;
  double reach = 0.0;
  for (int k = 0; k < 20; ++k) reach += 0.5 * std::sin(std::numbers::pi / 4 - k * turn);
  double high_x = 0.0, low_x = 0.0;
  for (const Vec3& p : result.surface.vertices) {
    high_x = std::max(high_x, p.x());
    low_x = std::min(low_x, p.x());
  }
  EXPECT_NEAR(high_x, 30.0 + reach + result.report.margin_mm, 0.5);
  EXPECT_NEAR(low_x, -result.report.margin_mm, 0.5);
}

TEST(Hull, ExtraMarginWidensIt) {
  const Model model = shapes::floating_slab();
  const Overhang overhang = bottom_overhang(model, 12.0, -Vec3::UnitZ());
  HullOptions options;
  options.extra_margin_mm = 4.0;
  const HullResult result = build_hull(model, height_field(model), overhang, 40, options);
  double high_x = 0.0;
  for (const Vec3& p : result.surface.vertices) high_x = std::max(high_x, p.x());
  EXPECT_GT(high_x, 30.0 + 4.0 + 0.5 * result.report.margin_mm);
}

TEST(Hull, WorksWithoutOverhangOnAModelThatRests) {
  const Model model = shapes::block_on_legs();
  const HullResult result = build_hull(model, height_field(model), {}, 40);
  expect_closed(result.surface);
  EXPECT_LT(result.report.low_z_mm, -1.0);
  EXPECT_EQ(result.report.trajectory_points, 0);
}

TEST(Hull, GrowsTheMarginWhenEdgesAreTooLongForIt) {
  const Model model = shapes::floating_slab();
  HullOptions options;
  options.edge_length_mm = 30.0;
  options.margin_mm = 0.5;
  const HullResult result = build_hull(model, height_field(model), bottom_overhang(model, 12.0, -Vec3::UnitZ()), 40, options);
  EXPECT_GE(result.report.model_clearance_mm, 0.5 * result.report.margin_mm);
  EXPECT_GE(result.report.margin_mm, 0.6 * result.report.edge_length_mm);
}

TEST(Hull, IsTheSameForAnyThreadCount) {
  const Model model = shapes::block_on_legs(1.0);
  const Overhang overhang = bottom_overhang(model, 12.0, Vec3(0.6, 0.0, -0.8));
  RunContext two;
  two.threads = 2;
  const HullResult a = build_hull(model, height_field(model), overhang, 40);
  const HullResult b = build_hull(model, height_field(model), overhang, 40, {}, two);
  EXPECT_EQ(a.surface.vertices, b.surface.vertices);
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
}

TEST(Hull, SaysWhenTheFieldIsConstant) {
  const Model model = shapes::floating_slab();
  const ScalarField flat = make_scalar_field(model.mesh, std::vector<double>(model.mesh.vertices.size(), 0.5));
  EXPECT_THROW((void)build_hull(model, flat, {}, 40), Error);
}

TEST(ConvexSurface, TrianglesMeetExactly) {
  const TriangleMesh a{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  const TriangleMesh touching{{{0, 0, 0}, {0, 0, 1}, {-1, 0, 1}}, {{0, 1, 2}}};
  const TriangleMesh above{{{0, 0, 1e-15}, {1, 0, 1}, {0, 1, 1}}, {{0, 1, 2}}};
  EXPECT_TRUE(triangles_meet(a, 0, touching, 0));
  EXPECT_FALSE(triangles_meet(a, 0, above, 0));
}

}  // namespace
}  // namespace curvesup
