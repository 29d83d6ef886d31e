#include <gtest/gtest.h>

#include <algorithm>

#include "curvesup/pipeline/slice.h"

namespace curvesup {
namespace {

SliceOutcome outcome_with_failures(int failed) {
  SliceOutcome outcome;
  outcome.report = {{"input", {{"model", "part.tet"}}}, {"model", {{"tets", 1234}, {"volume_mm3", 5600.0}}}, {"checks", Json::array()}};
  for (int i = 0; i < 50; ++i) {
    outcome.report["checks"].push_back({{"name", "check." + std::to_string(i)}, {"ok", i >= failed}, {"value", 0.0917687154}, {"limit", 0.02}, {"detail", "where"}});
  }
  outcome.times = {{"load", 1.25, 1.0, 80.0}, {"field", 0.5, 0.5, 60.0}};
  return outcome;
}

TEST(Summary, FitsOneScreenHoweverManyChecksFail) {
  const std::string text = summary_text(outcome_with_failures(30), "out");
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 24) << text;
  EXPECT_NE(text.find("20 passed, 30 failed"), std::string::npos) << text;
  EXPECT_NE(text.find("FAILED check.0: 0.09177, limit 0.02; where"), std::string::npos) << text;
  EXPECT_NE(text.find("and 22 more"), std::string::npos) << text;
  EXPECT_NE(text.find("out/preview.html"), std::string::npos) << text;
}

TEST(Summary, NamesEveryFailedCheckWhenTheyAreFew) {
  const std::string text = summary_text(outcome_with_failures(8), "out");
  EXPECT_NE(text.find("FAILED check.7:"), std::string::npos) << text;
  EXPECT_EQ(text.find(" more: "), std::string::npos) << text;
  EXPECT_NE(text.find("in 1.8 s, 80 MB"), std::string::npos) << text;
}

TEST(Summary, SaysNothingOfWhatWasNotMeasured) {
  SliceOutcome outcome = outcome_with_failures(0);
  outcome.report["overhang"] = {{"area_mm2", 300.0}};
  outcome.report["support"] = {{"method", "tree"}, {"volume_mm3", 2500.0}};
  const std::string stopped = summary_text(outcome, "out");
  EXPECT_NE(stopped.find("tree, 2.50 cm3\n"), std::string::npos) << stopped;
  outcome.report["support"].update({{"covered_overhang_fraction", 0.5}, {"floating_pieces", 7}});
  const std::string whole = summary_text(outcome, "out");
  EXPECT_NE(whole.find("tree, 2.50 cm3, covers 50.00 % of 300 mm2 overhang, 7 floating pieces\n"), std::string::npos) << whole;
}

}  // namespace
}  // namespace curvesup
