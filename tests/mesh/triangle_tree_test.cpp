#include "curvesup/mesh/triangle_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace curvesup {
namespace {

TriangleMesh random_triangles(int count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(-10, 10), size(-1, 1);
  TriangleMesh mesh;
  for (Index i = 0; i < count; ++i) {
    const Vec3 base(at(random), at(random), at(random));
    for (int c = 0; c < 3; ++c) mesh.vertices.push_back(base + Vec3(size(random), size(random), size(random)));
    mesh.triangles.push_back({3 * i, 3 * i + 1, i % 50 == 0 ? 3 * i + 1 : 3 * i + 2});  // every 50th is degenerate
  }
  return mesh;
}

// One at each whole z.
TriangleMesh stacked_triangles(int count) {
  TriangleMesh mesh;
  for (Index i = 0; i < count; ++i) {
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, double(i)}, {2, 0, double(i)}, {0, 2, double(i)}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

TEST(TriangleTree, NearestAgreesWithTryingAll) {
  const TriangleMesh mesh = random_triangles(500);
  const TriangleTree tree(mesh);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> at(-12, 12);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(at(random), at(random), at(random));
    double best = std::numeric_limits<double>::max();
    for (const auto& t : mesh.triangles) {
      best = std::min(best, (closest_point_on_triangle(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]) - p).norm());
    }
    const auto found = tree.nearest(p, 100.0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->distance, best, 1e-12);
    EXPECT_FALSE(tree.nearest(p, best * 0.99));
  }
}

TEST(TriangleTree, FirstHitIsTheNearestPlaneCrossingInsideATriangle) {
  const TriangleTree tree(stacked_triangles(20));
  const auto hit = tree.first_hit({0.5, 0.5, 7.5}, {0, 0, -1}, 0, 100);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->triangle, 7);
  EXPECT_NEAR(hit->t, 0.5, 1e-12);
  EXPECT_FALSE(tree.first_hit({1.5, 1.5, 7.5}, {0, 0, -1}, 0, 100));
}

TEST(TriangleTree, NearestHitOnALineAgreesWithTryingAllPlanes) {
  const TriangleMesh mesh = random_triangles(500);
  const TriangleTree tree(mesh);
  std::mt19937 random(13);
  std::uniform_real_distribution<double> at(-6, 6), component(-1, 1);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 p(at(random), at(random), at(random));
    const Vec3 u = i % 10 == 0 ? Vec3(Vec3::Unit(i % 3)) : Vec3(component(random), component(random), component(random));
    double best = std::numeric_limits<double>::infinity();
    for (const auto& t : mesh.triangles) {
      const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const Vec3 normal = area_normal(a, b, c);
      const double where = normal.dot(a - p) / normal.dot(u);
      const Vec3 q = p + where * u;
      const bool inside = area_normal(a, b, q).dot(normal) >= 0.0 && area_normal(b, c, q).dot(normal) >= 0.0 &&
                          area_normal(c, a, q).dot(normal) >= 0.0;
      if (normal.norm() > 0.0 && inside && std::abs(where) < std::abs(best)) best = where;
    }
    const auto found = tree.nearest_hit(p, u, 50.0);
    ASSERT_EQ(found.has_value(), std::abs(best) <= 50.0);
    if (!found) continue;
    ++hits;
    EXPECT_NEAR(found->t, best, 1e-9 * (1.0 + std::abs(best)));
    EXPECT_FALSE(tree.nearest_hit(p, u, 0.999 * std::abs(best)));
  }
  EXPECT_GT(hits, 50);
}

TEST(TriangleTree, OfTwoEquallyNearHitsTheOneBehindCounts) {
  const TriangleTree tree(stacked_triangles(20));
  for (const double way : {1.0, -1.0}) {
    const auto hit = tree.nearest_hit({0.5, 0.5, 7.5}, {0, 0, way}, 100);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->triangle, way > 0.0 ? 7 : 8);
    EXPECT_EQ(hit->t, -0.5);
  }
}

}  // namespace
}  // namespace curvesup
