#include "toolpath/toolpath_checks.h"

#include <gtest/gtest.h>

#include <string>

#include "toolpath/sheets.h"

namespace curvesup::toolpath {
namespace {

std::vector<std::string> failed(const ToolpathReport& report, const ToolpathOptions& options = {}) {
  std::vector<std::string> names;
  for (const Check& check : toolpath_checks(report, options)) {
    if (!check.ok) names.push_back(check.name);
  }
  return names;
}

using Names = std::vector<std::string>;

ToolpathReport good_report() {
  const auto sheet = sheets::strip(12, 6, 12, 6);
  return plan_toolpaths(sheet.gradient, sheet.stack).report;
}

TEST(ToolpathChecks, AGoodReportHolds) { EXPECT_EQ(failed(good_report()), Names{}); }

TEST(ToolpathChecks, APieceWithoutAPathIsFound) {
  ToolpathReport report = good_report();
  report.pieces_without_path = 1;
  EXPECT_EQ(failed(report), Names{"toolpath.pieces_without_path"});
}

TEST(ToolpathChecks, FlowBeyondWhatTheNozzleMeltsIsFound) {
  ToolpathReport report = good_report();
  ToolpathOptions options;
  report.max_flow_mm3_s = options.max_flow_mm3_s;
  EXPECT_EQ(failed(report, options), Names{});
  report.max_flow_mm3_s *= 1.001;
  EXPECT_EQ(failed(report, options), Names{"toolpath.max_flow_mm3_s"});
}

TEST(ToolpathChecks, VolumeIsHeldForEachMaterial) {
  ToolpathReport report = good_report();
  report.volume_mm3[0] *= 0.985;
  EXPECT_EQ(failed(report), Names{"toolpath.model_volume"});
  report = good_report();
  report.layer_volume_mm3[1] = 100.0;
  report.volume_mm3[1] = 102.0;
  EXPECT_EQ(failed(report), Names{"toolpath.support_volume"});
  // Sparse lines leave room on purpose.
  ToolpathOptions options;
  options.material[1].pattern = FillPattern::contour_zigzag;
  options.material[1].line_spacing_mm = 2.0;
  EXPECT_EQ(failed(report, options), Names{});
}

}  // namespace
}  // namespace curvesup::toolpath
