#include "curvesup/toolpath/plan_toolpaths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

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

TEST(PlanToolpaths, BeadsAddUpOnSmallPieces) {
  // Their corners lie far from the one track in the middle.
  for (const auto& [length, width] : {std::pair(1.2, 1.1), std::pair(1.4, 1.1), std::pair(1.4, 1.2)}) {
    const auto report = plan(sheets::strip(length, width, 8, 8)).report;
    EXPECT_NEAR(report.volume_mm3[0] / report.layer_volume_mm3[0], 1.0, 0.01) << length << " by " << width;
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

double laying_seconds(const Toolpaths& toolpaths) {
  double seconds = 0.0;
  for (const Path& path : toolpaths.paths) {
    for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
      seconds += (toolpaths.points[k].position - toolpaths.points[k - 1].position).norm() / toolpaths.points[k].feed_mm_s;
    }
  }
  return seconds;
}

TEST(PlanToolpaths, TimesAddUpFromTheSpeedsOfTheSegments) {
  const auto result = plan(sheets::annulus(2, 10, 90, 6));
  const ToolpathReport& report = result.report;
  const ToolpathOptions options;
  EXPECT_NEAR(report.laying_time_s, laying_seconds(result.toolpaths), 1e-9 * report.laying_time_s);
  EXPECT_NEAR(report.time_s, report.laying_time_s + report.travel_mm / options.travel_speed_mm_s + report.jumps * options.jump_overhead_s, 1e-9);
  double fastest = 0.0;
  for (const PathPoint& p : result.toolpaths.points) fastest = std::max(fastest, p.feed_mm_s * p.width_mm * p.height_mm);
  EXPECT_NEAR(report.max_flow_mm3_s, fastest, 1e-12);
  const double section = 0.25 * std::numbers::pi * 1.75 * 1.75;
  EXPECT_NEAR(report.filament_mm[0], report.volume_mm3[0] / section, 1e-9);
}

TEST(PlanToolpaths, EachMaterialHasItsSpeed) {
  ToolpathOptions options;
  options.max_flow_mm3_s = 1e6;
  options.material[0].speed_mm_s = 30.0;
  options.material[1].speed_mm_s = 17.0;
  auto sheet = sheets::strip(60, 30, 30, 15);
  for (const PathPoint& p : plan(sheet, options).toolpaths.points) EXPECT_EQ(p.feed_mm_s, 30.0);
  sheet.stack.sheets[0].material = Material::support;
  for (const PathPoint& p : plan(sheet, options).toolpaths.points) EXPECT_EQ(p.feed_mm_s, 17.0);
}

TEST(PlanToolpaths, BeadsOnThePlatformAreSlower) {
  ToolpathOptions options;
  options.max_flow_mm3_s = 1e6;
  options.first_layer_speed_factor = 0.4;
  auto sheet = sheets::strip(60, 30, 30, 15);
  for (Vec3& v : sheet.stack.vertices) v.z() = 0.4;
  for (const PathPoint& p : plan(sheet, options).toolpaths.points) EXPECT_NEAR(p.feed_mm_s, 4.0, 1e-12);
}

TEST(PlanToolpaths, SmallLayersAreGivenTime) {
  ToolpathOptions options;
  options.min_layer_time_s = 20.0;
  const auto slow = plan(sheets::strip(8, 8, 8, 8), options);
  // 80 mm at 10 mm/s take 8 s: at 4 mm/s the layer takes its 20 s, steps between paths among them.
  const double between = slow.report.travel_mm / options.travel_speed_mm_s + slow.report.jumps * options.jump_overhead_s;
  EXPECT_NEAR(laying_seconds(slow.toolpaths) + between, 20.0, 1e-6);
  EXPECT_NEAR(slow.report.slowed_mm, slow.report.length_mm[0], 1e-9);
  // ... but no slower than that:
  options.min_speed_mm_s = 6.0;
  for (const PathPoint& p : plan(sheets::strip(8, 8, 8, 8), options).toolpaths.points) EXPECT_EQ(p.feed_mm_s, 6.0);
  options.min_layer_time_s = 0.0;
  EXPECT_EQ(plan(sheets::strip(8, 8, 8, 8), options).report.slowed_mm, 0.0);
}

Vec3 start_of_only_ring(const sheets::NamedSheet& sheet, const ToolpathOptions& options) {
  const auto result = plan(sheet, options);
  EXPECT_EQ(result.toolpaths.paths.size(), 1u);
  EXPECT_TRUE(result.toolpaths.paths[0].closed);
  EXPECT_EQ(result.toolpaths.points.front().position, result.toolpaths.points.back().position);
  return result.toolpaths.points.front().position;
}

// A square frame of 20 mm, one bead wide.
sheets::NamedSheet frame() {
  return sheets::mapped_grid(
      50, 50, [](double u, double v) { return Vec3(20 * u, 20 * v, 10); }, 0.8, false,
      [](double u, double v) { return std::max(std::abs(u - 0.5), std::abs(v - 0.5)) > 0.46; });
}

TEST(Seam, NearestIsWhereTheNozzleComesFrom) {
  // The nozzle stands at the origin, outside of the corner (0, 0).
  const Vec3 start = start_of_only_ring(frame(), {});
  EXPECT_LT((start - Vec3(0.4, 0.4, 10)).norm(), 0.6);
}

TEST(Seam, AlignedIsAtTheBackOfEveryLayer) {
  ToolpathOptions options;
  options.seam = SeamRule::aligned;
  EXPECT_GT(start_of_only_ring(frame(), options).y(), 19.3);
}

TEST(Seam, SharpestCornerIsThatOfTheLeastAngle) {
  // A square pushed over: the corners at (28, 0) and (0, 20) are sharper than the one near the nozzle.
  auto leaning = sheets::strip(20, 20, 40, 40);
  for (Vec3& v : leaning.stack.vertices) v.x() += 8.0 - 0.4 * v.y();
  ToolpathOptions options;
  options.seam = SeamRule::sharpest_corner;
  options.link_rings = false;
  const Vec3 diagonal = Vec3(28, -20, 0).normalized();  // from the one to the other
  int rings = 0;
  const auto result = plan(leaning, options);
  for (const Path& path : result.toolpaths.paths) {
    const double span = (result.toolpaths.points[path.first_point + path.point_count / 2].position - result.toolpaths.points[path.first_point].position).norm();
    if (!path.closed || span < 10.0) continue;  // the innermost have no clear corners
    ++rings;
    const Vec3 start = result.toolpaths.points[path.first_point].position - Vec3(0, 20, 10);
    EXPECT_LT(start.cross(diagonal).norm(), 0.6) << start.transpose();
  }
  EXPECT_GE(rings, 6);
}

TEST(Seam, RandomHangsOnTheSeedAlone) {
  ToolpathOptions options;
  options.seam = SeamRule::random;
  std::vector<Vec3> starts;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    options.seed = seed;
    starts.push_back(start_of_only_ring(frame(), options));
    EXPECT_EQ(starts.back(), start_of_only_ring(frame(), options));
  }
  double spread = 0.0;
  for (const Vec3& start : starts) spread = std::max(spread, (start - starts[0]).norm());
  EXPECT_GT(spread, 5.0);
}

TEST(PlanToolpaths, EveryCheckFailsWhenItsLimitIsBroken) {
  const auto failed = [](const ToolpathReport& report) {
    std::vector<std::string> names;
    for (const Check& check : report.checks) {
      if (!check.ok) names.push_back(check.name);
    }
    return names;
  };
  const auto sheet = sheets::strip(12, 6, 12, 6);
  ToolpathOptions options;
  EXPECT_EQ(failed(plan(sheet, options).report), std::vector<std::string>{});
  options.min_height_mm = 0.9;
  EXPECT_EQ(failed(plan(sheet, options).report), std::vector<std::string>{"toolpath.min_height_mm"});
  options.min_height_mm = 0.7;
  options.max_height_mm = 0.7;
  EXPECT_EQ(failed(plan(sheet, options).report), std::vector<std::string>{"toolpath.max_height_mm"});
  // A bead that must not be narrower than the piece is wide is too much for it.
  options = {};
  options.min_bead_mm = 0.8;
  auto narrow = sheets::strip(30, 0.5, 60, 2);
  EXPECT_EQ(failed(plan(narrow, options).report), std::vector<std::string>{"toolpath.model_volume"});
  narrow.stack.sheets[0].material = Material::support;
  EXPECT_EQ(failed(plan(narrow, options).report), std::vector<std::string>{"toolpath.support_volume"});
}

TEST(PlanToolpaths, RefusesOptionsOutOfRange) {
  ToolpathOptions options;
  options.max_bead_mm = 5.0;
  EXPECT_THROW(plan(sheets::strip(3, 3, 3, 3), options), Error);
}

}  // namespace
}  // namespace curvesup
