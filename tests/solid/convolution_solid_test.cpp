#include "curvesup/solid/convolution_solid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "curvesup/core/error.h"
#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {
namespace {

std::vector<Strut> random_struts(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0.0, 30.0), step(-4.0, 4.0), radius(0.8, 3.0);
  std::vector<Strut> struts;
  for (int i = 0; i < n; ++i) {
    const Vec3 a(place(random), place(random), place(random));
    struts.push_back({a, a + Vec3(step(random), step(random), step(random)), radius(random)});
  }
  return struts;
}

// Kernel by Simpson's rule along the strut, straight from its definition, divided by the chord.
double by_quadrature(const Strut& s, const Vec3& p, double kappa) {
  const double reach = kappa * s.radius_mm, length = (s.b - s.a).norm();
  const Vec3 u = (s.b - s.a) / length;
  const double along = (p - s.a).dot(u), distance2 = (p - s.a - along * u).squaredNorm();
  if (distance2 >= reach * reach) return 0.0;
  const double chord = 2.0 * std::sqrt(reach * reach - distance2);
  const int n = 4000;
  double sum = 0.0;
  for (int i = 0; i <= n; ++i) {
    const double d2 = (s.a + length * i / n * u - p).squaredNorm() / (reach * reach);
    const double f = d2 < 1.0 ? (1.0 - d2) * (1.0 - d2) : 0.0;
    sum += f * (i == 0 || i == n ? 1.0 : i % 2 == 1 ? 4.0 : 2.0);
  }
  const double weight = 15.0 / (8.0 * std::pow(1.0 - 1.0 / (kappa * kappa), 2));
  return weight * sum * length / n / 3.0 / chord;
}

// Distance from the point `at` outward along `direction` to the surface.
double radius_at(const Solid& solid, const Vec3& at, const Vec3& direction) {
  double in = 0.0, out = 40.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (in + out);
    (solid.value(at + middle * direction) >= 0.0 ? in : out) = middle;
  }
  return in;
}

TEST(ConvolutionSolid, ClosedFormIsTheIntegral) {
  for (const Strut& s : random_struts(20, 1)) {
    const ConvolutionSolid solid(std::vector<Strut>{s});
    std::mt19937 random(5);
    std::uniform_real_distribution<double> offset(-4.0, 4.0);
    for (int i = 0; i < 30; ++i) {
      const Vec3 p = 0.5 * (s.a + s.b) + Vec3(offset(random), offset(random), offset(random));
      EXPECT_NEAR(solid.value(p) + 1.0, by_quadrature(s, p, ConvolutionOptions{}.kernel_ratio), 1e-4);
    }
  }
}

TEST(ConvolutionSolid, GridGivesTheBitsOfThePlainSum) {
  const ConvolutionSolid solid(random_struts(400, 2));
  std::mt19937 random(6);
  std::uniform_real_distribution<double> place(-8.0, 38.0);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    const double value = solid.value(p);
    ASSERT_EQ(value, solid.plain_value(p)) << p.transpose();
    inside += value >= 0.0;
  }
  EXPECT_GT(inside, 100);
}

TEST(ConvolutionSolid, LocalViewGivesTheSameBitsAndAnswers) {
  std::vector<Strut> struts = random_struts(300, 3);
  for (std::size_t i = 0; i < struts.size(); i += 7) {
    struts[i].cone_radius_mm = 0.3;
    struts[i].cone_slope = 0.5;
  }
  const ConvolutionSolid solid(struts);
  const auto local = solid.local();
  std::mt19937 random(16);
  std::uniform_real_distribution<double> place(-6.0, 36.0), part(-1.0, 1.0);
  int inside = 0, far = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 centre(place(random), place(random), place(random));
    const double radius = 2.0 * std::abs(part(random));
    local->focus(centre, radius);
    for (int j = 0; j < 10; ++j) {
      const Vec3 offset = 1.2 * radius * Vec3(part(random), part(random), part(random));
      far += offset.norm() > radius;
      const double value = local->value(centre + offset);
      ASSERT_EQ(value, solid.value(centre + offset));
      inside += value >= 0.0;
      const Vec3 q = centre + 0.3 * offset;
      ASSERT_EQ(local->surely_outside(q, 0.3 * radius), solid.surely_outside(q, 0.3 * radius));
      ASSERT_EQ(local->surely_inside(q, 0.3 * radius), solid.surely_inside(q, 0.3 * radius));
      ASSERT_EQ(local->thinnest_radius(q, 0.3 * radius, 0.7), solid.thinnest_radius(q, 0.3 * radius, 0.7));
    }
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(far, 5000) << "points beyond the focus get true answers, too";
}

TEST(ConvolutionSolid, RadiusOfALoneStrutIsTheWantedOne) {
  const Vec3 u = Vec3(0.3, 0.2, 1.0).normalized(), side = u.unitOrthogonal();
  for (const double kappa : {1.3, 1.5, 1.6}) {
    for (const int n : {1, 2, 4, 25, 50}) {
      const double rho = 0.8 * std::sqrt(n);
      const ConvolutionSolid solid(std::vector<Strut>{{-40.0 * u, 40.0 * u, rho}}, {.kernel_ratio = kappa});
      EXPECT_NEAR(radius_at(solid, Vec3::Zero(), side), rho, 1e-9 * rho);
      // The same strut in pieces as long as a layer is thick.
      std::vector<Strut> pieces;
      for (double t = -40.0; t < 40.0; t += 0.5) pieces.push_back({t * u, (t + 0.5) * u, rho});
      const ConvolutionSolid split(pieces, {.kernel_ratio = kappa});
      EXPECT_NEAR(radius_at(split, 0.2 * u, side), rho, 1e-9 * rho);
    }
  }
}

TEST(ConvolutionSolid, SplittingAStrutChangesNothing) {
  const Strut whole{{0, 0, 0}, {3, 1, 7}, 1.1};
  std::vector<Strut> parts;
  double from = 0.0;
  for (const double to : {0.13, 0.4, 0.41, 0.8, 1.0}) {
    parts.push_back({whole.a + from * (whole.b - whole.a), whole.a + to * (whole.b - whole.a), whole.radius_mm});
    from = to;
  }
  const ConvolutionSolid one(std::vector<Strut>{whole}), many(parts);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> place(-2.0, 9.0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    EXPECT_NEAR(one.value(p), many.value(p), 1e-13);
  }
}

TEST(ConvolutionSolid, BoundsEncloseEveryPointOfTheBall) {
  const ConvolutionSolid solid(random_struts(150, 4));
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-5.0, 35.0), size(0.0, 1.0);
  std::normal_distribution<double> normal;
  int decided = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 centre(place(random), place(random), place(random));
    const double radius = std::pow(10.0, -2.0 + 3.5 * size(random));
    const Solid::Bounds bounds = solid.bounds(centre, radius);
    for (int j = 0; j < 30; ++j) {
      const Vec3 u = Vec3(normal(random), normal(random), normal(random)).normalized();
      const double value = solid.value(centre + (j % 3 == 0 ? 1.0 : std::cbrt(size(random))) * radius * u);
      ASSERT_GE(value, bounds.low);
      ASSERT_LE(value, bounds.high);
    }
    decided += radius < 0.3 && (bounds.low > 0.0 || bounds.high < 0.0);
  }
  EXPECT_GT(decided, 900) << "bounds of small balls must decide most of the time";
}

TEST(ConvolutionSolid, FastAnswersAgreeWithTheSlowOnes) {
  const std::vector<Strut> struts = random_struts(150, 14);
  const ConvolutionSolid solid(struts);
  std::mt19937 random(15);
  std::uniform_real_distribution<double> place(-5.0, 35.0), size(0.0, 1.0);
  int outside = 0, inside = 0, sure = 0, thick = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    const double radius = std::pow(10.0, -1.0 + 1.5 * size(random));
    ASSERT_EQ(solid.inside(p), solid.value(p) >= 0.0);
    inside += solid.inside(p);
    const Solid::Bounds bounds = solid.bounds(p, radius);
    if (std::abs(bounds.high) > 1e-7) {
      ASSERT_EQ(solid.surely_outside(p, radius), bounds.high < 0.0);
    }
    if (std::abs(bounds.low) > 1e-7) {
      ASSERT_EQ(solid.surely_inside(p, radius), bounds.low > 0.0);
    }
    sure += bounds.low > 0.0;
    outside += bounds.high < 0.0;
    double thinnest = std::numeric_limits<double>::infinity();
    for (const Strut& s : struts) {
      if ((closest_point_on_segment(p, s.a, s.b) - p).norm() < radius + ConvolutionOptions{}.kernel_ratio * s.radius_mm) thinnest = std::min(thinnest, s.radius_mm);
    }
    const double bound = solid.thinnest_radius(p, radius, 1.2);
    const bool thinner = thinnest <= 1.2;
    ASSERT_EQ(bound <= 1.2, thinner);
    ASSERT_TRUE(thinner || bound <= thinnest * (1.0 + 1e-12));
    thick += !thinner;
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(sure, 100);
  EXPECT_GT(outside, 500);
  EXPECT_GT(thick, 500);
}

TEST(ConvolutionSolid, BoundsTightenWithTheBall) {
  const ConvolutionSolid solid(random_struts(60, 11));
  const Vec3 p(14.0, 15.0, 16.0);
  double before = 1e9;
  for (const double radius : {1.0, 0.1, 0.01, 0.001}) {
    const Solid::Bounds b = solid.bounds(p, radius);
    EXPECT_LT(b.high - b.low, before);
    before = b.high - b.low;
  }
  EXPECT_LT(before, 0.05);
}

// A leaf, a straight chain of three layers and a bend, on the platform.
Skeleton bent_chain() {
  Skeleton s;
  s.nodes = {{{0, 0, 3}, 0, 6, NodeKind::leaf},
             {{0, 0, 2.5}, 0, 5, NodeKind::node},
             {{0, 0, 2}, 0, 4, NodeKind::node},
             {{0, 0, 1.5}, 0, 3, NodeKind::node},
             {{1.5, 0, 0}, 0, 3, NodeKind::platform_end}};
  s.edges = {{0, 1, 1, 0.8, 6}, {1, 2, 1, 0.8, 5}, {2, 3, 1, 0.8, 4}, {3, 4, 1, 0.8, 3}};
  return s;
}

TEST(Struts, CollinearEdgesAreJoinedAndEndsExtended) {
  const auto struts = struts_of(bent_chain());
  ASSERT_EQ(struts.size(), 2u);
  EXPECT_NEAR((struts[0].a - Vec3(0, 0, 3.8)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((struts[0].b - Vec3(0, 0, 1.5)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((struts[1].b - Vec3(1.5, 0, 0)).norm(), 0.8, 1e-12);
  EXPECT_LT(struts[1].b.z(), 0.0);
}

// A trunk of edges of one layer from a leaf to a model end at the origin.
Skeleton trunk_on_model(double radius, const Vec3& axis, double step) {
  Skeleton s;
  const int edges = 30;
  for (int i = 0; i <= edges; ++i) s.nodes.push_back({(edges - i) * step * axis, 0, edges - i, NodeKind::node});
  s.nodes.front().kind = NodeKind::leaf;
  s.nodes.back().kind = NodeKind::model_end;
  for (int i = 0; i < edges; ++i) s.edges.push_back({i, i + 1, 1, radius, edges - i});
  return s;
}

TEST(ConvolutionSolid, ATrunkStandsOnTheModelByAConeThatWidensUpwards) {
  const Skeleton s = trunk_on_model(5.0, Vec3::UnitZ(), 0.7);
  const ConvolutionSolid solid(s, {}, std::vector<ModelStand>{{30, 2.5, 1.0, 0.0}}), plain(s);
  EXPECT_NEAR(radius_at(solid, {0, 0, 12}, Vec3::UnitX()), 5.0, 0.01);
  double below = 0.0;
  for (double z = 0.0; z < 8.0; z += 0.35) {
    const double radius = radius_at(solid, {0, 0, z}, Vec3::UnitX());
    EXPECT_GT(radius, std::min(0.9 * radius_at(plain, {0, 0, z}, Vec3::UnitX()), 2.5 + z - 0.4)) << "z = " << z;
    EXPECT_LT(radius, std::min(5.0 + 1e-6, 2.5 + z)) << "z = " << z;
    EXPECT_GE(radius, below - 1e-6);
    below = radius;
  }
  // What the grid gives is the plain sum, and the bounds hold.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-6.0, 6.0);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 p(place(random), place(random), place(random));
    EXPECT_EQ(solid.value(p), solid.plain_value(p));
    EXPECT_EQ(solid.inside(p), solid.value(p) >= 0.0);
    const auto bounds = solid.bounds(p + Vec3(0.2, 0.1, -0.1), 0.25);
    EXPECT_GE(solid.value(p), bounds.low);
    EXPECT_LE(solid.value(p), bounds.high);
  }
}

// Sections of 0.7 mm of a trunk on a plane wall with n . d_p = rise, d_p = z: how many have less than a quarter of their area
// over the wall or the section below. Those of less than half a squared bead are not printed.
int sections_on_air(double radius, double rise, double lean) {
  constexpr double kLayer = 0.7, kStep = 0.15;
  const Vec3 axis(std::sin(lean), 0, std::cos(lean)), normal(std::sqrt(1.0 - rise * rise), 0, rise);
  const Skeleton skeleton = trunk_on_model(radius, axis, kLayer / std::cos(lean));
  // The model below the wall: one tet with its upper face on the plane, and a support tet over it.
  const Vec3 along = normal.unitOrthogonal(), across = normal.cross(along);
  Domain domain;
  domain.mesh.vertices = {300.0 * along, 300.0 * Vec3(-along + across), 300.0 * Vec3(-along - across), -300.0 * normal, 300.0 * normal};
  domain.mesh.tets = {{0, 2, 1, 3}, {0, 1, 2, 4}};
  for (auto& t : domain.mesh.tets) {
    if (tet_volume(domain.mesh, t == domain.mesh.tets[0] ? 0 : 1) < 0.0) std::swap(t[0], t[1]);
  }
  domain.topology = build_topology(domain.mesh);
  domain.model_tets = 1;
  std::vector<double> value;
  for (const Vec3& v : domain.mesh.vertices) value.push_back(v.z());
  Skeleton placed = skeleton;
  for (SkeletonNode& n : placed.nodes) n.tet = 1;
  const auto stands = stands_on_model(placed, domain, make_scalar_field(domain.mesh, value));
  const ConvolutionSolid solid(placed, {}, stands);
  int on_air = 0;
  for (const double phase : {0.1, 0.3, 0.5, 0.69}) {
    double dropped = -1e9;  // z of a section that is not there
    for (int k = -10; k < 8; ++k) {
      const double z = k * kLayer + phase;
      int in = 0, resting = 0;
      for (double x = -3.0 * radius - 5.0; x < 3.0 * radius + 10.0; x += kStep) {
        for (double y = -radius - 1.0; y < radius + 1.0; y += kStep) {
          const Vec3 p(x, y, z), below(x, y, z - kLayer);
          if (normal.dot(p) <= 0.0 || !solid.inside(p)) continue;
          ++in;
          resting += normal.dot(below) <= 0.0 || (dropped < z - 1.5 * kLayer && solid.inside(below));
        }
      }
      if (in * kStep * kStep < 0.32) {
        dropped = z;
      } else if (resting < 0.25 * in) {
        dropped = z;
        ++on_air;
      }
    }
  }
  return on_air;
}

TEST(ConvolutionSolid, ATrunkOnAWallStartsWithWhatTheWallCarries) {
  for (const double radius : {0.8, 2.5, 4.5}) {
    for (const double rise : {0.45, 0.6, 0.9}) {
      for (const double lean : {-0.3, 0.0, 0.35}) {
        EXPECT_EQ(sections_on_air(radius, rise, lean), 0) << "radius " << radius << ", n . d_p " << rise << ", lean " << lean;
      }
    }
  }
}

TEST(ConvolutionSolid, FullRadiusAtTheLeaf) {
  Skeleton s;
  s.nodes = {{{0, 0, 10}, 0, 20, NodeKind::leaf}, {{0, 0, 0}, 0, 0, NodeKind::platform_end}};
  s.edges = {{0, 1, 1, 0.8, 20}};
  const ConvolutionSolid solid(s);
  EXPECT_NEAR(radius_at(solid, {0, 0, 10}, Vec3::UnitX()), 0.8, 0.08);
  EXPECT_NEAR(radius_at(solid, {0, 0, 9.75}, Vec3::UnitX()), 0.8, 0.008);
  EXPECT_NEAR(radius_at(solid, {0, 0, 0.1}, Vec3::UnitX()), 0.8, 0.08);
}

TEST(ConvolutionSolid, FootWidensTheTrunkOnThePlatform) {
  const ConvolutionSolid solid(bent_chain(), {.foot_radius_mm = 4.0, .foot_layers = 2});
  EXPECT_NEAR(radius_at(solid, {1.5, 0, 0}, Vec3::UnitY()), 4.0, 1e-9);
  EXPECT_LT(radius_at(solid, {1.5, 0, 1.0}, Vec3::UnitY()), 4.0);
  EXPECT_LT(solid.value({3.5, 0, 2.1}), 0.0) << "above the foot";
  std::mt19937 random(12);
  std::uniform_real_distribution<double> place(-5.0, 6.0);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(place(random), place(random), place(random)), q = p + Vec3(0.1, 0.2, -0.2);
    const Solid::Bounds b = solid.bounds(p, 0.3001);
    EXPECT_GE(solid.value(q), b.low);
    EXPECT_LE(solid.value(q), b.high);
  }
}

TEST(ConvolutionSolid, EmptyAndBadOptions) {
  const ConvolutionSolid nothing{Skeleton{}};
  EXPECT_LT(nothing.value(Vec3::Zero()), 0.0);
  EXPECT_LT(nothing.bounds(Vec3::Zero(), 100.0).high, 0.0);
  EXPECT_THROW(ConvolutionSolid(Skeleton{}, {.kernel_ratio = 1.0}), Error);
  EXPECT_THROW(ConvolutionSolid(Skeleton{}, {.kernel_ratio = 1.9}), Error);
}

}  // namespace
}  // namespace curvesup
