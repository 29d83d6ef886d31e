#include "curvesup/mesh/tet_mesh.h"

#include <gtest/gtest.h>

#include "curvesup/core/error.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

TEST(TetMesh, BrickVolumeAndBoundaryArea) {
  const TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {3, 2, 1}, {3, 2, 1});
  EXPECT_NEAR(total_volume(mesh), 6.0, 1e-12);
  const auto faces = boundary_faces(mesh, build_topology(mesh));
  Vec3 sum = Vec3::Zero();
  double area = 0.0;
  for (const auto& f : faces) {
    const Vec3 n = (mesh.vertices[f.vertices[1]] - mesh.vertices[f.vertices[0]])
                       .cross(mesh.vertices[f.vertices[2]] - mesh.vertices[f.vertices[0]]) / 2;
    const Vec3 centre = (mesh.vertices[f.vertices[0]] + mesh.vertices[f.vertices[1]] + mesh.vertices[f.vertices[2]]) / 3;
    EXPECT_GT(n.dot(centre - Vec3(1.5, 1, 0.5)), 0.0) << "faces look outward";
    sum += n;
    area += n.norm();
  }
  EXPECT_NEAR(area, 22.0, 1e-12);
  EXPECT_NEAR(sum.norm(), 0.0, 1e-12);
}

TEST(TetMesh, GradientOfALinearFunctionIsExact) {
  const TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {2, 2, 2}, {2, 2, 2});
  const Vec3 slope(0.3, -0.7, 1.1);
  std::vector<double> value;
  for (const Vec3& v : mesh.vertices) value.push_back(slope.dot(v) + 5.0);
  const ScalarField field = make_scalar_field(mesh, value);
  for (const Vec3& g : field.gradient) EXPECT_NEAR((g - slope).norm(), 0.0, 1e-12);
  EXPECT_NEAR((print_direction(field, 0) - slope.normalized()).norm(), 0.0, 1e-12);
}

TEST(TetMesh, ThreeTetsOnAFaceAreRefused) {
  TetMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}, {0.2, 0.2, 2}};
  mesh.tets = {{0, 1, 2, 3}, {0, 2, 1, 4}, {0, 1, 2, 5}};
  EXPECT_THROW(build_topology(mesh), Error);
}

}  // namespace
}  // namespace curvesup
