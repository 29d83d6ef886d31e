#include <gtest/gtest.h>

#include <functional>

#include "check/emitted_print.h"

namespace curvesup {
namespace {

Machine small_parts() {
  Machine machine;
  machine.program.max_moves_per_part = 150;
  return machine;
}

const WrittenPrint& sound_print() {
  static const WrittenPrint print = write_print(three_layers(), small_parts());
  return print;
}

TEST(CheckOutput, SoundPrintPassesEveryCheck) {
  const CheckOutputResult result = check_written(sound_print());
  EXPECT_TRUE(result.ok) << check_summary(result);
  const EmittedFigures& figures = result.figures;
  EXPECT_GT(figures.parts, 2u);
  EXPECT_GT(figures.gates, 10u);
  EXPECT_EQ(figures.paths, 7u);
}

bool holds(const CheckOutputResult& result, const std::string& name) {
  for (const Check& check : result.checks) {
    if (check.name == "emitted." + name) return check.ok;
  }
  ADD_FAILURE() << "no check " << name;
  return false;
}

void expect_only(const CheckOutputResult& result, const std::string& name) {
  for (const Check& check : result.checks) EXPECT_EQ(check.ok, check.name != "emitted." + name) << check.name << ": " << check.detail;
}

// A bead beside a wall that is 10 mm higher.
Toolpaths bead_beside_wall() {
  Toolpaths toolpaths;
  const auto row = [&](double y, double z, Index layer) {
    std::vector<Vec3> positions;
    for (int i = 0; i <= 40; ++i) positions.push_back(Vec3(i - 20.0, y, z));
    shapes::add_path(toolpaths, positions, std::vector<Vec3>(positions.size(), Vec3::UnitZ()), layer);
  };
  for (int k = 0; k < 50; ++k) row(4.0, 0.3 + 0.6 * k, k);
  row(0.0, 20.3, 50);
  return toolpaths;
}

TEST(CheckOutput, HeadThatCutsIntoAWallIsFound) {
  EXPECT_TRUE(check_written(write_print(bead_beside_wall(), Machine{})).ok);
  MotionOptions careless;
  careless.avoid_collisions = false;
  const CheckOutputResult result = check_written(write_print(bead_beside_wall(), Machine{}, careless));
  expect_only(result, "rule_21_clearance");
}

TEST(CheckOutput, LinkThatIsThickerThanPlannedForIsFound) {
  WrittenPrint print = write_print(three_layers(), Machine{});
  print.machine.arm.body.wrist_radius_mm = 400.0;
  EXPECT_FALSE(holds(check_written(print), "rule_21_clearance"));
}

// A wave of blended corners, each of which the arm cuts: 3.5 ms of 100 ms.
Toolpaths wave() {
  Toolpaths toolpaths;
  std::vector<Vec3> positions;
  for (int i = 0; i <= 120; ++i) positions.push_back(Vec3(-50.0 + 0.866 * i, i % 2 == 0 ? 0.0 : 0.5, 0.3));
  shapes::add_path(toolpaths, positions, std::vector<Vec3>(positions.size(), Vec3::UnitZ()), 0);
  return toolpaths;
}

TEST(CheckOutput, ArmWaitsForTheBoardWhatItsCornersSave) {
  WrittenPrint print = write_print(wave(), Machine{});
  CheckOutputResult result = check_written(print);
  EXPECT_TRUE(result.ok) << check_summary(result);
  EXPECT_LT(result.figures.max_chain_mismatch_s, 0.041);
  std::string& script = print.files.at("robot/part_0001.script");
  int waits = 0;
  for (std::size_t at; (at = script.find(" sleep(0.0", script.find("# barrier path"))) != std::string::npos; ++waits)
    script.erase(at, script.find('\n', at) + 1 - at);
  EXPECT_GE(waits, 5);
  result = check_written(print);
  EXPECT_FALSE(result.ok);
  EXPECT_GT(result.figures.max_chain_mismatch_s, 0.25);
}

}  // namespace
}  // namespace curvesup
