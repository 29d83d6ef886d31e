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

// By looking at all segments, and at so many rows of places in all triangles.
Filling fill(const sheets::NamedSheet& sheet, int rows = 4) {
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
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; i + j < rows; ++j) {
        const Vec3 p = v[a] + (i + 1.0 / 3.0) / rows * (v[b] - v[a]) + (j + 1.0 / 3.0) / rows * (v[c] - v[a]);
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

// What lies between the corners of large triangles is found: plain parts have no others.
TEST(CoarsePieces, PlatesAreFilledHoweverTheyAreTurned) {
  for (const double turn : {0.0, 0.3, 1.1, 2.5}) {
    for (const double width : {3.0, 5.0, 6.0, 9.5, 20.0}) {
      const Filling plate = fill(sheets::plate(20.0, width, turn), 60), angle = fill(sheets::angle_plate(25.0, width, turn), 60);
      for (const auto& [filling, what] : {std::pair(plate, "plate"), std::pair(angle, "angle")}) {
        EXPECT_NEAR(filling.volume, 1.0, 0.02) << what << ' ' << width << ' ' << turn;
        EXPECT_GE(filling.covered, 0.98) << what << ' ' << width << ' ' << turn;
        EXPECT_LT(filling.farthest_out, 1e-3) << what << ' ' << width << ' ' << turn;
      }
    }
  }
}

// A bead that runs along a strip, away from its ends.
struct StripBead {
  double inset, width, length;  // inset: from the nearer side
};

std::vector<StripBead> beads_along(double strip_width, double turn) {
  constexpr double kLength = 40.0, kEnd = 5.0;
  RunContext run;
  const auto sheet = sheets::plate(kLength, strip_width, turn);
  const ToolpathResult result = plan_toolpaths(sheet.gradient, sheet.stack, {}, run);
  const Vec3 along(std::cos(turn), std::sin(turn), 0.0), across(-std::sin(turn), std::cos(turn), 0.0);
  std::vector<StripBead> beads;
  for (const Path& path : result.toolpaths.paths) {
    for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
      const Vec3 &from = result.toolpaths.points[k - 1].position, &to = result.toolpaths.points[k].position;
      const double x = along.dot(from), y = across.dot(0.5 * (from + to)), length = std::abs(along.dot(to - from));
      if (x < kEnd || x > kLength - kEnd || length < 0.9 * (to - from).norm()) continue;
      beads.push_back({std::min(y, strip_width - y), result.toolpaths.points[k].width_mm, length});
    }
  }
  return beads;
}

// A wall too wide for one bead and too narrow for two has two in the middle of its halves. Where a ring begins and ends,
// what is between two beads is shared a little unevenly.
TEST(CoarsePieces, TwoBeadsShareANarrowWall) {
  for (const double width : {1.3, 1.4, 1.5}) {
    double all = 0.0, even = 0.0;
    for (const StripBead& bead : beads_along(width, 0.0)) {
      EXPECT_NEAR(bead.inset, 0.25 * width, 0.01) << width;
      EXPECT_NEAR(bead.width, 0.5 * width, 0.1) << width;
      all += bead.length;
      even += std::abs(bead.width - 0.5 * width) < 0.01 ? bead.length : 0.0;
    }
    EXPECT_GT(even, 0.93 * all) << width;
    EXPECT_GT(all, 50.0) << width;
  }
}

// Where the border is straight, so are the beads: those that run as far from it are equally wide.
TEST(CoarsePieces, BeadsOfAStraightStripAreEven) {
  for (const double turn : {0.0, 0.4, 2.0}) {
    for (const double width : {0.6, 0.9, 1.1, 2.2, 3.0, 6.0}) {
      const std::vector<StripBead> beads = beads_along(width, turn);
      ASSERT_FALSE(beads.empty());
      double all = 0.0, even = 0.0;
      for (const StripBead& bead : beads) {
        std::vector<double> widths;
        for (const StripBead& other : beads) {
          if (std::abs(other.inset - bead.inset) < 0.05) widths.push_back(other.width);
        }
        std::nth_element(widths.begin(), widths.begin() + widths.size() / 2, widths.end());
        all += bead.length;
        even += std::abs(bead.width - widths[widths.size() / 2]) < 0.02 ? bead.length : 0.0;
      }
      EXPECT_GT(even, 0.9 * all) << width << ' ' << turn;
    }
  }
}

}  // namespace
}  // namespace curvesup
