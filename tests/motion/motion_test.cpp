#include "curvesup/motion/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "curvesup/motion/kinematics.h"
#include "helpers/toolpath_shapes.h"
#include "motion/arm_path.h"

namespace curvesup {
namespace {

const Check& find(const MotionReport& report, const std::string& name) {
  for (const Check& check : report.checks) {
    if (check.name == name) return check;
  }
  ADD_FAILURE() << "no check " << name;
  static const Check none;
  return none;
}

void expect_all_checks(const MotionReport& report) {
  for (const Check& check : report.checks)
    EXPECT_TRUE(check.ok) << check.name << " = " << check.value << ": " << check.detail;
}

double distance_to_polyline(const Vec3& point, const std::vector<Vec3>& line) {
  double nearest = 1e300;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Vec3 along = line[i] - line[i - 1];
    const double t = std::clamp((point - line[i - 1]).dot(along) / std::max(1e-300, along.squaredNorm()), 0.0, 1.0);
    nearest = std::min(nearest, (point - line[i - 1] - t * along).norm());
  }
  return nearest;
}

// Recomputes from the waypoints alone what the programs rely on.
void expect_sound(const Toolpaths& toolpaths, const Machine& machine, const MotionResult& result) {
  const Motion& motion = result.motion;
  const Tolerances& tolerances = machine.tolerances;
  Index path = -1;
  for (const PathMotion& chain : motion.paths) {
    EXPECT_TRUE(chain.path == path || chain.path == path + 1);
    path = chain.path;
    ASSERT_GT(chain.travel_count, 0);
    const Travel& arrival = motion.travels[chain.first_travel + chain.travel_count - 1];
    const Waypoint& start = motion.waypoints[chain.first_waypoint];
    EXPECT_LT((arrival.pose.position_m - start.pose.position_m).norm(), 1e-9);
    EXPECT_LT(largest_joint_step(arrival.joints, start.joints), 1e-9);
    double volume = 0.0;
    for (Index w = chain.first_waypoint; w < chain.first_waypoint + chain.waypoint_count; ++w) {
      const Waypoint& point = motion.waypoints[w];
      const Frame reached = forward_kinematics(machine.arm, point.joints) * to_frame(machine.tool.tcp);
      EXPECT_LT((reached.translation() - point.pose.position_m).norm(), 1e-6);
      EXPECT_LT((reached.linear() - rotation_of(point.pose.rotation_vector)).norm(), 1e-6);
      EXPECT_LT((reached.linear().col(2) - point.axis).norm(), 1e-6);  // the platform is not turned in these tests
      volume += point.volume_mm3;
      if (w == chain.first_waypoint) continue;
      const Waypoint& before = motion.waypoints[w - 1];
      const double length = (point.tip_mm - before.tip_mm).norm();
      EXPECT_GE(length, 0.999 * tolerances.min_segment_mm);
      EXPECT_LT(point.blend_mm + before.blend_mm, length);
      EXPECT_TRUE(point.blend_mm == 0.0 || point.blend_mm >= 0.1);
      EXPECT_GT(point.duration_s, 0.0);
      const double turn = (point.pose.rotation_vector - before.pose.rotation_vector).norm();
      EXPECT_NEAR(point.speed_mm_s * point.duration_s, std::max(length, 1e3 * turn / machine.speeds.rotation_rad_per_m),
                  1e-5);  // as waypoints are kept
      const Eigen::AngleAxisd geodesic(
          Mat3(rotation_of(before.pose.rotation_vector).transpose() * rotation_of(point.pose.rotation_vector)));
      EXPECT_LE(turn, 1.6 * geodesic.angle() + 1e-3);
    }
    EXPECT_NEAR(volume, chain.volume_mm3, 1e-6 * chain.volume_mm3);
  }
  EXPECT_EQ(path + 1, static_cast<Index>(toolpaths.paths.size()));
  for (const PathMotion& chain : motion.paths) {
    const Path& source = toolpaths.paths[chain.path];
    if (chain.sections > 1) continue;
    std::vector<Vec3> line;
    for (Index w = chain.first_waypoint; w < chain.first_waypoint + chain.waypoint_count; ++w)
      line.push_back(motion.waypoints[w].tip_mm);
    double wanted = 0.0;
    for (Index i = source.first_point; i < source.first_point + source.point_count; ++i) {
      const PathPoint& point = toolpaths.points[i];
      EXPECT_LE(distance_to_polyline(point.position + point.tip_offset_mm * point.normal, line),
                tolerances.chord_mm + 1e-3);
      wanted += point.volume_mm3;
    }
    EXPECT_NEAR(chain.volume_mm3, wanted, 1e-9 * wanted);
  }
}

TEST(PlanMotion, FlatRings) {
  const Toolpaths toolpaths = shapes::flat_rings(20.0, 3);
  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  expect_sound(toolpaths, Machine{}, result);
  EXPECT_EQ(result.report.tilt_deviation_max_deg, 0.0);
  EXPECT_LT(result.report.waypoints, toolpaths.points.size());
  EXPECT_GT(result.report.travel_mm, 0.0);
}

TEST(PlanMotion, CapLeaningSixtyDegreesIsReachedEverywhere) {
  const Toolpaths toolpaths = shapes::cap_rings(60.0, 60.0 * std::numbers::pi / 180.0, 20.0);
  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  expect_sound(toolpaths, Machine{}, result);
  EXPECT_GT(result.report.max_tilt_deg, 55.0);
  EXPECT_GT(result.report.rotation_limited, 0u);
}

TEST(PlanMotion, OutOfReachIsReportedWithItsFirstPlace) {
  Toolpaths toolpaths = shapes::flat_rings(3.0, 1);
  for (PathPoint& point : toolpaths.points) point.position.x() += 600.0;
  const MotionResult result = plan_motion(toolpaths, Machine{});
  ASSERT_FALSE(result.report.unreachable.empty());
  EXPECT_EQ(result.report.unreachable.front().path, 0);
  EXPECT_FALSE(result.report.unreachable.front().reason.empty());
  EXPECT_FALSE(find(result.report, "motion.unreachable").ok);
}

// A wall printed earlier beside a bead: upright, the cone would cut into it.
Toolpaths bead_beside_wall(double wall_height, bool both_sides) {
  Toolpaths toolpaths;
  const std::vector<Vec3> up(41, Vec3::UnitZ());
  const auto row = [&](double y, double z, Index layer) {
    std::vector<Vec3> positions;
    for (int i = 0; i <= 40; ++i) positions.push_back(Vec3(i - 20.0, y, z));
    shapes::add_path(toolpaths, positions, up, layer);
  };
  for (int k = 0; 0.6 * k < wall_height; ++k) {
    row(4.0, 0.3 + 0.6 * k, k);
    if (both_sides) row(-4.0, 0.3 + 0.6 * k, k);
  }
  row(0.0, 20.3, 100);
  return toolpaths;
}

TEST(PlanMotion, NozzleTiltsAwayFromAWallAndNoMoreThanNeeded) {
  // The bead lies 20.6 mm up; the wall is 10 mm taller and 4 mm away: the 30 degree cone needs about 9 degrees.
  const Toolpaths toolpaths = bead_beside_wall(30.0, false);
  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  expect_sound(toolpaths, Machine{}, result);
  EXPECT_GT(result.report.tilt_deviation_max_deg, 5.0);
  EXPECT_LT(result.report.tilt_deviation_max_deg, 16.0);
  MotionOptions stiff;
  stiff.avoid_collisions = false;
  const MotionResult upright = plan_motion(toolpaths, Machine{}, stiff);
  EXPECT_GT(upright.report.colliding_waypoints, 0u);
  EXPECT_EQ(upright.report.tilt_deviation_max_deg, 0.0);
}

TEST(PlanMotion, TrenchTooNarrowIsReportedAsACollisionThatNamesWhatIsTouched) {
  const MotionResult result = plan_motion(bead_beside_wall(40.0, true), Machine{});
  ASSERT_FALSE(result.report.collisions.empty());
  EXPECT_NE(result.report.collisions.front().what.find("touches model of path"), std::string::npos);
  EXPECT_FALSE(find(result.report, "motion.collisions").ok);
  EXPECT_TRUE(result.report.unreachable.empty());
}

// A groove of three beads, its bottom laid last: no tilt within the allowed deviation clears both flanks.
Toolpaths groove(double flank = 1.4) {
  Toolpaths toolpaths;
  const std::vector<Vec3> up(21, Vec3::UnitZ());
  const auto row = [&](double y, double z) {
    std::vector<Vec3> positions;
    for (int i = 0; i <= 20; ++i) positions.push_back(Vec3(i - 10.0, y, z));
    shapes::add_path(toolpaths, positions, up, 0);
  };
  row(-20.0, 0.3);
  row(-0.75, flank);
  row(0.75, flank);
  row(0.0, 0.3);
  row(20.0, 0.3);
  return toolpaths;
}

TEST(PlanMotion, BottomOfAGrooveIsPrintedBeforeItsFlanks) {
  Toolpaths toolpaths = groove();
  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  EXPECT_EQ(result.path_order, (std::vector<Index>{0, 3, 1, 2, 4}));
  reorder_paths(toolpaths, result.path_order);
  expect_sound(toolpaths, Machine{}, result);
  EXPECT_EQ(toolpaths.points[toolpaths.paths[1].first_point].position, Vec3(-10, 0, 0.3));
  for (const PathMotion& chain : result.motion.paths) {
    const Waypoint start = result.motion.waypoints[chain.first_waypoint];
    EXPECT_EQ(start.point, toolpaths.paths[chain.path].first_point);
  }
  EXPECT_TRUE(plan_motion(toolpaths, Machine{}).path_order.empty());
}

TEST(PlanMotion, OnlyPathsOfOnePieceChangePlaces) {
  Toolpaths toolpaths = groove();
  toolpaths.paths[3].piece = toolpaths.paths[4].piece = 1;
  const MotionResult result = plan_motion(toolpaths, Machine{});
  EXPECT_TRUE(result.path_order.empty());
  EXPECT_FALSE(find(result.report, "motion.collisions").ok);
}

TEST(PlanMotion, NozzlePassesHigherWhereNeitherTiltNorOrderFreesIt) {
  // The flanks belong to another piece, and rise 0.1 mm above what is the bead's own.
  Toolpaths toolpaths = groove(1.0);
  toolpaths.paths[3].piece = toolpaths.paths[4].piece = 1;
  Machine level;
  level.tolerances.max_raise_mm = 0.0;
  const MotionResult touching = plan_motion(toolpaths, level);
  EXPECT_FALSE(find(touching.report, "motion.collisions").ok);
  EXPECT_TRUE(touching.raised.empty());

  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  EXPECT_TRUE(result.path_order.empty());
  EXPECT_EQ(result.raised.size(), 21u);
  EXPECT_GT(result.report.max_raise_mm, 0.05);
  EXPECT_LE(result.report.max_raise_mm, Machine{}.tolerances.max_raise_mm);
  for (const RaisedPoint& point : result.raised) {
    EXPECT_GE(point.point, toolpaths.paths[3].first_point);
    EXPECT_LT(point.point, toolpaths.paths[4].first_point);
  }
  const Waypoint start = result.motion.waypoints[result.motion.paths[3].first_waypoint];
  EXPECT_NEAR(start.tip_mm.z(), 0.6 + result.raised.front().raise_mm, 1e-6);
  raise_points(toolpaths, result.raised);
  expect_sound(toolpaths, Machine{}, result);
}

TEST(PlanMotion, NothingIsRaisedInVain) {
  // The flanks are higher than any raise clears.
  Toolpaths toolpaths = groove(1.4);
  toolpaths.paths[3].piece = toolpaths.paths[4].piece = 1;
  const MotionResult result = plan_motion(toolpaths, Machine{});
  EXPECT_FALSE(find(result.report, "motion.collisions").ok);
  EXPECT_TRUE(result.raised.empty());
  const Waypoint start = result.motion.waypoints[result.motion.paths[3].first_waypoint];
  EXPECT_NEAR(start.tip_mm.z(), 0.6, 1e-6);
}

TEST(PlanMotion, PathThatTouchesItselfIsRaisedThoughOthersChangePlaces) {
  // Beside a groove whose bottom goes first: the same piece has a path whose end lies between its own flanks.
  Toolpaths toolpaths = groove();
  std::vector<Vec3> positions;
  const auto row = [&](double y, double z, bool back) {
    for (int i = 0; i <= 20; ++i) positions.push_back(Vec3(back ? 10.0 - i : i - 10.0, y, z));
  };
  row(29.25, 1.0, false);
  row(30.75, 1.0, true);
  row(30.0, 0.3, false);
  shapes::add_path(toolpaths, positions, std::vector<Vec3>(positions.size(), Vec3::UnitZ()), 0);
  const MotionResult result = plan_motion(toolpaths, Machine{});
  expect_all_checks(result.report);
  EXPECT_EQ(result.path_order, (std::vector<Index>{0, 3, 1, 2, 4, 5}));
  EXPECT_FALSE(result.raised.empty());
  for (const RaisedPoint& point : result.raised) EXPECT_GE(point.point, toolpaths.paths[5].first_point + 40);
}

TEST(PlanMotion, CreaseOfALayerIsPassedByANewChainNotByAJumpOfTheArm) {
  // The layer bends by 100 degrees within 0.06 mm; the axis may lag 30 degrees on either side.
  Toolpaths toolpaths;
  std::vector<Vec3> positions, normals;
  for (int i = -40; i <= 40; ++i) {
    positions.push_back(Vec3(0, 0.06 * i, 40.0 - 0.06 * std::abs(i)));
    const double lean = (i < 0 ? -50.0 : 50.0) * std::numbers::pi / 180.0;
    normals.push_back(Vec3(0, std::sin(lean), std::cos(lean)));
  }
  shapes::add_path(toolpaths, positions, normals, 0);
  for (PathPoint& point : toolpaths.points) point.tip_offset_mm = 0.0;
  const MotionResult result = plan_motion(toolpaths, Machine{});
  EXPECT_TRUE(find(result.report, "motion.branch_jumps").ok) << result.report.max_joint_step_rad;
  EXPECT_TRUE(find(result.report, "motion.volume_error").ok);
  EXPECT_TRUE(find(result.report, "motion.tilt_deviation_deg").ok) << result.report.tilt_deviation_max_deg;
  EXPECT_GE(result.motion.paths.size(), 2u);
  for (std::size_t c = 1; c < result.motion.paths.size(); ++c) {
    const PathMotion& before = result.motion.paths[c - 1];
    const Waypoint& end = result.motion.waypoints[before.first_waypoint + before.waypoint_count - 1];
    EXPECT_EQ(end.tip_mm, result.motion.waypoints[result.motion.paths[c].first_waypoint].tip_mm);
  }
}

// A slow bead is divided in the program, since no move may last longer than gates lie apart: its waypoints are few, its moves many.
TEST(PlanMotion, SlowPathIsCutWhereItsMovesWouldNotFitIntoAPart) {
  Toolpaths toolpaths;
  shapes::add_ring(toolpaths, Vec3(0, 0, 0.3), 20.0, 0.0, 0, 120);
  for (PathPoint& point : toolpaths.points) point.feed_mm_s = 0.2;
  Machine machine;
  machine.program.max_moves_per_part = 300;
  const MotionResult result = plan_motion(toolpaths, machine);
  expect_all_checks(result.report);
  expect_sound(toolpaths, machine, result);
  double volume = 0.0;
  for (const PathMotion& chain : result.motion.paths) {
    double moves = 0.0;
    for (Index w = chain.first_waypoint + 1; w < chain.first_waypoint + chain.waypoint_count; ++w) {
      moves += std::max(1.0, std::ceil(result.motion.waypoints[w].duration_s / machine.link.gate_interval_s));
    }
    EXPECT_LT(moves, machine.program.max_moves_per_part);
    volume += chain.volume_mm3;
  }
  EXPECT_GT(result.motion.paths.size(), 2u);
  EXPECT_NEAR(volume, 2.0 * std::numbers::pi * 20.0 * 0.6 * 0.8, 0.1);
}

TEST(PlanArmPath, ForearmTurnsAwayFromWhatLiesInItsWay) {
  const Machine machine;
  const Cell cell(machine);
  std::vector<DraftPoint> drafts;
  for (int i = 0; i <= 4; ++i) {
    DraftPoint draft;
    draft.tip = Vec3(3.0 * i - 6.0, 0.0, 20.0);
    draft.point = 100 + i;
    drafts.push_back(draft);
  }
  const ArmPath free = plan_arm_path(cell, nullptr, drafts, {}, {});
  ASSERT_EQ(free.sections.size(), 1u);
  int touching = 0;
  for (const double share : {0.2, 0.5, 0.8}) {
    // Beads inside the forearm as it would lie.
    const auto forearm = cell.links(free.sections[0].points[2].joints)[0];
    ASSERT_EQ(std::string(forearm.name), "forearm");
    const Vec3 at = forearm.a + share * (forearm.b - forearm.a);
    Toolpaths laid;
    shapes::add_path(laid, {at, at + Vec3(2.0, 0.0, 0.0)}, {Vec3::UnitZ(), Vec3::UnitZ()}, 0);
    std::vector<Vec3> tips;
    for (const PathPoint& point : laid.points) tips.push_back(point.position);
    const Deposit deposit(laid.paths, laid.points, tips, 1.0);
    const char* link = touching_link(cell, deposit, free.sections[0].points[2].joints, 100, 0.0);
    ASSERT_NE(link, nullptr);
    touching += std::string(link) == "forearm";
    const ArmPath clear = plan_arm_path(cell, &deposit, drafts, {}, {});
    ASSERT_EQ(clear.unreachable, kNone);
    for (const ArmSection& section : clear.sections) {
      for (const ArmPoint& point : section.points) {
        EXPECT_EQ(touching_link(cell, deposit, point.joints, 100, 0.0), nullptr);
        EXPECT_GT(largest_joint_step(point.joints, free.sections[0].points[2].joints), 0.1);
      }
    }
  }
  EXPECT_EQ(touching, 3);
}

TEST(PlanMotion, AutomaticPlacementBringsAPartIntoReach) {
  Toolpaths toolpaths = shapes::flat_rings(3.0, 1);
  for (PathPoint& point : toolpaths.points) point.position.x() += 620.0;
  EXPECT_FALSE(plan_motion(toolpaths, Machine{}).report.unreachable.empty());
  Machine machine;
  machine.place = Placement::automatic;
  const MotionResult result = plan_motion(toolpaths, machine);
  expect_all_checks(result.report);
  EXPECT_LT(result.motion.part_offset_mm.x(), -300.0);
}

TEST(PlanMotion, ThreadsDoNotChangeAnything) {
  const Toolpaths toolpaths = shapes::cap_rings(40.0, 0.9, 15.0);
  RunContext two;
  two.threads = 2;
  const Motion a = plan_motion(toolpaths, Machine{}).motion, b = plan_motion(toolpaths, Machine{}, {}, two).motion;
  ASSERT_EQ(a.waypoints.size(), b.waypoints.size());
  for (std::size_t i = 0; i < a.waypoints.size(); ++i) {
    EXPECT_EQ(a.waypoints[i].joints, b.waypoints[i].joints);
    EXPECT_EQ(a.waypoints[i].pose.rotation_vector, b.waypoints[i].pose.rotation_vector);
  }
  ASSERT_EQ(a.travels.size(), b.travels.size());
  for (std::size_t i = 0; i < a.travels.size(); ++i) EXPECT_EQ(a.travels[i].joints, b.travels[i].joints);
}

}  // namespace
}  // namespace curvesup
