#include "trim/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace curvesup {
namespace {

double area(const std::vector<Vec2>& p, const std::array<Index, 3>& t) {
  const Vec2 u = p[t[1]] - p[t[0]], v = p[t[2]] - p[t[0]];
  return 0.5 * (u.x() * v.y() - u.y() * v.x());
}

// No triangle turned over, and their areas add up to the region: then they tile it.
void expect_tiling(const std::vector<Vec2>& points, const std::vector<Loop>& loops) {
  double region = 0.0, sum = 0.0;
  for (const Loop& loop : loops) region += loop_area(points, loop);
  for (const auto& t : triangulate_loops(points, loops)) {
    EXPECT_GE(area(points, t), -1e-12);
    sum += area(points, t);
  }
  EXPECT_NEAR(sum, region, 1e-9 * (1.0 + std::abs(region)));
}

Loop append_star(std::vector<Vec2>& points, const Vec2& centre, double radius, int count, bool hole, std::mt19937& random) {
  std::uniform_real_distribution<double> share(0.4, 1.0);
  Loop loop;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count, r = radius * share(random);
    loop.push_back(static_cast<Index>(points.size()));
    points.push_back(centre + r * Vec2(std::cos(angle), std::sin(angle)));
  }
  if (hole) std::reverse(loop.begin(), loop.end());
  return loop;
}

TEST(Polygon, TilesStarsWithHoles) {
  std::mt19937 random(5);
  for (int round = 0; round < 200; ++round) {
    std::vector<Vec2> points;
    std::vector<Loop> loops = {append_star(points, {0, 0}, 10.0, 5 + round % 40, false, random)};
    const int holes = round % 4;
    for (int h = 0; h < holes; ++h) {
      const double angle = 2.0 * std::numbers::pi * (h + 0.3) / holes;
      loops.push_back(append_star(points, 2.0 * Vec2(std::cos(angle), std::sin(angle)), 0.9, 4 + round % 7, true, random));
    }
    if (round % 40 < 8) loops.resize(1);  // the star may be too spiky to hold holes
    expect_tiling(points, loops);
  }
}

TEST(Polygon, TilesRegionsWhoseBorderTouchesItself) {
  // A notch whose tip lies on the opposite edge, and corners in the middle of a straight edge.
  const std::vector<Vec2> points = {{0, 0}, {2, 0}, {4, 0}, {4, 2}, {2, 0}, {2, 3}, {0, 3}, {0, 2}};
  expect_tiling(points, {{0, 1, 2, 3, 4, 5, 6, 7}});
}

TEST(Polygon, TilesTwoIslandsOneWithAHole) {
  const std::vector<Vec2> points = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {6, 0}, {8, 0}, {7, 2}};
  expect_tiling(points, {{0, 1, 2, 3}, {4, 5, 6, 7}, {8, 9, 10}});
}

TEST(Polygon, SimplifiedLoopsStayWithinTheTolerance) {
  std::vector<Vec2> points;
  Loop circle;
  for (int i = 0; i < 200; ++i) {
    circle.push_back(i);
    points.emplace_back(3.0 * std::cos(0.01 * std::numbers::pi * i), 3.0 * std::sin(0.01 * std::numbers::pi * i));
  }
  Loop loop = circle;
  std::vector<char> fixed(200, 0);
  fixed[17] = fixed[18] = 1;
  std::vector<Vec2> moved = points;
  simplify_loop(points, fixed, 0.01, loop, moved);
  EXPECT_LT(loop.size(), 50u);
  EXPECT_TRUE(std::count(loop.begin(), loop.end(), 17) && std::count(loop.begin(), loop.end(), 18));
  double worst = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec2 middle = 0.5 * (points[loop[i]] + points[loop[(i + 1) % loop.size()]]);
    worst = std::max(worst, 3.0 - middle.norm());
  }
  EXPECT_LE(worst, 0.0101);
  EXPECT_GT(worst, 0.002);
  EXPECT_NEAR(loop_area(moved, loop) / loop_area(points, circle), 1.0, 1e-5);
  for (const Index i : loop) EXPECT_NEAR(moved[i].norm(), 3.0, 0.01);
  EXPECT_TRUE(moved[17] == points[17] && moved[18] == points[18]);
}

}  // namespace
}  // namespace curvesup
