#include "motion/deposit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "helpers/toolpath_shapes.h"
#include "motion/arm_path.h"

namespace curvesup {
namespace {

// The head's profile as many small steps: nearest of dense boundary samples, sign by the definition of the solid.
double sampled_distance(const Tool& tool, double height, double radius) {
  const double slope = tool.cone_half_angle.tan(), cone_end = tool.tip_radius_mm + slope * tool.cone_length_mm;
  double nearest = 1e300;
  const auto side = [&](double h0, double r0, double h1, double r1) {
    for (int i = 0; i <= 20000; ++i) {
      const double t = i / 20000.0;
      nearest = std::min(nearest, std::hypot(height - h0 - t * (h1 - h0), radius - r0 - t * (r1 - r0)));
    }
  };
  side(0, 0, 0, tool.tip_radius_mm);
  side(0, tool.tip_radius_mm, tool.cone_length_mm, cone_end);
  side(tool.cone_length_mm, cone_end, tool.cone_length_mm, tool.head_radius_mm);
  side(tool.cone_length_mm, tool.head_radius_mm, tool.head_length_mm, tool.head_radius_mm);
  side(tool.head_length_mm, tool.head_radius_mm, tool.head_length_mm, 0);
  const bool in_cone = height >= 0 && height <= tool.cone_length_mm && radius <= tool.tip_radius_mm + slope * height;
  const bool in_head = height >= tool.cone_length_mm && height <= tool.head_length_mm && radius <= tool.head_radius_mm;
  return in_cone || in_head ? -nearest : nearest;
}

TEST(HeadShape, DistanceMatchesDenselySampledProfile) {
  const Tool tool;
  const HeadShape head(tool);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> height(-40, 300), radius(0, 90), near(0, 3);
  for (int trial = 0; trial < 100; ++trial) {
    const double h = trial % 2 ? height(random) : near(random), r = trial % 2 ? radius(random) : near(random);
    EXPECT_NEAR(head.distance(h, r), sampled_distance(tool, h, r), 0.02) << h << " " << r;
    EXPECT_LE(head.distance_bound(h, r), head.distance(h, r) + 1e-12) << h << " " << r;
  }
}

TEST(HeadShape, LowestPointOfATiltedHead) {
  const Tool tool;
  const HeadShape head(tool);
  EXPECT_NEAR(head.lowest_z(Vec3(0, 0, 5), Vec3::UnitZ(), 1.0), 6.0, 1e-12);
  const Vec3 level = Vec3::UnitX();  // lying down: the cylinder's side is lowest
  EXPECT_NEAR(head.lowest_z(Vec3(0, 0, 50), level, 1.0), 50.0 - tool.head_radius_mm, 1e-12);
}

struct Scene {
  Toolpaths toolpaths;
  std::vector<Vec3> tips;
  Deposit deposit;
};

Scene random_scene() {
  Scene scene;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-30, 30), up(0, 20);
  for (int p = 0; p < 40; ++p) {
    std::vector<Vec3> positions, normals;
    for (int i = 0; i < 20; ++i) {
      positions.push_back(Vec3(at(random), at(random), up(random)));
      normals.push_back(Vec3::UnitZ());
    }
    shapes::add_path(scene.toolpaths, positions, normals, p);
  }
  for (const PathPoint& point : scene.toolpaths.points)
    scene.tips.push_back(point.position + point.tip_offset_mm * point.normal);
  scene.deposit =
      Deposit(scene.toolpaths.paths, scene.toolpaths.points, scene.tips, 1e6);  // samples are the tips themselves
  return scene;
}

TEST(Deposit, HeadContactMatchesBruteForceAtEveryMoment) {
  const Scene scene = random_scene();
  Tool tool;
  tool.cone_length_mm = 15;
  tool.head_radius_mm = 12;
  const HeadShape head(tool);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(-35, 35), tilt(-1, 1);
  int touching = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 tip(at(random), at(random), 0.4 * at(random) + 14);
    const Vec3 axis = Vec3(tilt(random), tilt(random), 1.0).normalized();
    const Index before = static_cast<Index>(random() % scene.tips.size());
    const double free = 0.5, clearance = 0.2;
    bool expected = false;
    for (Index i = 0; i < before; ++i) {
      const double height = (scene.tips[i] - tip).dot(axis);
      expected = expected || (height > free && head.distance(scene.tips[i], tip, axis) < clearance);
    }
    Contact contact;
    ASSERT_EQ(scene.deposit.touches_head(head, tip, axis, free, clearance, before, &contact), expected) << trial;
    if (expected) {
      ++touching;
      EXPECT_LT(contact.point, before);
      EXPECT_NEAR(contact.depth_mm, clearance - head.distance(contact.position, tip, axis), 1e-9);
    }
  }
  EXPECT_GT(touching, 100);
  EXPECT_LT(touching, 1900);
}

TEST(Deposit, PosesTogetherTouchAsEachByItself) {
  const Scene scene = random_scene();
  Tool tool;
  tool.cone_length_mm = 15;
  tool.head_radius_mm = 12;
  const HeadShape head(tool);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> at(-35, 35), tilt(-1, 1), step(-0.4, 0.4), turn(-0.03, 0.03);
  int touching = 0, of = 0;
  for (int run = 0; run < 200; ++run) {
    std::vector<Deposit::HeadPose> poses;
    Vec3 tip(at(random), at(random), 0.4 * at(random) + 18), axis = Vec3(tilt(random), tilt(random), 1.0).normalized();
    for (int i = 0; i < 40; ++i) {
      tip += Vec3(step(random), step(random), step(random));
      axis = (axis + Vec3(turn(random), turn(random), turn(random))).normalized();
      poses.push_back({tip, axis, 0.3 + 0.2 * (i % 3), static_cast<Index>(random() % scene.tips.size())});
    }
    std::vector<char> touches(poses.size(), 2);
    scene.deposit.touches_head(head, poses, 0.2, touches);
    for (std::size_t i = 0; i < poses.size(); ++i, ++of) {
      const bool expected =
          scene.deposit.touches_head(head, poses[i].tip, poses[i].axis, poses[i].free_height, 0.2, poses[i].before);
      ASSERT_EQ(touches[i], expected) << run << " " << i;
      touching += expected;
    }
  }
  EXPECT_GT(touching, of / 10);
  EXPECT_LT(touching, of * 9 / 10);
}

// Steep bowls of lines upon each other, with a spike here and there; normals lean off by much on every third line.
Scene bowl_scene() {
  Scene scene;
  std::mt19937 random(17);
  for (int layer = 0; layer < 12; ++layer) {
    for (int line = -10; line <= 10; ++line) {
      std::vector<Vec3> positions, normals;
      for (int i = -20; i <= 20; ++i) {
        const double x = 0.5 * i, y = 0.8 * line, spike = random() % 12 == 0 ? 1.0 : 0.0;
        positions.push_back(Vec3(x, y, 0.3 * layer + 0.8 * x + 0.02 * (x * x + y * y) + spike));
        normals.push_back(Vec3(-0.8 - 0.04 * x + (line % 3 == 0 ? 1.5 : 0.0), -0.04 * y, 1.0).normalized());
      }
      shapes::add_path(scene.toolpaths, positions, normals, layer);
    }
  }
  for (const PathPoint& point : scene.toolpaths.points)
    scene.tips.push_back(point.position + point.tip_offset_mm * point.normal);
  scene.deposit = Deposit(scene.toolpaths.paths, scene.toolpaths.points, scene.tips, 1e6);
  return scene;
}

// Poses that touch little, some, and more than is looked at together: gaps are those of every sample by itself.
TEST(Deposit, GapsOfPosesTogetherMatchBruteForce) {
  const Scene scene = bowl_scene();
  // Samples have single precision; so that none is on the other side of the free height for it. They are kept: g++ 12 drops
  // a conversion to float and back within one expression.
  std::vector<Eigen::Vector3f> laid;
  for (const Vec3& tip : scene.tips) laid.push_back(tip.cast<float>());
  const HeadShape head{Tool{}};
  std::mt19937 random(13);
  std::uniform_real_distribution<double> tilt(-0.1, 0.1), shift(-0.5, 0.5), lower(0.0, 1.5), lean(-0.6, 0.6);
  int far = 0, tight = 0, inside = 0;
  for (int trial = 0; trial < 150; ++trial) {
    const std::size_t at = random() % scene.tips.size();
    const Vec3 axis = (scene.toolpaths.points[at].normal + Vec3(lean(random), lean(random), 0.0)).normalized();
    std::vector<Deposit::HeadPose> poses;
    for (int i = 0; i < 12; ++i) {
      const Vec3 tip = scene.tips[at] + Vec3(shift(random), shift(random), trial % 3 == 0 ? -lower(random) : 0.0);
      poses.push_back({tip, (axis + Vec3(tilt(random), tilt(random), 0.0)).normalized(), 0.3,
                       static_cast<Index>(i % 3 == 0 ? random() % (at + 1) : at)});
    }
    std::vector<double> gaps(poses.size());
    scene.deposit.head_gaps(head, poses, 0.4, gaps);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const Deposit::HeadPose& pose = poses[i];
      double expected = 0.4;
      for (std::size_t s = 0; s < static_cast<std::size_t>(pose.before); ++s) {
        const Vec3 sample = laid[s].cast<double>();
        if ((sample - pose.tip).dot(pose.axis) <= pose.free_height) continue;
        expected = std::min(expected, head.distance(sample, pose.tip, pose.axis));
      }
      ASSERT_NEAR(gaps[i], expected, 1e-9) << trial << " " << i;
      EXPECT_NEAR(scene.deposit.head_gap(head, pose.tip, pose.axis, pose.free_height, 0.4, pose.before), expected, 1e-9);
      ++(expected >= 0.4 ? far : expected >= 0.0 ? tight : inside);
    }
  }
  EXPECT_GT(far, 100);
  EXPECT_GT(tight, 10);
  EXPECT_GT(inside, 100);
}

// Parts that are put behind each other are one deposit: contacts have the points of the whole.
TEST(Deposit, PartsAppendedAnswerAsTheWhole) {
  const Scene scene = random_scene();
  const auto points = std::span(scene.toolpaths.points);
  const auto tips = std::span(scene.tips);
  Deposit joined(1e6);
  for (std::size_t begin = 0; begin < scene.toolpaths.paths.size(); begin += 7) {
    Deposit part(1e6);
    for (std::size_t p = begin; p < std::min(begin + 7, scene.toolpaths.paths.size()); ++p) {
      const Path& path = scene.toolpaths.paths[p];
      const auto first = static_cast<std::size_t>(path.first_point), count = static_cast<std::size_t>(path.point_count);
      part.add_path(points.subspan(first, count), tips.subspan(first, count));
    }
    joined.append(std::move(part));
  }
  joined.finish();
  ASSERT_EQ(joined.size(), scene.deposit.size());
  const HeadShape head{Tool{}};
  for (Index before = 0; before < static_cast<Index>(scene.tips.size()); before += 9) {
    const Vec3 tip(0.02 * before - 8.0, 3.0, 12.0);
    Contact contact, expected;
    const bool touches = scene.deposit.touches_head(head, tip, Vec3::UnitZ(), 0.5, 0.2, before, &expected);
    ASSERT_EQ(joined.touches_head(head, tip, Vec3::UnitZ(), 0.5, 0.2, before, &contact), touches);
    EXPECT_EQ(contact.point, expected.point);
    EXPECT_EQ(joined.top_before(before), scene.deposit.top_before(before));
  }
}

TEST(Deposit, CapsuleContactMatchesBruteForce) {
  const Scene scene = random_scene();
  std::mt19937 random(9);
  std::uniform_real_distribution<double> at(-40, 40);
  int touching = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec3 a(at(random), at(random), at(random)), b(at(random), at(random), at(random));
    const Index before = static_cast<Index>(random() % scene.tips.size());
    bool expected = false;
    for (Index i = 0; i < before; ++i) {
      const double t = std::clamp((scene.tips[i] - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      expected = expected || (scene.tips[i] - a - t * (b - a)).norm() < 4.5;
    }
    EXPECT_EQ(scene.deposit.touches_capsule(a, b, 4.0, 0.5, before), expected);
    touching += expected;
  }
  EXPECT_GT(touching, 100);
  EXPECT_LT(touching, 900);
}

TEST(Deposit, TopGrowsWithThePrint) {
  const Toolpaths toolpaths = shapes::flat_rings(5.0, 3);
  std::vector<Vec3> tips;
  for (const PathPoint& point : toolpaths.points) tips.push_back(point.position + point.tip_offset_mm * point.normal);
  const Deposit deposit(toolpaths.paths, toolpaths.points, tips, 1.0);
  EXPECT_NEAR(deposit.top_before(static_cast<Index>(tips.size())), 1.8, 1e-12);
  EXPECT_NEAR(deposit.top_before(1), 0.6, 1e-12);
}

TEST(Links, CapsulesOfSeveralPosturesHoldThoseOfEach) {
  const Machine machine;
  const Cell cell(machine);
  PostureBoxes boxes;
  std::vector<Joints> all;
  for (int i = 0; i < 20; ++i) {
    Posture posture;
    const Vec3 tip(-20.0 + 2.0 * i, 10.0, 30.0), axis = Vec3(0.01 * i, -0.1, 1.0).normalized();
    if (cell.solve(tip, axis, 0.05 * i, 0, posture) == ArmFault::reach) continue;
    boxes.add(posture);
    all.push_back(posture.joints);
  }
  ASSERT_GT(all.size(), 10u);
  const auto around = cell.links(boxes);
  double spare = 1e300;
  for (const Joints& joints : all) {
    const auto links = cell.links(joints);
    for (std::size_t l = 0; l < links.size(); ++l) {
      const Vec3 along = around[l].b - around[l].a;
      for (const double share : {0.0, 0.3, 0.7, 1.0}) {
        const Vec3 at = (1.0 - share) * links[l].a + share * links[l].b;
        const double t = std::clamp((at - around[l].a).dot(along) / along.squaredNorm(), 0.0, 1.0);
        spare = std::min(spare, around[l].radius - links[l].radius - (at - around[l].a - t * along).norm());
      }
    }
  }
  EXPECT_GE(spare, -1e-6);
  EXPECT_LT(spare, 30.0);
}

// Every sample's distance from every capsule, one by one.
TEST(TouchingLink, AgreesWithBruteForceAndNamesTheLink) {
  const Machine machine;
  const Cell cell(machine);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> turn(-0.5, 0.5), shift(-90.0, 90.0);
  int touched = 0, free = 0, forearm = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Joints joints = radians(machine.stations.home_deg);
    for (double& joint : joints) joint += turn(random);
    const auto links = cell.links(joints);
    // A bead of two points, near the middle of a link.
    const Cell::Capsule& near = links[static_cast<std::size_t>(trial) % links.size()];
    const Vec3 at = 0.5 * (near.a + near.b) + Vec3(shift(random), shift(random), shift(random));
    Toolpaths toolpaths;
    shapes::add_path(toolpaths, {at, at + Vec3(0.5, 0.0, 0.0)}, {Vec3::UnitZ(), Vec3::UnitZ()}, 0);
    std::vector<Vec3> tips;
    for (const PathPoint& point : toolpaths.points) tips.push_back(point.position + point.tip_offset_mm * point.normal);
    const Deposit deposit(toolpaths.paths, toolpaths.points, tips, 1.0);
    double gap = 1e300;
    std::string nearest;
    for (const Cell::Capsule& link : links) {
      for (const Vec3& tip : tips) {
        const Vec3 along = link.b - link.a;
        const double t = std::clamp((tip - link.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
        const double distance = (tip - link.a - t * along).norm() - link.radius;
        if (distance < gap) gap = distance, nearest = link.name;
      }
    }
    if (std::abs(gap - 5.0) < 1e-3) continue;
    const char* link = touching_link(cell, deposit, joints, 2, 5.0);
    EXPECT_EQ(link != nullptr, gap < 5.0) << gap;
    EXPECT_EQ(touching_link(cell, deposit, joints, 0, 5.0), nullptr);  // nothing is laid yet
    (link ? touched : free) += 1;
    forearm += link && std::string(link) == "forearm";
  }
  EXPECT_GT(touched, 30);
  EXPECT_GT(free, 30);
  EXPECT_GT(forearm, 10);
}

TEST(Deposit, ReorderedPathsAreLaidInTheNewOrder) {
  Scene scene = random_scene();
  const std::size_t count = scene.toolpaths.paths.size();
  ASSERT_GT(count, 3u);
  const std::vector<Index> order = {2, 0, 1};  // paths 1, 2, 3 become 3, 1, 2
  Toolpaths moved = scene.toolpaths;
  std::vector<Index> whole(count);
  for (std::size_t i = 0; i < count; ++i) whole[i] = static_cast<Index>(i);
  for (std::size_t i = 0; i < 3; ++i) whole[1 + i] = 1 + order[i];
  reorder_paths(moved, whole);
  std::vector<Vec3> tips;
  for (const PathPoint& point : moved.points) tips.push_back(point.position + point.tip_offset_mm * point.normal);
  const Deposit anew(moved.paths, moved.points, tips, 1.0);
  Deposit turned(scene.toolpaths.paths, scene.toolpaths.points, scene.tips, 1.0);
  turned.reorder(1, order);
  const HeadShape head{Tool{}};
  for (Index before = 0; before < static_cast<Index>(moved.points.size()); before += 7) {
    EXPECT_EQ(turned.top_before(before), anew.top_before(before));
    const Vec3 tip = tips[static_cast<std::size_t>(before)];
    EXPECT_EQ(turned.touches_head(head, tip, Vec3::UnitZ(), 0.3, 0.2, before), anew.touches_head(head, tip, Vec3::UnitZ(), 0.3, 0.2, before));
  }
}

}  // namespace
}  // namespace curvesup
