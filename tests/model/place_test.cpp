#include "curvesup/model/place.h"

#include <gtest/gtest.h>

#include <limits>

#include "curvesup/core/error.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

// The message with which loading a mesh is refused; empty when it is not.
std::string refusal(TetMesh mesh, const PlaceOptions& options = {}) {
  try {
    (void)load_model("shape", std::move(mesh), options);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input) << error.what();
    return error.what();
  }
  return {};
}

TetMesh cube() { return shapes::brick_mesh({0, 0, 0}, {3, 3, 3}, {3, 3, 3}); }

TEST(Place, OrderIsScaleUpAxisRotateMoveDrop) {
  PlaceOptions options;
  options.scale = 2.0;
  options.up_axis = "y";
  options.rotate_deg = Vec3(90, 0, 90);
  options.translate_mm = Vec3(100, 0, 7);
  const TetMesh file = cube();
  const auto placed = load_model("shape", file, options).model;
  // (x, y, z) -> scale (2x, 2y, 2z) -> up (2x, -2z, 2y) -> about x (2x, -2y, -2z) -> about z (2y, 2x, -2z)
  for (std::size_t v = 0; v < file.vertices.size(); ++v) {
    const Vec3& p = file.vertices[v];
    EXPECT_EQ(placed.mesh.vertices[v], Vec3(2 * p.y() + 100, 2 * p.x(), -2 * p.z() + 7));
  }
  options.drop_to_platform = true;
  const auto dropped = load_model("shape", file, options);
  EXPECT_EQ(dropped.report.low.z(), 0.0);
  EXPECT_EQ(dropped.report.high.z(), 6.0);
}

TEST(Place, RotationIsProperForEveryAxisAndAngle) {
  for (const char* axis : {"x", "y", "z"}) {
    PlaceOptions options;
    options.up_axis = axis;
    options.rotate_deg = Vec3(13, -200, 725);
    const Mat3 m = placement_rotation(options);
    EXPECT_NEAR((m * m.transpose() - Mat3::Identity()).norm(), 0.0, 1e-14);
    EXPECT_NEAR(m.determinant(), 1.0, 1e-14);
    options.rotate_deg.setZero();
    const Vec3 up = axis[0] == 'x' ? Vec3::UnitX() : axis[0] == 'y' ? Vec3::UnitY() : Vec3::UnitZ();
    EXPECT_EQ(placement_rotation(options) * up, Vec3(Vec3::UnitZ()));
  }
  EXPECT_THROW((void)load_model("shape", cube(), {.up_axis = "w"}), Error);
  EXPECT_THROW((void)load_model("shape", cube(), {.scale = -1.0}), Error);
}

TEST(LoadModel, CountsGenusCavitiesAndComponents) {
  const auto ring = load_model("ring", shapes::brick_mesh({0, 0, 0}, {3, 3, 1}, {3, 3, 1}, [](const Vec3& c) {
                                 return (c - Vec3(1.5, 1.5, 0.5)).norm() > 0.1;
                               }));
  EXPECT_EQ(ring.report.genus, 1);
  EXPECT_EQ(ring.report.cavities, 0);
  EXPECT_NEAR(ring.report.volume_mm3, 8.0, 1e-12);
  const auto hollow = load_model("hollow", shapes::brick_mesh({0, 0, 0}, {3, 3, 3}, {3, 3, 3}, [](const Vec3& c) {
                                   return (c - Vec3(1.5, 1.5, 1.5)).norm() > 0.1;
                                 }));
  EXPECT_EQ(hollow.report.genus, 0);
  EXPECT_EQ(hollow.report.cavities, 1);
  EXPECT_EQ(hollow.report.components, 1);
  const auto two = load_model(
      "two", shapes::brick_mesh({0, 0, 0}, {5, 1, 1}, {5, 1, 1}, [](const Vec3& c) { return c.x() < 2 || c.x() > 3; }));
  EXPECT_EQ(two.report.components, 2);
  EXPECT_EQ(two.report.genus, 0);
}

TEST(LoadModel, InvertedTetsAreSwapped) {
  TetMesh all = cube(), some = cube();
  for (auto& tet : all.tets) std::swap(tet[0], tet[1]);
  for (std::size_t t = 0; t < some.tets.size(); t += 3) std::swap(some.tets[t][1], some.tets[t][2]);
  const auto result_all = load_model("all", all);
  EXPECT_EQ(result_all.report.flipped_tets, static_cast<Index>(all.tets.size()));
  EXPECT_NEAR(result_all.report.volume_mm3, 27.0, 1e-12);
  const auto result_some = load_model("some", some);
  EXPECT_EQ(result_some.report.flipped_tets, static_cast<Index>(some.tets.size() / 3));
  EXPECT_NEAR(result_some.report.volume_mm3, 27.0, 1e-12);
}

TEST(LoadModel, VerticesKeepTheirPlace) {
  TetMesh mesh = cube();
  mesh.vertices.insert(mesh.vertices.begin(), Vec3(50, 50, 50));  // nobody uses it
  for (auto& tet : mesh.tets) {
    for (Index& v : tet) ++v;
  }
  mesh.vertices.push_back(mesh.vertices[1]);  // a duplicate that one tet uses
  for (auto& tet : mesh.tets) {
    const auto at = std::find(tet.begin(), tet.end(), 1);
    if (at == tet.end()) continue;
    *at = static_cast<Index>(mesh.vertices.size()) - 1;
    break;
  }
  const auto result = load_model("shape", mesh);
  EXPECT_EQ(result.report.unreferenced_vertices, 1);
  EXPECT_EQ(result.report.duplicate_vertices, 1);
  EXPECT_EQ(result.model.mesh.vertices, mesh.vertices);
  EXPECT_EQ(result.report.high, Vec3(3, 3, 3)) << "a vertex that nobody uses does not count";
  EXPECT_EQ(result.report.genus, 0);
}

TEST(LoadModel, RefusesWithTheElementsId) {
  EXPECT_NE(refusal({}).find("no tets"), std::string::npos);

  TetMesh mesh = cube();
  mesh.tets[7][2] = 1000;
  EXPECT_NE(refusal(mesh).find("tet 7:"), std::string::npos);
  mesh.tets[7][2] = -1;
  EXPECT_NE(refusal(mesh).find("tet 7:"), std::string::npos);

  mesh = cube();
  mesh.vertices[5].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(mesh).find("vertex 5:"), std::string::npos);

  mesh = cube();
  mesh.tets[4][3] = mesh.tets[4][0];
  EXPECT_NE(refusal(mesh).find("tet 4:"), std::string::npos);

  mesh = cube();
  mesh.tets.push_back(mesh.tets[0]);
  EXPECT_NE(refusal(mesh).find("overlap"), std::string::npos) << refusal(mesh);
  mesh.tets.push_back(mesh.tets[0]);
  mesh.tets.push_back(mesh.tets[0]);
  EXPECT_NE(refusal(mesh).find("more than two tets"), std::string::npos) << refusal(mesh);
}

TEST(LoadModel, RefusesAFoldThatSwappingCannotMend) {
  // An inner vertex is pulled through the opposite side of its star: some tets turn inside out.
  TetMesh mesh = cube();
  const auto inner = std::find_if(mesh.vertices.begin(), mesh.vertices.end(),
                                  [](const Vec3& p) { return (p - Vec3(1, 1, 1)).norm() < 0.1; });
  ASSERT_NE(inner, mesh.vertices.end());
  *inner = Vec3(2.6, 2.5, 2.4);
  EXPECT_NE(refusal(mesh).find("mixed orientation"), std::string::npos) << refusal(mesh);
}

TEST(LoadModel, RefusesABoundaryThatTouchesItself) {
  const auto diagonal = [](const Vec3& c) { return (c.x() < 1) == (c.y() < 1); };
  EXPECT_NE(refusal(shapes::brick_mesh({0, 0, 0}, {2, 2, 1}, {2, 2, 1}, diagonal)).find("along an edge"),
            std::string::npos);
  const auto corner = [](const Vec3& c) { return (c.x() < 1) == (c.y() < 1) && (c.x() < 1) == (c.z() < 1); };
  EXPECT_NE(refusal(shapes::brick_mesh({0, 0, 0}, {2, 2, 2}, {2, 2, 2}, corner)).find("in a vertex"),
            std::string::npos);
}

}  // namespace
}  // namespace curvesup
