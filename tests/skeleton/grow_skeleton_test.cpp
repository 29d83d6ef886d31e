#include "curvesup/skeleton/grow_skeleton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "curvesup/core/error.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/skeleton/stand_angle.h"
#include "core/angle_between.h"
#include "helpers/support_domain.h"
#include "skeleton/angle_limit.h"
#include "skeleton/tet_walk.h"

namespace curvesup {
namespace {

using shapes::support_domain;
using shapes::SupportDomain;

constexpr double kThickness = 0.5;
constexpr int kCount = 40;  // layers per unit of G: G = z / 20 has layers of 0.5 mm

// A slab [8,28] x [8,20] x [10,13] that floats; the domain reaches below the platform.
SupportDomain floating_slab(const Vec3& slope = Vec3(0, 0, 1.0 / 20), int finer = 1) {
  return support_domain(
      {0, 0, -2}, {36, 28, 16}, {18 * finer, 14 * finer, 18},
      [](const Vec3& c) { return c.x() > 8 && c.x() < 28 && c.y() > 8 && c.y() < 20 && c.z() > 10 && c.z() < 13; },
      [=](const Vec3& p) { return slope.dot(p); });
}

// The slab over a wide plate [4,32] x [4,24] x [2,4] that also floats.
SupportDomain slab_over_plate() {
  return support_domain(
      {0, 0, -2}, {36, 28, 16}, {18, 14, 18},
      [](const Vec3& c) {
        return (c.x() > 8 && c.x() < 28 && c.y() > 8 && c.y() < 20 && c.z() > 10 && c.z() < 13) ||
               (c.x() > 4 && c.x() < 32 && c.y() > 4 && c.y() < 24 && c.z() > 2 && c.z() < 4);
      },
      [](const Vec3& p) { return p.z() / 20; });
}

// Two cubes of 1 mm side, 4 mm apart, 10 mm above the platform.
SupportDomain two_cubes() {
  return support_domain(
      {0, 0, -1}, {15, 11, 12}, {15, 11, 13},
      [](const Vec3& c) {
        return std::abs(c.y() - 5.5) < 0.1 && std::abs(c.z() - 10.5) < 0.1 &&
               (std::abs(c.x() - 5.5) < 0.1 || std::abs(c.x() - 9.5) < 0.1);
      },
      [](const Vec3& p) { return p.z() / 20; });
}

SkeletonResult grow(const SupportDomain& d, const SkeletonOptions& options = {}) {
  return grow_skeleton(d.model, d.domain, d.field, d.overhang, kCount, options);
}

void expect_all_checks(const SkeletonReport& report) {
  EXPECT_FALSE(report.checks.empty());
  for (const Check& c : report.checks) EXPECT_TRUE(c.ok) << c.name << " " << c.value << " against " << c.limit;
}

TEST(TetWalk, FallsToAValueAtTheExactPlace) {
  const SupportDomain d = floating_slab(Vec3(0.01, 0.005, 0.05));
  const TetWalk walk(d.domain, d.field);
  const Index face = d.overhang.faces[0];
  const auto& v = d.model.boundary[face].vertices;
  const Vec3 start = (d.model.mesh.vertices[v[0]] + d.model.mesh.vertices[v[1]] + d.model.mesh.vertices[v[2]]) / 3.0;
  const Vec3 u = Vec3(0.2, -0.1, -1).normalized();
  const double slope = Vec3(0.01, 0.005, 0.05).dot(u), from = Vec3(0.01, 0.005, 0.05).dot(start);
  const WalkResult w = walk.walk(start, d.domain.interface_tet[face], u, {.value = from - 0.2});
  ASSERT_EQ(w.stop, WalkStop::value);
  EXPECT_NEAR((w.position - (start + 0.2 / -slope * u)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(walk.value_at(w.tet, w.position), from - 0.2, 1e-13);
  const WalkResult floor = walk.walk(start, d.domain.interface_tet[face], u, {});
  ASSERT_EQ(floor.stop, WalkStop::platform);
  EXPECT_EQ(floor.position.z(), 0.0);
  const WalkResult back = walk.walk(start - 3.0 * Vec3::UnitZ(), floor.tet, Vec3::UnitZ(), {});
  EXPECT_NE(back.stop, WalkStop::value);
}

TEST(TetWalk, MeetsTheModelFromBelow) {
  const SupportDomain d = floating_slab();
  const TetWalk walk(d.domain, d.field);
  const Index face = d.overhang.faces[0];
  const auto& v = d.model.boundary[face].vertices;
  const Vec3 start = (d.model.mesh.vertices[v[0]] + d.model.mesh.vertices[v[1]] + d.model.mesh.vertices[v[2]]) / 3.0;
  const WalkResult below = walk.walk(start, d.domain.interface_tet[face], -Vec3::UnitZ(), {.length = 5.0});
  ASSERT_EQ(below.stop, WalkStop::length);
  const WalkResult up = walk.walk(below.position, below.tet, Vec3::UnitZ(), {});
  ASSERT_EQ(up.stop, WalkStop::model);
  EXPECT_NEAR((up.position - start).norm(), 0.0, 1e-12);
  EXPECT_EQ(up.model_tet, d.model.boundary[face].tet);
}

TEST(TurnTowards, IsAnExactRotation) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    const Vec3 a = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 b = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 turned = AngleLimit(0.3).turn(a, b);
    EXPECT_NEAR(turned.norm(), 1.0, 1e-14);
    const double full = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
    EXPECT_NEAR(std::acos(std::clamp(a.dot(turned), -1.0, 1.0)), std::min(0.3, full), 1e-7);
    EXPECT_NEAR(std::acos(std::clamp(b.dot(turned), -1.0, 1.0)), std::max(0.0, full - 0.3), 1e-7);
  }
  EXPECT_NEAR(AngleLimit(0.3).turn(Vec3::UnitZ(), -Vec3::UnitZ()).z(), std::cos(0.3), 1e-14);
}

TEST(AngleLimit, HoldsAsTheAngleItselfTells) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const AngleLimit limit(0.7);
  for (int i = 0; i < 200; ++i) {
    const Vec3 a = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 b = Vec3(normal(random), normal(random), normal(random)).normalized();
    EXPECT_EQ(limit.holds(a, b), angle_between(a, b) <= 0.7);
    EXPECT_TRUE(limit.holds(a, limit.turn(a, b))) << "up to rounding";
    if (limit.holds(a, b)) continue;
    EXPECT_FALSE(limit.holds(a, AngleLimit(0.7 + 1e-8).turn(a, b)));
    EXPECT_TRUE(limit.holds(a, AngleLimit(0.7 - 1e-8).turn(a, b)));
  }
}

TEST(PlaceLeaves, EveryOverhangPointHasALeafNearby) {
  const SupportDomain d = floating_slab(Vec3(0.01, 0, 0.05));
  const double spacing = 1.2;
  const auto leaves = place_leaves(d.model, d.field, d.overhang, spacing);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  double farthest = 0.0;
  for (const Index f : d.overhang.faces) {
    const auto& v = d.model.boundary[f].vertices;
    const Vec3 direction = print_direction(d.field, d.model.boundary[f].tet);
    for (int i = 0; i < 40; ++i) {
      double s = uniform(random), t = uniform(random);
      if (s + t > 1.0) s = 1.0 - s, t = 1.0 - t;
      const Vec3 p =
          (1 - s - t) * d.model.mesh.vertices[v[0]] + s * d.model.mesh.vertices[v[1]] + t * d.model.mesh.vertices[v[2]];
      double nearest = 1e9;
      for (const LeafSite& leaf : leaves) {
        const Vec3 offset = leaf.position - p;
        nearest = std::min(nearest, (offset - offset.dot(direction) * direction).norm());
      }
      farthest = std::max(farthest, nearest);
    }
  }
  EXPECT_LT(farthest, spacing * 1.1);  // the lattice of samples adds up to half its step
  EXPECT_GT(farthest, spacing * 0.7) << "far more leaves than needed";
}

TEST(PlaceLeaves, LeavesDoNotHangOnTheTriangles) {
  const Vec3 slope(0.01, 0.002, 0.05);
  const SupportDomain coarse = floating_slab(slope), fine = floating_slab(slope, 2);
  const auto a = place_leaves(coarse.model, coarse.field, coarse.overhang, 1.2);
  const auto b = place_leaves(fine.model, fine.field, fine.overhang, 1.2);
  ASSERT_EQ(a.size(), b.size());
  for (const LeafSite& leaf : a) {
    EXPECT_TRUE(std::any_of(b.begin(), b.end(), [&](const LeafSite& l) { return (l.position - leaf.position).norm() < 0.01; }))
        << leaf.position.transpose();
  }
  // A hexagonal lattice needs an area of 3 sqrt(3) / 2 spacings squared a leaf, and its borders twice as many leaves.
  EXPECT_LT(static_cast<double>(a.size()), 240.0 / (1.5 * std::numbers::sqrt3 * 1.44) + 64.0 / 1.2);
}

TEST(PlaceLeaves, SpacingZeroIsEveryOverhangVertex) {
  const SupportDomain d = floating_slab();
  const auto leaves = place_leaves(d.model, d.field, d.overhang, 0.0);
  ASSERT_EQ(leaves.size(), d.overhang.vertices.size());
  for (std::size_t i = 0; i < leaves.size(); ++i) EXPECT_EQ(leaves[i].vertex, d.overhang.vertices[i]);
}

// A point or an edge that hangs down touches no overhang face; the overhang names its vertices.
TEST(GrowSkeleton, MinimaGetALeafEach) {
  const Vec3 slope(0.012, -0.006, 0.05);
  SupportDomain d = floating_slab(slope);
  const Overhang whole = d.overhang;
  d.overhang = {};
  for (const std::size_t i : {0, 20, 40}) {
    d.overhang.minima.push_back(whole.vertices[i]);
    d.overhang.minimum_direction.push_back(-slope.normalized());
  }
  const SkeletonResult r = grow(d, {.merge_radius_mm = 0.1});
  expect_all_checks(r.report);
  ASSERT_EQ(r.report.leaves, 3);
  EXPECT_EQ(r.report.points_added, 0);
  EXPECT_EQ(r.report.platform_ends, 3);
  for (const Index v : d.overhang.minima) {
    EXPECT_TRUE(std::any_of(r.skeleton.nodes.begin(), r.skeleton.nodes.end(), [&](const SkeletonNode& n) {
      return n.kind == NodeKind::leaf && n.position == d.model.mesh.vertices[v];
    }));
  }
}

TEST(GrowSkeleton, SlabStandsOnThePlatform) {
  for (const Vec3& slope : {Vec3(0, 0, 0.05), Vec3(0.012, -0.006, 0.05)}) {
    const SupportDomain d = floating_slab(slope);
    const SkeletonResult r = grow(d);
    expect_all_checks(r.report);
    EXPECT_GT(r.report.leaves, 60);
    EXPECT_TRUE(r.report.dropped.empty());
    EXPECT_EQ(r.report.model_ends, 0);
    EXPECT_LT(r.report.platform_ends, 25) << "branches merge";
    EXPECT_GT(r.report.platform_ends, 1);
    EXPECT_LE(r.report.max_edge_angle_deg, 45.0 + 1e-6);
  }
}

// Independent of the program's own checks: counts, order, layers and angles straight from the result.
TEST(GrowSkeleton, IsAForestWhoseCountsAddUp) {
  const SupportDomain d = floating_slab(Vec3(0.012, -0.006, 0.05));
  const Skeleton s = grow(d).skeleton;
  std::vector<Index> in(s.nodes.size(), 0), out(s.nodes.size(), 0);
  for (const SkeletonEdge& e : s.edges) {
    EXPECT_LT(e.upper, e.lower);
    EXPECT_EQ(e.branch_count, s.nodes[e.upper].kind == NodeKind::leaf ? 1 : in[e.upper]);
    in[e.lower] += e.branch_count;
    ++out[e.upper];
    const Vec3 down = s.nodes[e.lower].position - s.nodes[e.upper].position;
    EXPECT_LE(angle_between(down, -Vec3(0.012, -0.006, 0.05)) * 57.29578, 45.0001);
    EXPECT_NEAR(e.radius_mm, std::min(6.0, 0.8 * std::sqrt(e.branch_count)), 1e-12);
  }
  for (std::size_t n = 0; n < s.nodes.size(); ++n) {
    const bool end = s.nodes[n].kind == NodeKind::platform_end;
    EXPECT_EQ(out[n], end ? 0 : 1);
    if (s.nodes[n].kind == NodeKind::node) {
      EXPECT_NEAR(Vec3(0.012, -0.006, 0.05).dot(s.nodes[n].position), (s.nodes[n].layer + 0.5) / kCount, 1e-12);
    }
  }
}

TEST(GrowSkeleton, FollowerTurnsByTheAngleUntilItMerges) {
  const SupportDomain d = two_cubes();
  const SkeletonResult r = grow(d, {.leaf_spacing_mm = 2.0});
  expect_all_checks(r.report);
  ASSERT_EQ(r.report.leaves, 2);
  ASSERT_EQ(r.report.platform_ends, 1);
  EXPECT_EQ(r.report.max_branch_count, 2);
  // The follower comes nearer by one thickness a layer; the host's path is straight down.
  const Skeleton& s = r.skeleton;
  const double gap = (s.nodes[0].position - s.nodes[1].position).norm();
  double merged_at = 0.0;
  int turned = 0;
  for (const SkeletonEdge& e : s.edges) {
    const Vec3 down = s.nodes[e.lower].position - s.nodes[e.upper].position;
    const double across = std::hypot(down.x(), down.y());
    if (e.branch_count == 2) merged_at = std::max(merged_at, s.nodes[e.upper].position.z());
    if (across > 1e-9 && std::abs(across - kThickness) < 1e-9) ++turned;
    EXPECT_TRUE(across < 1e-9 || across <= kThickness + 1e-9);
  }
  EXPECT_NEAR(turned, gap / kThickness, 1.01);
  const double first_layer = s.nodes[s.edges[0].lower].position.z();
  EXPECT_NEAR(merged_at, first_layer - std::ceil(gap / kThickness) * kThickness, kThickness + 1e-9);
}

TEST(GrowSkeleton, BeyondTheMergeRadiusBranchesStayApart) {
  const SkeletonResult r = grow(two_cubes(), {.leaf_spacing_mm = 2.0, .merge_radius_mm = 2.5});
  EXPECT_EQ(r.report.platform_ends, 2);
  EXPECT_EQ(r.report.max_branch_count, 1);
}

TEST(GrowSkeleton, StandsOnTheModelBelowUnlessForbidden) {
  const SupportDomain d = slab_over_plate();
  const SkeletonResult allowed = grow(d);
  expect_all_checks(allowed.report);
  EXPECT_GT(allowed.report.model_ends, 0);
  EXPECT_GT(allowed.report.platform_ends, 0) << "the plate's own underside";
  for (const SkeletonNode& n : allowed.skeleton.nodes) {
    if (n.kind == NodeKind::model_end) {
      EXPECT_NEAR(n.position.z(), 4.0, 1e-9);
    } else if (n.kind == NodeKind::platform_end) {
      EXPECT_EQ(n.position.z(), 0.0);
    }
  }
  const SkeletonResult forbidden = grow(d, {.model_contact = ModelContact::forbidden});
  expect_all_checks(forbidden.report);
  EXPECT_EQ(forbidden.report.model_ends, 0);
  EXPECT_FALSE(forbidden.report.dropped.empty());
  EXPECT_EQ(forbidden.report.leaves + static_cast<Index>(forbidden.report.dropped.size()),
            allowed.report.leaves + static_cast<Index>(allowed.report.dropped.size()));
}

// A slab [8,16] x [4,8] x [16,18] over a bar of that width, up to z = 8.
SupportDomain slab_over_bar(double width) {
  return support_domain(
      {0, 0, -2}, {24, 12, 20}, {48, 6, 11},
      [=](const Vec3& c) {
        return c.y() > 4 && c.y() < 8 && ((c.x() > 8 && c.x() < 16 && c.z() > 16 && c.z() < 18) ||
                                          (c.x() > 12 - width / 2 && c.x() < 12 + width / 2 && c.z() > 6 && c.z() < 8));
      },
      [](const Vec3& p) { return p.z() / 20; });
}

TEST(GrowSkeleton, GoesRoundTheModelWhereThePlatformIsPreferred) {
  const SupportDomain d = slab_over_bar(2.0);
  const SkeletonResult allowed = grow(d, {.merge_radius_mm = 0.1});
  const SkeletonResult preferred =
      grow(d, {.merge_radius_mm = 0.1, .model_contact = ModelContact::prefer_platform});
  expect_all_checks(allowed.report);
  expect_all_checks(preferred.report);
  EXPECT_GT(allowed.report.model_ends, 0);
  EXPECT_LT(preferred.report.model_ends, allowed.report.model_ends);
  EXPECT_EQ(preferred.report.leaves, allowed.report.leaves) << "none is given up";
}

TEST(GrowSkeleton, NothingStandsOnABarThatIsTooThin) {
  const SkeletonOptions lone{.merge_radius_mm = 0.1};
  EXPECT_GT(grow(slab_over_bar(2.0), lone).report.model_ends, 0);
  EXPECT_EQ(grow(slab_over_bar(1.0), {.leaf_radius_mm = 2.0, .merge_radius_mm = 0.1}).report.model_ends, 0);
}

TEST(GrowSkeleton, AWallKeepsBranchesApart) {
  const SupportDomain d = support_domain(
      {0, 0, -1}, {15, 11, 12}, {15, 11, 13},
      [](const Vec3& c) {
        const bool cube = std::abs(c.y() - 5.5) < 0.1 && std::abs(c.z() - 10.5) < 0.1 &&
                          (std::abs(c.x() - 5.5) < 0.1 || std::abs(c.x() - 9.5) < 0.1);
        return cube || (std::abs(c.x() - 7.5) < 0.1 && c.z() > 0 && c.z() < 11);
      },
      [](const Vec3& p) { return p.z() / 20; });
  const SkeletonResult r = grow(d, {.leaf_spacing_mm = 2.0});
  expect_all_checks(r.report);
  EXPECT_EQ(r.report.platform_ends, 2);
  for (const SkeletonEdge& e : r.skeleton.edges) {
    const Vec3 down = r.skeleton.nodes[e.lower].position - r.skeleton.nodes[e.upper].position;
    EXPECT_LT(std::hypot(down.x(), down.y()), 1e-9) << "drawn to what it cannot see";
  }
}

TEST(GrowSkeleton, HostsDropAlongTheNormalOrStraightDown) {
  const Vec3 slope(0.012, -0.006, 0.05);  // 15 degrees from the vertical
  const SupportDomain d = floating_slab(slope);
  for (const HostDirection wanted : {HostDirection::normal, HostDirection::down}) {
    const SkeletonResult r = grow(d, {.merge_radius_mm = 0.1, .host_direction = wanted});
    expect_all_checks(r.report);
    const Vec3 along = wanted == HostDirection::down ? Vec3(-Vec3::UnitZ()) : Vec3(-slope.normalized());
    int hosts = 0;
    for (const SkeletonEdge& e : r.skeleton.edges) {
      if (r.skeleton.nodes[e.upper].kind == NodeKind::leaf) continue;
      const Vec3 way = r.skeleton.nodes[e.lower].position - r.skeleton.nodes[e.upper].position;
      EXPECT_LT(angle_between(way, along), 1e-6);
      ++hosts;
    }
    EXPECT_GT(hosts, 500);
  }
}

// A slab that reaches out from a post whose side x = 10 is a wall with n . d_p = rise; branches lead towards it.
SupportDomain slab_on_post(double rise) {
  return support_domain(
      {0, 0, -2}, {32, 16, 18}, {16, 8, 20},
      [](const Vec3& c) {
        return c.y() > 4 && c.y() < 12 && c.z() < 16 && c.z() > 0 && (c.x() > 4 && (c.x() < 10 || (c.x() < 16 && c.z() > 14)));
      },
      [=](const Vec3& p) { return Vec3(rise, 0, std::sqrt(1.0 - rise * rise)).dot(p) / 20; });
}

TEST(GrowSkeleton, WallsAreLeftByTheSideAndSlopesStoodOn) {
  const auto ends_on_post = [](double rise) {
    const SkeletonResult r = grow(slab_on_post(rise));
    expect_all_checks(r.report);
    EXPECT_GT(r.report.leaves, 10);
    return r.report.model_ends;
  };
  EXPECT_EQ(ends_on_post(0.32), 0);
  EXPECT_GT(ends_on_post(0.4), 0);
}

TEST(StandAngle, SteepFacesAndTrunksThatLeanOutGetSlenderCones) {
  const auto angle = [](double rise, double lean) {
    return stand_angle({std::sqrt(1.0 - rise * rise), 0, rise}, Vec3::UnitZ(), {std::sin(lean), 0, std::cos(lean)});
  };
  EXPECT_NEAR(angle(1.0, 0.3), std::numbers::pi / 4, 1e-12);
  EXPECT_NEAR(angle(0.9, 0.0), std::numbers::pi / 4, 1e-12);
  const double recess = 0.3 / std::sqrt(0.91);
  EXPECT_NEAR(angle(0.3, 0.0), std::atan(1.2 * recess), 1e-12);
  EXPECT_NEAR(angle(0.3, 0.2), std::atan(1.2 * recess) - 0.2, 1e-12);
  EXPECT_LT(angle(0.3, 0.4), kSlenderestStand) << "hangs on the wall by its side";
}

TEST(GrowSkeleton, GapUnderOneLayerIsListedAsDropped) {
  // A gap of 0.4 mm between two plates, layers of 0.5 mm: the upper plate's underside can have no branch of a full
  // layer.
  const SupportDomain d = support_domain(
      {0, 0, -2}, {12, 12, 10}, {12, 12, 30},
      [](const Vec3& c) {
        return c.x() > 2 && c.x() < 10 && c.y() > 2 && c.y() < 10 && c.z() > 4 && c.z() < 8 &&
               !(c.z() > 6.0 && c.z() < 6.4);
      },
      [](const Vec3& p) { return p.z() / 20; });
  const SkeletonResult r = grow(d);
  expect_all_checks(r.report);
  Index in_gap = 0;
  for (const DroppedLeaf& leaf : r.report.dropped) {
    EXPECT_NEAR(leaf.position.z(), 6.4, 1e-9);
    EXPECT_FALSE(leaf.reason.empty());
    ++in_gap;
  }
  EXPECT_GT(in_gap, 10);
  EXPECT_EQ(r.report.model_ends, 0);
}

TEST(GrowSkeleton, RadiusOptions) {
  const SupportDomain d = floating_slab();
  const SkeletonOptions options{.max_radius_mm = 3.0, .min_trunk_radius_mm = 2.0, .thickening_per_mm = 0.05};
  double largest = 0.0;
  for (const SkeletonEdge& e : grow(d, options).skeleton.edges) {
    EXPECT_LE(e.radius_mm, 3.0);
    EXPECT_TRUE(e.branch_count == 1 || e.radius_mm >= 2.0);
    EXPECT_GE(e.radius_mm, std::min(3.0, 0.8 * std::sqrt(e.branch_count)) - 1e-12);
    largest = std::max(largest, e.radius_mm);
  }
  EXPECT_EQ(largest, 3.0);
}

TEST(GrowSkeleton, NoOverhangIsAnEmptySkeleton) {
  SupportDomain d = floating_slab();
  d.overhang = {};
  const SkeletonResult r = grow(d);
  EXPECT_TRUE(r.skeleton.nodes.empty());
  expect_all_checks(r.report);
}

TEST(GrowSkeleton, ContradictionsNameBothKeys) {
  const SupportDomain d = two_cubes();
  try {
    (void)grow(d, {.leaf_radius_mm = 0.3, .bead_width_mm = 0.8});
    FAIL() << "accepted a strut that holds no bead";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(e.what()).find("leaf_radius_mm"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("bead_width_mm"), std::string::npos);
  }
  EXPECT_THROW((void)grow(d, {.leaf_radius_mm = 2.0, .max_radius_mm = 1.0}), Error);
}

}  // namespace
}  // namespace curvesup
