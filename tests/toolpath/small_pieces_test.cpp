#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/toolpath/plan_toolpaths.h"
#include "toolpath/sheets.h"

// Pieces of a few beads: all corners and ends.
namespace curvesup {
namespace {

constexpr double kWidth = 0.8;

struct Filling {
  double volume = 0.0;   // of the beads, as a part of the piece
  double covered = 0.0;  // part of the piece within 0.55 widths of a path, its own or the nominal
  double farthest_out = 0.0;  // mm between a segment and the piece
  Index paths = 0;
};

// By looking at all segments and all triangles.
Filling fill(const sheets::NamedSheet& sheet) {
  RunContext run;
  run.threads = 1;
  const ToolpathResult result = plan_toolpaths(sheet.gradient, sheet.stack, {}, run);
  Filling filling{.volume = result.report.volume_mm3[0] / result.report.layer_volume_mm3[0], .paths = result.report.paths};
  const auto for_segments = [&](const auto& use) {
    for (const Path& path : result.toolpaths.paths) {
      for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) use(result.toolpaths.points[k - 1], result.toolpaths.points[k]);
    }
  };
  const auto& v = sheet.stack.vertices;
  double area = 0.0;
  for (const auto& [a, b, c] : sheet.stack.triangles) {
    constexpr int kRows = 4;
    for (int i = 0; i < kRows; ++i) {
      for (int j = 0; i + j < kRows; ++j) {
        const Vec3 p = v[a] + (i + 1.0 / 3.0) / kRows * (v[b] - v[a]) + (j + 1.0 / 3.0) / kRows * (v[c] - v[a]);
        bool covered = false;
        for_segments([&](const PathPoint& from, const PathPoint& to) {
          covered = covered || (closest_point_on_segment(p, from.position, to.position) - p).norm() <= 0.55 * std::max(kWidth, to.width_mm);
        });
        const double share = triangle_area(v[a], v[b], v[c]);
        area += share;
        filling.covered += covered * share;
      }
    }
  }
  filling.covered /= area;
  for_segments([&](const PathPoint& from, const PathPoint& to) {
    for (const double t : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const Vec3 p = from.position + t * (to.position - from.position);
      double nearest = 1e300;
      for (const auto& [a, b, c] : sheet.stack.triangles) nearest = std::min(nearest, (closest_point_on_triangle(p, v[a], v[b], v[c]) - p).norm());
      filling.farthest_out = std::max(filling.farthest_out, nearest);
    }
  });
  return filling;
}

void expect_full(const sheets::NamedSheet& sheet, double least_covered, const std::string& what) {
  const Filling filling = fill(sheet);
  EXPECT_GT(filling.paths, 0) << what;
  EXPECT_NEAR(filling.volume, 1.0, 0.05) << what;
  EXPECT_GE(filling.covered, least_covered) << what;
  EXPECT_LT(filling.farthest_out, 0.02) << what;
}

TEST(SmallPieces, StripsAreFilledToTheirEnds) {
  for (const auto& [nu, nv] : {std::pair(8, 8), std::pair(7, 5), std::pair(9, 3)}) {
    for (const double width : {0.5, 0.75, 1.0, 1.125, 1.25, 1.375, 1.5, 1.75, 2.0, 2.25, 2.5}) {
      for (const double length : {1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0}) {
        if (length < width) continue;
        // One line across a square leaves something of its corners.
        expect_full(sheets::strip(length * kWidth, width * kWidth, nu, nv), length > width ? 0.95 : 0.9,
                    std::to_string(length) + " by " + std::to_string(width) + " beads, " + std::to_string(nu) + " by " + std::to_string(nv) + " cells");
      }
    }
  }
}

TEST(SmallPieces, DiscsAreFilled) {
  for (const int cells : {5, 8}) {
    for (const double diameter : {0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0}) {
      const double r = 0.5 * diameter * kWidth;
      const auto disc = sheets::mapped_grid(cells, cells, [&](double u, double v) {
        const double x = 2.0 * u - 1.0, y = 2.0 * v - 1.0;
        return Vec3(r * x * std::sqrt(1.0 - 0.5 * y * y), r * y * std::sqrt(1.0 - 0.5 * x * x), 10.0);
      });
      expect_full(disc, 0.95, std::to_string(diameter) + " beads, " + std::to_string(cells) + " cells");
    }
  }
}

TEST(SmallPieces, BentPiecesOnSlopesAreFilled) {
  for (const double width : {0.5, 1.0, 1.5, 2.0}) {
    for (const double length : {2.0, 4.0}) {
      const auto bent = sheets::mapped_grid(11, 5, [&](double u, double v) {
        const double angle = (u - 0.5) * length * kWidth / 2.0, r = 2.0 + (0.5 - v) * width * kWidth;
        return Vec3(r * std::sin(angle), r * std::cos(angle), 10.0 + 0.3 * std::sin(angle));
      });
      expect_full(bent, 0.95, std::to_string(length) + " by " + std::to_string(width) + " beads");
    }
  }
}

// The layer is a half thicker on one side of the line in its middle than on the other: volume goes by both.
TEST(SmallPieces, AStripThickerOnOneSideGetsItsVolume) {
  for (const double width : {0.6, 0.8, 1.0, 1.2}) {
    auto strip = sheets::strip(3.0, width, 10, 3);
    for (std::size_t t = 0; t < strip.gradient.size(); ++t) {
      double y = 0.0;
      for (const Index v : strip.stack.triangles[t]) y += strip.stack.vertices[v].y() / 3.0;
      if (y > width / 3.0) strip.gradient[t] /= 1.5;
    }
    EXPECT_NEAR(fill(strip).volume, 1.0, 0.02) << width;
  }
}

// Rings on round pieces face away from each other: steps between them must not leave more out of the rings than they lay.
TEST(SmallPieces, RoundPiecesOfSeveralRingsAreFull) {
  const std::vector<double> radii = {1.9, 2.3, 2.7, 3.1, 3.5};
  double sum = 0.0;
  for (const double radius : radii) {
    const auto disc = sheets::mapped_grid(16, 16, [&](double u, double v) {
      const double x = 2.0 * u - 1.0, y = 2.0 * v - 1.0;
      return Vec3(radius * x * std::sqrt(1.0 - 0.5 * y * y), radius * y * std::sqrt(1.0 - 0.5 * x * x), 10.0);
    });
    const Filling filling = fill(disc);
    EXPECT_NEAR(filling.volume, 1.0, 0.02) << radius;
    EXPECT_GE(filling.covered, 0.98) << radius;
    sum += filling.volume;
  }
  EXPECT_NEAR(sum / radii.size(), 1.0, 0.01);
}

}  // namespace
}  // namespace curvesup
