#include "skeleton/resting_part.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "curvesup/mesh/tet_mesh.h"
#include "helpers/brick_domain.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

constexpr int kCount = 32;  // layers of 0.5 mm: G = z / 16
constexpr double kTop = 8.0;

// A floor of the model up to z = 8 where `solid` says so, support around it and above.
class Floor {
 public:
  template <class Solid>
  explicit Floor(const Solid& solid)
      : domain_(shapes::brick_domain(Vec3(0, 0, 0), Vec3(20, 20, 16), {20, 20, 8},
                                     [&](const Vec3& c) { return c.z() < kTop && solid(c.x(), c.y()); })),
        field_(shapes::sampled_field(domain_, [](const Vec3& p) { return p.z() / 16; })) {}

  // What rests of an upright cylinder on the floor at (x, y).
  [[nodiscard]] double resting(double x, double y, double radius) const {
    const Vec3 end(x, y, kTop);
    const StandingTrunk trunk{end, support_tet_above(end), Vec3::UnitZ(), radius, {radius, 1.0, 0.0}};
    return resting_part(TetWalk(domain_, field_), kCount, trunk, 0.32);
  }

 private:
  [[nodiscard]] Index support_tet_above(const Vec3& p) const {
    const Vec3 inside = p + 1e-6 * Vec3(0.3, 0.2, 1.0);
    for (Index t = 0; t < static_cast<Index>(domain_.mesh.tets.size()); ++t) {
      if (domain_.region(t) == Material::model) continue;
      const auto corner = [&](int c) { return domain_.mesh.vertices[domain_.mesh.tets[t][c]]; };
      Eigen::Matrix3d edges;
      edges << corner(1) - corner(0), corner(2) - corner(0), corner(3) - corner(0);
      const Vec3 weight = edges.inverse() * (inside - corner(0));
      if (weight.minCoeff() >= 0.0 && weight.sum() <= 1.0) return t;
    }
    return kNone;
  }

  Domain domain_;
  ScalarField field_;
};

TEST(RestingPart, AllOfATrunkRestsOnABroadFloor) {
  const Floor floor([](double, double) { return true; });
  for (const double radius : {0.8, 2.0, 4.5}) EXPECT_EQ(floor.resting(10.1, 9.7, radius), 1.0) << radius;
}

TEST(RestingPart, OverABarAsMuchRestsAsTheBarCarries) {
  const Floor floor([](double x, double) { return x > 8 && x < 12; });
  EXPECT_EQ(floor.resting(10, 10, 1.5), 1.0);
  // The part of a disc of radius 5 that a strip of half the width 2 covers.
  const double t = 2.0 / 5.0;
  EXPECT_NEAR(floor.resting(10, 10, 5.0), 2.0 / std::numbers::pi * (std::asin(t) + t * std::sqrt(1.0 - t * t)), 0.12);
}

TEST(RestingPart, AtAnEdgeHalfOfATrunkRests) {
  const Floor floor([](double x, double) { return x < 10; });
  EXPECT_NEAR(floor.resting(10, 10, 3.0), 0.5, 0.12);
}

}  // namespace
}  // namespace curvesup
