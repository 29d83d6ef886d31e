#include "curvesup/model/fill_surface.h"

#include <gtest/gtest.h>

#include "curvesup/core/error.h"
#include "curvesup/model/diagnose.h"
#include "curvesup/model/place.h"
#include "helpers/shapes.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

TriangleMesh joined(const std::vector<TriangleMesh>& parts) {
  TriangleMesh all;
  for (const TriangleMesh& part : parts) {
    const Index base = static_cast<Index>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const auto& t : part.triangles) all.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  }
  return all;
}

std::vector<std::string> names(const TriangleMesh& surface, bool refused_only = true) {
  std::vector<std::string> names;
  for (const MeshProblem& p : diagnose_surface(surface).problems) {
    if (!refused_only || p.severity == MeshProblem::Severity::refused) names.push_back(p.name);
  }
  return names;
}

using Names = std::vector<std::string>;

TEST(FillSurface, GivesAModelWithTheSurfaceAsItsBoundary) {
  const TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(10, 20, 30), 5);
  const TetMesh mesh = fill_surface(box, "box.stl", {.max_tet_volume_mm3 = 10.0});
  EXPECT_NEAR(total_volume(mesh), 6000.0, 1e-8);
  EXPECT_GT(mesh.tets.size(), 300u);
  for (std::size_t v = 0; v < box.vertices.size(); ++v) EXPECT_EQ(mesh.vertices[v], box.vertices[v]);
  const ModelResult model = load_model("box", mesh);
  EXPECT_EQ(model.model.boundary.size(), box.triangles.size());
  EXPECT_EQ(model.report.genus, 0);
}

TEST(FillSurface, AShellWithinAShellIsACavityAndWhatIsInItIsNot) {
  TriangleMesh inner = shapes::box_surface(Vec3(2, 2, 2), Vec3(8, 8, 8));
  for (auto& t : inner.triangles) std::swap(t[1], t[2]);  // however it is turned
  for (const bool turned : {false, true}) {
    if (turned) {
      for (auto& t : inner.triangles) std::swap(t[1], t[2]);
    }
    const TriangleMesh nested = joined({shapes::box_surface(Vec3(0, 0, 0), Vec3(10, 10, 10)), inner,
                                        shapes::box_surface(Vec3(4, 4, 4), Vec3(6, 6, 6))});
    const TetMesh mesh = fill_surface(nested, "nested.stl");
    EXPECT_NEAR(total_volume(mesh), 1000.0 - 216.0 + 8.0, 1e-9);
    const ModelReport report = load_model("nested", mesh).report;
    EXPECT_EQ(report.components, 2);
    EXPECT_EQ(report.cavities, 1);
    EXPECT_EQ(report.boundary_faces, 36);
  }
  EXPECT_EQ(diagnose_surface(shapes::box_surface(Vec3(0, 0, 0), Vec3(1, 1, 1))).components, 1);
}

TEST(FillSurface, HandlesAreCounted) {
  const Model frame = shapes::as_model(shapes::brick_mesh(Vec3(0, 0, 0), Vec3(3, 3, 1), {3, 3, 1}, [](const Vec3& c) {
    return (c - Vec3(1.5, 1.5, 0.5)).norm() > 0.1;
  }));
  const MeshDiagnosis diagnosis = diagnose_surface(boundary_surface(frame));
  EXPECT_EQ(diagnosis.genus, 1);
  EXPECT_NEAR(diagnosis.volume_mm3, 8.0, 1e-12);
}

TEST(FillSurface, OpenSurfacesAreRefusedWithThePlace) {
  TriangleMesh open = shapes::box_surface(Vec3(0, 0, 0), Vec3(10, 10, 10), 2);
  open.triangles.erase(open.triangles.begin());
  EXPECT_EQ(names(open), Names{"open_edges"});
  EXPECT_EQ(diagnose_surface(open).problems[0].count(), 3u);
  expect_error(ErrorKind::input, {"part.stl", "open", "3 such", "at ("}, [&] { (void)fill_surface(open, "part.stl"); });
}

TEST(FillSurface, SelfIntersectionsAreRefused) {
  const TriangleMesh through = joined({shapes::box_surface(Vec3(0, 0, 0), Vec3(10, 10, 10)), shapes::box_surface(Vec3(5, 3, 4), Vec3(15, 6, 7))});
  EXPECT_EQ(names(through), Names{"intersecting_faces"});
  expect_error(ErrorKind::input, {"part.stl", "passes through"}, [&] { (void)fill_surface(through, "part.stl"); });
}

TEST(FillSurface, TouchingPartsAreRefused) {
  // Two boxes that share an edge, and two that share a corner.
  const auto boxes = [](const Vec3& other_low) {
    return boundary_surface(shapes::as_model(shapes::brick_mesh(Vec3(0, 0, 0), Vec3(2, 2, 2), {2, 2, 2}, [&](const Vec3& c) {
      return c.maxCoeff() < 1.0 || (c - other_low).cwiseAbs().maxCoeff() < 1.0;
    })));
  };
  EXPECT_EQ(names(boxes(Vec3(1.5, 1.5, 0.5))), Names{"non_manifold_edges"});
  EXPECT_EQ(names(boxes(Vec3(1.5, 1.5, 1.5))), Names{"non_manifold_vertices"});
}

TEST(FillSurface, CollapsedTrianglesAreLeftOut) {
  TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(1, 1, 1));
  box.triangles.push_back({0, 0, 1});
  EXPECT_TRUE(names(box).empty());
  EXPECT_EQ(names(box, false), Names{"collapsed_triangles"});
  EXPECT_NEAR(total_volume(fill_surface(box, "box.obj")), 1.0, 1e-12);
  expect_error(ErrorKind::input, {"empty.stl", "no triangles"}, [] { (void)fill_surface({}, "empty.stl"); });
}

TEST(FillSurface, RepeatedTrianglesAreLeftOut) {
  const TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(1, 1, 1));
  TriangleMesh twice = box;
  for (auto t : box.triangles) {
    std::rotate(t.begin(), t.begin() + 1, t.end());
    twice.triangles.push_back(t);
  }
  EXPECT_EQ(names(twice, false), Names{"repeated_triangles"});
  EXPECT_NEAR(diagnose_surface(twice).volume_mm3, 1.0, 1e-12);
  EXPECT_NEAR(total_volume(fill_surface(twice, "twice.stl")), 1.0, 1e-12);
  TriangleMesh against = box;
  const auto& t = box.triangles[0];
  against.triangles.push_back({t[0], t[2], t[1]});
  expect_error(ErrorKind::input, {"more than two triangles", "remove triangles"}, [&] { (void)fill_surface(against, "against.stl"); });
}

TEST(FillSurface, APartInWrongUnitsIsRefusedBeforeItIsFilled) {
  const TriangleMesh box = shapes::box_surface(Vec3(0, 0, 0), Vec3(26000, 20000, 10000), 5);
  expect_error(ErrorKind::usage, {"model.scale", "0.01", "model.max_tet_volume_mm3", "huge.stl", "26000 x 20000 x 10000 mm"},
               [&] { (void)fill_surface(box, "huge.stl"); });
  EXPECT_NEAR(total_volume(fill_surface(box, "huge.stl", {.scale = 0.001})), 5.2e12, 1.0);
}

}  // namespace
}  // namespace curvesup
