#include "curvesup/overhang/overhang.h"

#include <gtest/gtest.h>

#include "curvesup/core/error.h"
#include "curvesup/field/field.h"
#include "curvesup/model/place.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

Overhang planar_overhang(const Model& model, const OverhangOptions& options = {}) {
  return find_overhang(model, compute_field(model, {}).field, options);
}

TEST(Overhang, BlockOnLegsOverhangsBetweenTheLegsOnly) {
  const Model model = shapes::block_on_legs();
  const Overhang overhang = planar_overhang(model);
  EXPECT_NEAR(overhang.area_mm2, 18.0 * 10.0, 1e-9);
  for (const Index f : overhang.faces) {
    for (const Index v : model.boundary[f].vertices) EXPECT_EQ(model.mesh.vertices[v].z(), 12.0);
  }
  EXPECT_EQ(overhang.vertices.size(), 10u * 6u);
  for (const Vec3& d : overhang.vertex_direction) EXPECT_NEAR((d + Vec3::UnitZ()).norm(), 0.0, 1e-12);
  EXPECT_TRUE(overhang.minima.empty());
}

TEST(Overhang, AngleDecidesByTheSlopeOfTheFace) {
  // Undersides lean by 40 and 50 degrees from the horizontal: with alpha from the vertical of 45 only the flatter
  // hangs.
  for (const double slope : {40.0, 50.0}) {
    TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {10, 10, 2}, {5, 5, 1});
    for (Vec3& p : mesh.vertices) p.z() += 20.0 + p.x() * Angle::degrees(slope).tan();
    const double area = 100.0 / Angle::degrees(slope).cos();
    EXPECT_NEAR(planar_overhang(shapes::as_model(mesh)).area_mm2, slope < 45 ? area : 0.0, 1e-9);
    EXPECT_NEAR(planar_overhang(shapes::as_model(mesh), {.self_support = Angle::degrees(60)}).area_mm2, 0.0, 1e-9);
  }
  EXPECT_THROW((void)planar_overhang(shapes::floating_slab(), {.self_support = Angle::degrees(90)}), Error);
}

TEST(Overhang, ScaleOfTheFieldDoesNotMatter) {
  const Model model = shapes::block_on_legs();
  ScalarField field = compute_field(model, {}).field;
  const auto expected = find_overhang(model, field).faces;
  for (Vec3& g : field.gradient) g *= 0.01;
  EXPECT_EQ(find_overhang(model, field).faces, expected);
}

TEST(Overhang, FloatingSlabHangsWithItsWholeBottomAndRestingSlabNowhere) {
  const Model model = shapes::floating_slab();
  EXPECT_NEAR(planar_overhang(model).area_mm2, 300.0, 1e-9);
  const Model resting = load_model("slab", model.mesh, {.drop_to_platform = true}).model;
  EXPECT_TRUE(planar_overhang(resting).faces.empty());
  EXPECT_TRUE(planar_overhang(resting).minima.empty());
}

// One tet that stands on its tip: its three lower faces are steep, so nothing but the tip needs support.
Model tip(double low) {
  TetMesh mesh;
  mesh.vertices = {{0, 0, low}, {1, 0, low + 5}, {-0.5, 0.8, low + 5}, {-0.5, -0.8, low + 5}};
  mesh.tets = {{0, 1, 2, 3}};
  if (tet_volume(mesh, 0) < 0) std::swap(mesh.tets[0][2], mesh.tets[0][3]);
  return shapes::as_model(mesh);
}

TEST(Overhang, SteepTipIsAMinimumUnlessItStandsOnThePlatform) {
  const Overhang hanging = planar_overhang(tip(3.0));
  EXPECT_TRUE(hanging.faces.empty());
  ASSERT_EQ(hanging.minima.size(), 1u);
  EXPECT_EQ(hanging.minima[0], 0);
  EXPECT_NEAR((hanging.minimum_direction[0] + Vec3::UnitZ()).norm(), 0.0, 1e-12);
  EXPECT_TRUE(planar_overhang(tip(0.0)).minima.empty());
}

TEST(Overhang, SteepKeelIsOneMinimum) {
  // A long wedge on its edge: all vertices of the edge have one value.
  TetMesh mesh = shapes::brick_mesh({-1, 0, 4}, {1, 8, 10}, {2, 4, 3});
  for (Vec3& p : mesh.vertices) p.z() += 5.0 * std::abs(p.x());
  const Overhang overhang = planar_overhang(shapes::as_model(mesh));
  EXPECT_TRUE(overhang.faces.empty());
  ASSERT_EQ(overhang.minima.size(), 1u);
  EXPECT_EQ(mesh.vertices[overhang.minima[0]], Vec3(0, 0, 4));
}

TEST(Overhang, PitInATopSurfaceNeedsNoSupport) {
  TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {4, 4, 4}, {4, 4, 4});
  for (Vec3& p : mesh.vertices) {
    if (p == Vec3(2, 2, 4)) p.z() = 3.3;
  }
  EXPECT_TRUE(planar_overhang(shapes::as_model(mesh)).minima.empty());
}

TEST(Overhang, RegionsAddAndTakeFaces) {
  const Model model = shapes::block_on_legs();
  const Overhang half = planar_overhang(model, {.block = {Region::box(Vec3(-1, -1, 11), Vec3(15.9, 11, 13))}});
  EXPECT_NEAR(half.area_mm2 + half.blocked_area_mm2, 180.0, 1e-9);
  EXPECT_GT(half.blocked_area_mm2, 80.0);
  for (const Index f : half.blocked) EXPECT_FALSE(std::binary_search(half.faces.begin(), half.faces.end(), f));

  // The leg's inner side is a vertical wall.
  const Overhang more = planar_overhang(model, {.enforce = {Region::box(Vec3(5.9, -1, -1), Vec3(7, 11, 11.9))}});
  EXPECT_NEAR(more.enforced_area_mm2, 12 * 10.0, 1e-9);
  EXPECT_NEAR(more.area_mm2, 180.0 + more.enforced_area_mm2, 1e-9);
  EXPECT_TRUE(planar_overhang(model, {.enforce = {Region::box(Vec3(-1, -1, -1), Vec3(40, 20, 0.1))}}).enforced.empty())
      << "faces on the platform cannot be enforced";

  const Overhang both = planar_overhang(
      model, {.enforce = {Region::of_faces({half.faces[0]})}, .block = {Region::sphere(Vec3(15, 5, 12), 100)}});
  EXPECT_TRUE(both.faces.empty()) << "block is stronger";
  EXPECT_NEAR(both.blocked_area_mm2, 180.0, 1e-9);
  EXPECT_THROW((void)planar_overhang(model, {.block = {Region::of_faces({1000000})}}), Error);
  EXPECT_THROW((void)planar_overhang(model, {.block = {Region::sphere(Vec3::Zero(), 0)}}), Error);
}

TEST(Overhang, ARegionWithoutAFaceIsNamed) {
  const Model model = shapes::block_on_legs();
  std::vector<double> value;
  for (const Vec3& p : model.mesh.vertices) value.push_back(p.z());
  std::string said;
  RunContext run;
  run.log_sink = [&](LogLevel level, std::string_view message) { said += level == LogLevel::warning ? std::string(message) + "\n" : ""; };
  const OverhangOptions options{.enforce = {Region::box(Vec3(5.9, -1, -1), Vec3(7, 11, 11.9)), Region::sphere(Vec3(500, 0, 0), 5)}};
  EXPECT_FALSE(find_overhang(model, make_scalar_field(model.mesh, value), options, run).enforced.empty());
  EXPECT_NE(said.find("region 2 of support.enforce"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
}

TEST(Overhang, BlockedTipIsNoMinimum) {
  EXPECT_TRUE(planar_overhang(tip(3.0), {.block = {Region::sphere(Vec3(0, 0, 5), 5)}}).minima.empty());
}

TEST(Overhang, MeshRegionAgreesWithTheBoxItIs) {
  const Model model = shapes::block_on_legs(1.0);
  // Coordinates that centroids share, so that lines meet edges and corners of the region.
  const Vec3 low(6, 0, 11), high(16, 5, 13);
  const Model box = shapes::as_model(shapes::brick_mesh(low, high, {10, 5, 2}));
  TriangleMesh surface;
  surface.vertices = box.mesh.vertices;
  for (const auto& f : box.boundary) surface.triangles.push_back(f.vertices);
  const Overhang by_mesh = planar_overhang(model, {.block = {Region::inside(surface)}});
  const Overhang by_box = planar_overhang(model, {.block = {Region::box(low, high)}});
  EXPECT_EQ(by_mesh.blocked, by_box.blocked);
  EXPECT_NEAR(by_mesh.blocked_area_mm2, 50.0, 1e-9);
  surface.triangles.pop_back();
  EXPECT_THROW((void)planar_overhang(model, {.block = {Region::inside(surface)}}), Error);
}

TEST(Overhang, ThreadCountDoesNotMatter) {
  const Model model = shapes::block_on_legs(1.0);
  const ScalarField field = compute_field(model, {}).field;
  RunContext two;
  two.threads = 2;
  const Overhang a = find_overhang(model, field), b = find_overhang(model, field, {}, two);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.area_mm2, b.area_mm2);
  EXPECT_EQ(a.vertex_direction, b.vertex_direction);
}

}  // namespace
}  // namespace curvesup
