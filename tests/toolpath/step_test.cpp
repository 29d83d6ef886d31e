#include "toolpath/step.h"

#include <gtest/gtest.h>

#include "toolpath/tracks.h"

namespace curvesup::toolpath {
namespace {

double length_of(const TrackPoint& from, const std::vector<TrackPoint>& way) {
  double sum = 0.0;
  Vec3 at = from.position;
  for (const TrackPoint& p : way) sum += (p.position - at).norm(), at = p.position;
  return sum;
}

void expect_on_named_triangles(const PieceMesh& mesh, const std::vector<TrackPoint>& way) {
  for (const TrackPoint& p : way) {
    const auto& [a, b, c] = mesh.triangles[p.triangle];
    EXPECT_LT((closest_point_on_triangle(p.position, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - p.position).norm(), 1e-9);
  }
}

TEST(WalkTo, IsStraightOnAPlane) {
  const PieceMesh mesh = sheets::only_piece(sheets::strip(10, 8, 13, 9));
  for (const Vec3& to : {Vec3(9.3, 7.1, 10), Vec3(2.1, 7.9, 10), Vec3(8.7, 2.2, 10), Vec3(0.4, 0.3, 10)}) {
    const TrackPoint from = sheets::point_on(mesh, Vec3(2.1, 2.2, 10)), end = sheets::point_on(mesh, to);
    const auto way = walk_to(mesh, from, end, 20.0);
    ASSERT_FALSE(way.empty());
    EXPECT_EQ(way.back().position, to);
    EXPECT_NEAR(length_of(from, way), (to - from.position).norm(), 1e-9);
    expect_on_named_triangles(mesh, way);
  }
}

TEST(WalkTo, StartsAndEndsOnEdgesAndVertices) {
  const PieceMesh mesh = sheets::only_piece(sheets::strip(10, 10, 10, 10));
  for (const Vec3& from : {Vec3(2, 2, 10), Vec3(2.5, 2, 10), Vec3(2.5, 2.5, 10)}) {
    for (const Vec3& to : {Vec3(4, 2.3, 10), Vec3(5, 3, 10), Vec3(4.5, 4.5, 10), Vec3(1, 5.25, 10)}) {
      // Whatever of the triangles around the start it is counted to.
      for (Index t = 0; t < static_cast<Index>(mesh.triangles.size()); ++t) {
        TrackPoint start = sheets::point_on(mesh, from);
        const auto& [a, b, c] = mesh.triangles[t];
        if ((closest_point_on_triangle(from, mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]) - from).norm() > 1e-9) continue;
        start.triangle = t;
        const auto way = walk_to(mesh, start, sheets::point_on(mesh, to), 20.0);
        if (from == Vec3(2, 2, 10) && way.empty()) continue;  // a vertex is left through the triangles beside the given one
        ASSERT_FALSE(way.empty()) << from.transpose() << " to " << to.transpose();
        EXPECT_NEAR(length_of(start, way), (to - from).norm(), 1e-9);
      }
    }
  }
}

TEST(WalkTo, GoesRoundACylinder) {
  const double radius = 5.0, angle = 0.6;
  const PieceMesh mesh = sheets::only_piece(sheets::cylinder(radius, 2.0, 8.0, 80, 20));
  const auto place = [&](double a) { return Vec3(radius * std::sin(a), 4.1, 10.0 + radius * std::cos(a)); };
  // From vertex row to vertex row: both lie on the triangles.
  const double start = -12 * 2.0 / 80, end = start + 24 * 2.0 / 80;
  ASSERT_NEAR(end - start, angle, 1e-12);
  const TrackPoint from = sheets::point_on(mesh, place(start)), to = sheets::point_on(mesh, place(end));
  const auto way = walk_to(mesh, from, to, 1.3 * radius * angle);
  ASSERT_FALSE(way.empty());
  EXPECT_NEAR(length_of(from, way), radius * angle, 1e-3 * radius);
  expect_on_named_triangles(mesh, way);
  EXPECT_TRUE(walk_to(mesh, from, to, 0.99 * (to.position - from.position).norm()).empty());
}

TEST(WalkTo, DoesNotCrossAGap) {
  const auto sheet = sheets::mapped_grid(
      20, 20, [](double u, double v) { return Vec3(10 * u, 10 * v, 10); }, 0.8, false,
      [](double u, double v) { return u < 0.5 || u > 0.55 || v > 0.8; });
  const PieceMesh mesh = sheets::only_piece(sheet);
  const TrackPoint left = sheets::point_on(mesh, Vec3(4.7, 3.3, 10)), right = sheets::point_on(mesh, Vec3(5.9, 3.3, 10));
  EXPECT_TRUE(walk_to(mesh, left, right, 20.0).empty());
  const TrackPoint above_left = sheets::point_on(mesh, Vec3(4.7, 9.3, 10)), above_right = sheets::point_on(mesh, Vec3(5.9, 9.3, 10));
  EXPECT_FALSE(walk_to(mesh, above_left, above_right, 20.0).empty());
}

TEST(LayStep, HasTheHeightOfTheLayerUnderIt) {
  // The right half of the layer is twice as thick: one bead must not lie across the change without a point there.
  auto sheet = sheets::strip(10, 4, 20, 8);
  for (std::size_t t = 0; t < sheet.gradient.size(); ++t) {
    const auto& [a, b, c] = sheet.stack.triangles[t];
    if ((sheet.stack.vertices[a] + sheet.stack.vertices[b] + sheet.stack.vertices[c]).x() > 15.0) sheet.gradient[t] *= 0.5;
  }
  const PieceMesh mesh = sheets::only_piece(sheet);
  const std::vector<char> regular(mesh.triangles.size(), 0);
  std::vector<Index> under;
  const Track step = lay_step(mesh, regular, sheets::point_on(mesh, Vec3(4.2, 2.1, 10)), sheets::point_on(mesh, Vec3(6.1, 1.8, 10)), 3.0, under);
  ASSERT_GT(step.points.size(), 2u);
  EXPECT_FALSE(under.empty());
  for (std::size_t i = 1; i < step.points.size(); ++i) {
    const TrackPoint& p = step.points[i];
    EXPECT_TRUE(p.step);
    EXPECT_NEAR(p.thickness, 0.5 * (p.position.x() + step.points[i - 1].position.x()) < 5.0 ? 0.8 : 1.6, 1e-9);
  }
}

TEST(LayStep, IsEmptyWhereNoWayIsShortEnough) {
  const PieceMesh mesh = sheets::only_piece(sheets::strip(10, 4, 20, 8));
  std::vector<Index> under;
  const std::vector<char> regular(mesh.triangles.size(), 0);
  const TrackPoint from = sheets::point_on(mesh, Vec3(1, 1, 10)), to = sheets::point_on(mesh, Vec3(4, 1, 10));
  EXPECT_TRUE(lay_step(mesh, regular, from, to, 2.0, under).points.empty());
  EXPECT_EQ(lay_step(mesh, regular, from, from, 2.0, under).points.size(), 1u);
}

}  // namespace
}  // namespace curvesup::toolpath
