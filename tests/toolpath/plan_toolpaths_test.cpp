#include "curvesup/toolpath/plan_toolpaths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "curvesup/core/error.h"
#include "toolpath/sheets.h"

namespace curvesup {
namespace {

ToolpathResult plan(const sheets::NamedSheet& sheet, const ToolpathOptions& options = {}, int threads = 1) {
  RunContext run;
  run.threads = threads;
  return plan_toolpaths(sheet.gradient, sheet.stack, options, run);
}

TEST(PlanToolpaths, SegmentVolumesAreExact) {
  const auto result = plan(sheets::sphere_cap(20, 0.5, 60, 9));
  ASSERT_GT(result.report.paths, 0);
  for (const Path& path : result.toolpaths.paths) {
    for (Index i = path.first_point; i < path.first_point + path.point_count; ++i) {
      const PathPoint& p = result.toolpaths.points[i];
      if (i == path.first_point) {
        EXPECT_EQ(p.volume_mm3, 0.0);
        continue;
      }
      const double length = (p.position - result.toolpaths.points[i - 1].position).norm();
      EXPECT_EQ(p.volume_mm3, p.height_mm * p.width_mm * length);
      EXPECT_NEAR(p.height_mm, 0.8, 0.016);
      EXPECT_NEAR(p.normal.norm(), 1.0, 1e-12);
      EXPECT_GT(p.feed_mm_s, 0.0);
    }
  }
}

TEST(PlanToolpaths, BeadsAddUpToTheLayer) {
  for (const double width : {0.5, 0.9, 1.3, 2.0, 2.6, 3.1, 4.4, 9.0}) {
    const auto report = plan(sheets::strip(30, width, 30, 4)).report;
    EXPECT_NEAR(report.volume_mm3[0] / report.layer_volume_mm3[0], 1.0, 0.01) << width;
  }
  for (const double inner : {2.0, 5.0, 8.3}) {
    const auto report = plan(sheets::annulus(inner, 10, 90, 6)).report;
    EXPECT_NEAR(report.volume_mm3[0] / report.layer_volume_mm3[0], 1.0, 0.01) << inner;
  }
}

TEST(PlanToolpaths, BeadsAddUpWhereTheWidthSwings) {
  // Rings end, centre lines begin: each place is filled once, whatever the tracks do there.
  for (const double wide : {1.0, 1.4, 1.9, 2.5, 3.3, 4.0}) {
    for (const double narrow : {0.4, 0.8, 1.4}) {
      const auto result = plan(sheets::waisted_strip(36, narrow, std::max(narrow, wide)));
      EXPECT_NEAR(result.report.volume_mm3[0] / result.report.layer_volume_mm3[0], 1.0, 0.01) << narrow << " to " << wide;
      for (const PathPoint& p : result.toolpaths.points) {
        EXPECT_GE(p.width_mm, 0.2);
        EXPECT_LE(p.width_mm, 1.2);
      }
    }
  }
}

TEST(PlanToolpaths, APieceThatIsAllBorderGetsADot) {
  // One triangle (and one without area): no vertex is a deepest place, and from each the farthest lies along the border.
  const auto sheet = sheets::mapped_grid(1, 1, [](double u, double v) { return Vec3(0.4 * u, 0.3 * v * u, 5); });
  const auto result = plan(sheet);
  EXPECT_EQ(result.report.pieces_without_path, 0);
  EXPECT_EQ(result.report.paths, 1);
  EXPECT_GT(result.report.volume_mm3[0], 0.0);
}

TEST(PlanToolpaths, StepsJoinTracksAndNeverCrossAGap) {
  // A ring with a slit narrower than a step: tracks on either side of it must not be joined across.
  const double slit = 1.2, outer = 9.0;
  const auto sheet = sheets::mapped_grid(120, 8, [&](double u, double v) {
    const double r = outer - 5.3 * v, a = std::asin(0.5 * slit / r), turn = a + u * (2.0 * std::numbers::pi - 2.0 * a);
    return Vec3(r * std::cos(turn), r * std::sin(turn), 10.0);
  });
  ToolpathOptions apart;
  apart.link_rings = false;
  const auto joined = plan(sheet), single = plan(sheet, apart);
  EXPECT_LT(2 * joined.report.paths, single.report.paths);
  EXPECT_NEAR(joined.report.volume_mm3[0] / joined.report.layer_volume_mm3[0], 1.0, 0.01);
  for (const Path& path : joined.toolpaths.paths) {
    for (Index i = path.first_point + 1; i < path.first_point + path.point_count; ++i) {
      const Vec3 &a = joined.toolpaths.points[i - 1].position, &b = joined.toolpaths.points[i].position;
      for (const double t : {0.25, 0.5, 0.75}) {
        const Vec3 p = a + t * (b - a);
        EXPECT_FALSE(p.x() > 0.0 && std::abs(p.y()) < 0.5 * slit - 0.01) << p.transpose();
      }
      EXPECT_LT((b - a).norm(), 5.01);
    }
  }
}

TEST(PlanToolpaths, SameBytesForAnyThreadCount) {
  const auto sheet = sheets::annulus(2, 10, 90, 6);
  const auto one = plan(sheet, {}, 1), three = plan(sheet, {}, 3);
  ASSERT_EQ(one.toolpaths.points.size(), three.toolpaths.points.size());
  EXPECT_EQ(0, std::memcmp(one.toolpaths.points.data(), three.toolpaths.points.data(),
                           one.toolpaths.points.size() * sizeof(PathPoint)));
}

TEST(PlanToolpaths, HeightEndsAtThePlatform) {
  // A layer 0.8 mm thick whose middle lies 0.1 mm above the platform: the tip stands at 0.5 mm.
  auto sheet = sheets::strip(10, 6, 10, 6);
  for (Vec3& v : sheet.stack.vertices) v.z() = 0.1;
  const auto result = plan(sheet);
  for (const PathPoint& p : result.toolpaths.points) {
    EXPECT_NEAR(p.height_mm, 0.5, 1e-9);
    EXPECT_NEAR(p.tip_offset_mm, 0.4, 1e-9);
  }
  EXPECT_NEAR(result.report.layer_volume_mm3[0], 10 * 6 * 0.5, 1e-9);
}

TEST(PlanToolpaths, FlowLimitsFeed) {
  ToolpathOptions options;
  options.material[0].speed_mm_s = 100.0;
  const auto result = plan(sheets::strip(30, 20, 10, 6), options);
  for (const PathPoint& p : result.toolpaths.points) {
    EXPECT_LE(p.feed_mm_s * p.width_mm * p.height_mm, options.max_flow_mm3_s * (1 + 1e-12));
  }
}

TEST(PlanToolpaths, RefusesOptionsOutOfRange) {
  ToolpathOptions options;
  options.max_bead_mm = 5.0;
  EXPECT_THROW(plan(sheets::strip(3, 3, 3, 3), options), Error);
}

}  // namespace
}  // namespace curvesup
