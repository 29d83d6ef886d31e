#include "curvesup/domain/domain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "curvesup/core/error.h"
#include "helpers/shapes.h"
#include "mesh/tetgen_wrapper.h"

namespace curvesup {
namespace {

ScalarField height_field(const Model& model) {
  std::vector<double> value;
  for (const Vec3& p : model.mesh.vertices) value.push_back(p.z() / 20.0);
  return make_scalar_field(model.mesh, value);
}

using Face = std::array<Index, 3>;
Face sorted(Face face) {
  std::sort(face.begin(), face.end());
  return face;
}

void expect_conforming(const Model& model, const DomainResult& result) {
  const Domain& domain = result.domain;
  for (const Check& check : result.report.checks) EXPECT_TRUE(check.ok) << check.name << " " << check.value << " " << check.detail;
  ASSERT_EQ(domain.model_tets, static_cast<Index>(model.mesh.tets.size()));
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v) EXPECT_EQ(domain.mesh.vertices[v], model.mesh.vertices[v]);
  for (std::size_t t = 0; t < model.mesh.tets.size(); ++t) EXPECT_EQ(domain.mesh.tets[t], model.mesh.tets[t]);
  // By brute force, without the topology: faces of the support tets that have only model vertices on the boundary.
  std::multiset<Face> support_faces;
  for (std::size_t t = domain.model_tets; t < domain.mesh.tets.size(); ++t) {
    EXPECT_GT(tet_volume(domain.mesh, static_cast<Index>(t)), 0.0);
    for (int f = 0; f < 4; ++f) support_faces.insert(sorted(face_vertices(domain.mesh.tets[t], f)));
  }
  for (std::size_t i = 0; i < model.boundary.size(); ++i) {
    EXPECT_EQ(support_faces.count(sorted(model.boundary[i].vertices)), 1u);
    const auto& tet = domain.mesh.tets[domain.interface_tet[i]];
    for (const Index v : model.boundary[i].vertices) EXPECT_NE(std::find(tet.begin(), tet.end(), v), tet.end());
  }
}

TEST(Domain, ConformsAroundAModelThatRests) {
  const Model model = shapes::block_on_legs();
  const HullResult hull = build_hull(model, height_field(model), {}, 40);
  const DomainResult result = mesh_domain(model, hull.surface);
  expect_conforming(model, result);
  EXPECT_GT(result.report.support_tets, 100);
  EXPECT_GT(result.report.min_dihedral_deg, 0.1);
}

TEST(Domain, BoxInBoxHasTheDifferenceOfVolumes) {
  const Model model = shapes::as_model(shapes::brick_mesh(Vec3(0, 0, 0), Vec3(2, 3, 4), {2, 2, 2}));
  const DomainResult result = mesh_domain(model, shapes::box_surface(Vec3(-1, -1, -1), Vec3(4, 5, 6)));
  expect_conforming(model, result);
  double support = 0.0;
  for (Index t = result.domain.model_tets; t < result.report.tets; ++t) support += tet_volume(result.domain.mesh, t);
  EXPECT_NEAR(support, 5.0 * 6.0 * 7.0 - 24.0, 1e-10);
}

TEST(Domain, EveryComponentGetsItsHole) {
  TetMesh two = shapes::brick_mesh(Vec3(0, 0, 0), Vec3(9, 2, 2), {9, 2, 2}, [](const Vec3& c) { return c.x() < 3 || c.x() > 5; });
  const Model model = shapes::as_model(two);
  const DomainResult result = mesh_domain(model, shapes::box_surface(Vec3(-2, -2, -2), Vec3(11, 4, 4)));
  expect_conforming(model, result);
}

TEST(Domain, ClosedCavityBecomesSupport) {
  const Model model = shapes::as_model(shapes::brick_mesh(Vec3(0, 0, 0), Vec3(3, 3, 3), {3, 3, 3}, [](const Vec3& c) {
    return (c - Vec3(1.5, 1.5, 1.5)).norm() > 0.1;
  }));
  const DomainResult result = mesh_domain(model, shapes::box_surface(Vec3(-2, -2, -2), Vec3(5, 5, 5)));
  expect_conforming(model, result);
}

TEST(Domain, SmallerTetsWhenAsked) {
  const Model model = shapes::floating_slab();
  const TriangleMesh hull = shapes::box_surface(Vec3(-25, -25, -25), Vec3(55, 35, 45), 10);
  const DomainResult coarse = mesh_domain(model, hull, {.max_tet_volume_mm3 = 1000.0});
  const DomainResult fine = mesh_domain(model, hull, {.max_tet_volume_mm3 = 10.0});
  EXPECT_GT(fine.report.support_tets, 2 * coarse.report.support_tets);
}

TEST(Domain, FlagsTellModelAndHullVerticesApart) {
  const Model model = shapes::floating_slab();
  const TriangleMesh hull = shapes::box_surface(Vec3(-5, -5, -5), Vec3(35, 15, 23));
  const DomainResult result = mesh_domain(model, hull);
  Index on_model = 0, on_hull = 0;
  for (const auto flags : result.domain.vertex_flags) {
    on_model += (flags & Domain::kOnModel) != 0;
    on_hull += (flags & Domain::kOnHull) != 0;
    EXPECT_NE(flags, Domain::kOnModel | Domain::kOnHull);
  }
  EXPECT_EQ(on_hull, 8);
  EXPECT_EQ(on_model - static_cast<Index>(model.boundary.size()) / 2, 2);
}

// A hull that cuts through the model: TetGen gives up, the program goes on, and the next run works.
TEST(Domain, FailureInsideTetGenIsAnErrorAndLeavesNothingBehind) {
  const Model model = shapes::block_on_legs();
  const TriangleMesh bad = shapes::box_surface(Vec3(-5, -5, 3.3), Vec3(35, 15, 23));
  const TriangleMesh good = shapes::box_surface(Vec3(-5, -5, -5), Vec3(35, 15, 23));
  const DomainResult before = mesh_domain(model, good);
  for (int i = 0; i < 3; ++i) {
    try {
      (void)mesh_domain(model, bad);
      ADD_FAILURE() << "the intersection went unnoticed";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::geometry);
      EXPECT_NE(error.problem().find("intersects"), std::string::npos) << error.what();
      EXPECT_FALSE(error.remedy().empty());
    }
    const DomainResult after = mesh_domain(model, good);
    EXPECT_EQ(after.domain.mesh.vertices, before.domain.mesh.vertices);
    EXPECT_EQ(after.domain.mesh.tets, before.domain.mesh.tets);
  }
}

TEST(Tetrahedralize, OverlappingFacetsAreAnError) {
  PiecewiseComplex complex;
  const TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(1, 1, 1));
  complex.vertices = box.vertices;
  complex.facets = box.triangles;
  // A second box that shares a part of one side's plane.
  const TriangleMesh other = shapes::box_surface(Vec3(0.25, 0.25, 1), Vec3(0.75, 0.6, 2));
  for (const Vec3& p : other.vertices) complex.vertices.push_back(p);
  for (const auto& t : other.triangles) complex.facets.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_THROW((void)tetrahedralize(complex), Error);
}

TEST(Tetrahedralize, NothingIsAnError) { EXPECT_THROW((void)tetrahedralize({}), Error); }

TEST(Tetrahedralize, KeepsPointsInOrder) {
  PiecewiseComplex complex;
  const TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(8, 8, 8), 3);
  complex.vertices = box.vertices;
  complex.facets = box.triangles;
  const TetMesh mesh = tetrahedralize(complex, {.max_tet_volume_mm3 = 4.0});
  ASSERT_GT(mesh.vertices.size(), box.vertices.size());
  for (std::size_t v = 0; v < box.vertices.size(); ++v) EXPECT_EQ(mesh.vertices[v], box.vertices[v]);
  EXPECT_NEAR(total_volume(mesh), 512.0, 1e-9);
}

}  // namespace
}  // namespace curvesup
