#include "curvesup/mesh/triangle_tree.h"

#include <gtest/gtest.h>

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
  TriangleMesh mesh;
  for (Index i = 0; i < 20; ++i) {
    mesh.vertices.insert(mesh.vertices.end(), {{0, 0, double(i)}, {2, 0, double(i)}, {0, 2, double(i)}});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const TriangleTree tree(mesh);
  const auto hit = tree.first_hit({0.5, 0.5, 7.5}, {0, 0, -1}, 0, 100);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->triangle, 7);
  EXPECT_NEAR(hit->t, 0.5, 1e-12);
  EXPECT_FALSE(tree.first_hit({1.5, 1.5, 7.5}, {0, 0, -1}, 0, 100));
}

}  // namespace
}  // namespace curvesup
