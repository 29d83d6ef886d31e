#include "curvesup/model/diagnose.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "curvesup/core/error.h"
#include "curvesup/model/place.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

TetMesh cube() { return shapes::brick_mesh({0, 0, 0}, {3, 3, 3}, {3, 3, 3}); }

const MeshProblem* find(const MeshDiagnosis& diagnosis, const std::string& name) {
  const auto at =
      std::find_if(diagnosis.problems.begin(), diagnosis.problems.end(), [&](const auto& p) { return p.name == name; });
  return at == diagnosis.problems.end() ? nullptr : &*at;
}

TEST(Diagnose, SoundMeshHasNoProblems) {
  const auto diagnosis = diagnose_mesh(cube());
  EXPECT_TRUE(diagnosis.problems.empty());
  EXPECT_TRUE(diagnosis.usable());
  EXPECT_NEAR(diagnosis.volume_mm3, 27.0, 1e-12);
  EXPECT_EQ(diagnosis.boundary_faces, 108);
  EXPECT_NEAR(diagnosis.min_dihedral_deg, 45.0, 1e-9);
  EXPECT_NEAR(diagnosis.max_dihedral_deg, 90.0, 1e-9);
  EXPECT_EQ(diagnosis.components, 1);
}

TEST(Diagnose, RegularTetHasQualityOne) {
  TetMesh mesh;
  mesh.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  mesh.tets = {{0, 1, 2, 3}};
  EXPECT_NEAR(diagnose_mesh(mesh).min_quality, 1.0, 1e-12);
  EXPECT_NEAR(diagnose_mesh(mesh).min_dihedral_deg, 70.528779, 1e-5);
}

TEST(Diagnose, FindsEverythingAtOnceWithIdsOfTheFile) {
  TetMesh mesh = cube();
  mesh.tets[3][1] = 999;
  mesh.tets[10][2] = mesh.tets[10][0];
  std::swap(mesh.tets[20][0], mesh.tets[20][1]);
  mesh.vertices.push_back(mesh.vertices[0]);
  mesh.vertices.push_back(Vec3::Constant(std::numeric_limits<double>::infinity()));
  mesh.tets.push_back(mesh.tets[30]);
  const auto diagnosis = diagnose_mesh(mesh);
  EXPECT_FALSE(diagnosis.usable());
  ASSERT_NE(find(diagnosis, "index_out_of_range"), nullptr);
  EXPECT_EQ(find(diagnosis, "index_out_of_range")->ids, std::vector<Index>{3});
  ASSERT_NE(find(diagnosis, "zero_volume"), nullptr);
  EXPECT_EQ(find(diagnosis, "zero_volume")->ids, std::vector<Index>{10});
  ASSERT_NE(find(diagnosis, "inverted_tets"), nullptr);
  EXPECT_EQ(find(diagnosis, "inverted_tets")->ids, std::vector<Index>{20});
  ASSERT_NE(find(diagnosis, "duplicate_vertices"), nullptr);
  ASSERT_NE(find(diagnosis, "not_finite"), nullptr);
  EXPECT_NE(find(diagnosis, "overlapping_tets") != nullptr || find(diagnosis, "overfull_faces") != nullptr, false);
}

TEST(Diagnose, CrossingAndTouchingPartsAreNamed) {
  TetMesh mesh = cube();
  const Index first = static_cast<Index>(mesh.vertices.size());
  for (const Vec3& p : {Vec3(2.9, 1.4, 1.6), Vec3(6, 1, 1), Vec3(6, 2, 1), Vec3(6, 1.5, 2)}) mesh.vertices.push_back(p);
  mesh.tets.push_back({first, first + 1, first + 2, first + 3});
  if (tet_volume(mesh, static_cast<Index>(mesh.tets.size()) - 1) < 0)
    std::swap(mesh.tets.back()[0], mesh.tets.back()[1]);
  EXPECT_NE(find(diagnose_mesh(mesh), "intersecting_faces"), nullptr);
  EXPECT_TRUE(diagnose_mesh(mesh).usable());
  EXPECT_FALSE(diagnose_mesh(mesh).supportable());
  mesh.vertices[first].x() = 3.0001;
  EXPECT_EQ(find(diagnose_mesh(mesh), "intersecting_faces"), nullptr);
  ASSERT_NE(find(diagnose_mesh(mesh), "close_faces"), nullptr);
  EXPECT_EQ(find(diagnose_mesh(mesh), "close_faces")->ids, std::vector<Index>{first});
  mesh.vertices[first].x() = 3.5;
  EXPECT_TRUE(diagnose_mesh(mesh).problems.empty());
  EXPECT_TRUE(diagnose_mesh(mesh).supportable());
}

// What diagnosis calls usable, loading takes, and the other way round, whatever was done to the mesh.
TEST(Diagnose, AgreesWithLoadingOnBrokenMeshes) {
  std::mt19937 random(5);
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {2, 2, 2}, {2, 2, 2});
    const auto pick = [&](std::size_t count) { return static_cast<Index>(random() % count); };
    for (int change = 0; change < 1 + round % 3; ++change) {
      switch (random() % 6) {
        case 0:
          mesh.tets[pick(mesh.tets.size())][pick(4)] = pick(mesh.vertices.size() + 2) - 1;
          break;
        case 1:
          mesh.vertices[pick(mesh.vertices.size())][pick(3)] = std::numeric_limits<double>::quiet_NaN();
          break;
        case 2:
          mesh.tets.push_back(mesh.tets[pick(mesh.tets.size())]);
          break;
        case 3:
          std::swap(mesh.tets[pick(mesh.tets.size())][0], mesh.tets[pick(mesh.tets.size())][1]);
          break;
        case 4:
          mesh.tets.erase(mesh.tets.begin() + pick(mesh.tets.size()));
          break;
        case 5:
          mesh.vertices[pick(mesh.vertices.size())] += Vec3(0.7, -0.3, 0.4);
          break;
      }
    }
    const bool usable = diagnose_mesh(mesh).usable();
    bool loads = true;
    try {
      (void)load_model("shape", mesh);
    } catch (const Error&) {
      loads = false;
    }
    EXPECT_EQ(usable, loads) << "round " << round;
    refused += !loads;
  }
  EXPECT_GT(refused, 50);
  EXPECT_LT(refused, 300);
  EXPECT_FALSE(diagnose_mesh({}).usable());
}

}  // namespace
}  // namespace curvesup
