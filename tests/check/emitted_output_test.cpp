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

}  // namespace
}  // namespace curvesup
