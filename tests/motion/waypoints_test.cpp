#include "motion/waypoints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "helpers/toolpath_shapes.h"
#include "motion/nozzle_axis.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Line {
  Toolpaths toolpaths;
  std::vector<Vec3> tips, axes;
};

// Along x with points 0.5 mm apart; height and normal by position.
Line line_of(int count, const std::function<Vec3(double)>& normal, const std::function<double(double)>& side) {
  Line line;
  std::vector<Vec3> positions, normals;
  for (int i = 0; i < count; ++i) {
    positions.push_back(Vec3(0.5 * i, side(0.5 * i), 10.0));
    normals.push_back(normal(0.5 * i).normalized());
  }
  shapes::add_path(line.toolpaths, positions, normals, 0);
  for (const PathPoint& point : line.toolpaths.points) {
    line.tips.push_back(point.position + point.tip_offset_mm * point.normal);
    line.axes.push_back(point.normal);
  }
  return line;
}

std::vector<DraftPoint> thin(const Line& line) {
  return thin_waypoints(line.toolpaths.points, line.tips, line.axes, 0, 1e9, Tolerances{});
}

TEST(ThinWaypoints, StraightLineKeepsItsEndsAndAllVolumeAndTime) {
  const Line line = line_of(
      201, [](double) { return Vec3::UnitZ(); }, [](double) { return 0.0; });
  const auto kept = thin(line);
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_NEAR(kept[1].volume_mm3, 100.0 * 0.6 * 0.8, 1e-9);
  EXPECT_NEAR(kept[1].duration_s, 100.0 / 10.0, 1e-9);
  EXPECT_EQ(kept[1].point, 200);
}

TEST(ThinWaypoints, AxisThatTurnsUnevenlyKeepsPoints) {
  const Line line = line_of(
      201, [](double x) { return Vec3(0, std::sin(0.2 * std::sin(0.3 * x)), 1.0); }, [](double) { return 0.0; });
  const auto kept = thin(line);
  EXPECT_GT(kept.size(), 5u);
  for (std::size_t k = 1; k < kept.size(); ++k) {
    for (Index i = kept[k - 1].point; i <= kept[k].point; ++i) {
      const double t = (line.tips[i] - kept[k - 1].tip).dot(kept[k].tip - kept[k - 1].tip) /
                       (kept[k].tip - kept[k - 1].tip).squaredNorm();
      const Vec3 axis = ((1 - t) * kept[k - 1].axis + t * kept[k].axis).normalized();
      EXPECT_LE(std::acos(std::min(1.0, axis.dot(line.axes[i]))), 1.0 * kDegree + 1e-7);
    }
  }
}

TEST(ThinWaypoints, ChordErrorIsKept) {
  const Line line = line_of(
      201, [](double) { return Vec3::UnitZ(); }, [](double x) { return 2.0 * std::sin(0.2 * x); });
  const auto kept = thin(line);
  EXPECT_LT(kept.size(), 100u);
  for (std::size_t k = 1; k < kept.size(); ++k) {
    for (Index i = kept[k - 1].point; i <= kept[k].point; ++i) {
      const Vec3 along = (kept[k].tip - kept[k - 1].tip).normalized(), offset = line.tips[i] - kept[k - 1].tip;
      EXPECT_LE((offset - offset.dot(along) * along).norm(), 0.03 + 1e-9);
    }
  }
}

TEST(ThinWaypoints, PointsMadeOneStayWithinTheChord) {
  // A step of 0.045 mm across the way: nearer than two waypoints may be, farther than the chord allows.
  Line line;
  const std::vector<Vec3> positions = {Vec3(0, 0, 1), Vec3(4, 0, 1), Vec3(4, 0.045, 1), Vec3(8, 0.045, 1)};
  shapes::add_path(line.toolpaths, positions, std::vector<Vec3>(4, Vec3::UnitZ()), 0);
  for (const PathPoint& point : line.toolpaths.points) line.tips.push_back(point.position);
  line.axes.assign(4, Vec3::UnitZ());
  const auto kept = thin(line);
  for (const Vec3& tip : line.tips) {
    double nearest = 1e300;
    for (std::size_t k = 1; k < kept.size(); ++k) {
      const Vec3 along = kept[k].tip - kept[k - 1].tip;
      const double t = std::clamp((tip - kept[k - 1].tip).dot(along) / along.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (tip - kept[k - 1].tip - t * along).norm());
      EXPECT_GE(along.norm(), 0.05);
    }
    EXPECT_LE(nearest, 0.03 + 1e-9);
  }
  EXPECT_NEAR(kept[0].volume_mm3 + kept[1].volume_mm3 + (kept.size() > 2 ? kept[2].volume_mm3 : 0.0), 8.045 * 0.48, 1e-9);
}

TEST(ThinWaypoints, PointsMadeOneCountWithTheSegmentThatPassesThem) {
  // The third point is one with the second, and farther from the straight way than the chord allows.
  Line line;
  const std::vector<Vec3> positions = {Vec3(0, 0, 1), Vec3(3, 0.029, 1), Vec3(3.01, 0.055, 1), Vec3(6, 0, 1)};
  shapes::add_path(line.toolpaths, positions, std::vector<Vec3>(4, Vec3::UnitZ()), 0);
  for (const PathPoint& point : line.toolpaths.points) line.tips.push_back(point.position);
  line.axes.assign(4, Vec3::UnitZ());
  const auto kept = thin(line);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_LE((kept[1].tip - positions[2]).norm(), 0.03);
}

TEST(ThinWaypoints, PlaceBetweenPointsMadeOneLeansNoMoreThanAllowed) {
  // A hairpin across a crease: its two points are one, and their normals differ by 8 degrees. The axis at the first leans
  // as far from its normal as it may, away from the other's.
  const auto leaning = [](double degrees) { return Vec3(std::sin(degrees * kDegree), 0.0, std::cos(degrees * kDegree)); };
  Line line;
  const std::vector<Vec3> positions = {Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(1, 0.045, 1), Vec3(0, 0.045, 1)};
  const std::vector<Vec3> normals = {leaning(0), leaning(0), leaning(-8), leaning(-8)};
  shapes::add_path(line.toolpaths, positions, normals, 0);
  for (const PathPoint& point : line.toolpaths.points) line.tips.push_back(point.position);
  line.axes = {leaning(30), leaning(30), leaning(22), leaning(22)};
  const auto kept = thin(line);
  ASSERT_EQ(kept.size(), 3u);
  EXPECT_LT((kept[1].tip - Vec3(1, 0.0225, 1)).norm(), 1e-12);
  EXPECT_LT((kept[1].normal - leaning(-4)).norm(), 1e-12);
  EXPECT_LT((kept[1].axis - leaning(26)).norm(), 1e-12);

  line.axes[2] = line.axes[3] = leaning(30);  // the mean of both axes would lean by 34 degrees
  EXPECT_LT((thin(line)[1].axis - leaning(26)).norm(), 1e-12);
}

TEST(ThinWaypoints, EndOfATinyRingTakesNothingFromItsFarSide) {
  // The two points before the end are one, and give way to it.
  Line line;
  const std::vector<Vec3> positions = {Vec3(0, 0, 1),          Vec3(-0.037, 0.386, 1), Vec3(-0.014, 0.403, 1),
                                       Vec3(0.033, 0.037, 1), Vec3(0.004, 0.070, 1),  Vec3(0, 0, 1)};
  shapes::add_path(line.toolpaths, positions, std::vector<Vec3>(6, Vec3::UnitZ()), 0);
  for (const PathPoint& point : line.toolpaths.points) line.tips.push_back(point.position);
  line.axes.assign(6, Vec3::UnitZ());
  double farthest = 0.0;
  for (const DraftPoint& point : thin(line)) farthest = std::max(farthest, point.tip.y());
  EXPECT_GT(farthest, 0.37);
}

TEST(ThinWaypoints, UnevenBeadKeepsPoints) {
  Line line = line_of(
      101, [](double) { return Vec3::UnitZ(); }, [](double) { return 0.0; });
  for (std::size_t i = 1; i < 101; ++i) line.toolpaths.points[i].volume_mm3 *= i < 50 ? 1.0 : 2.0;
  EXPECT_EQ(thin(line).size(), 3u);
}

TEST(SmoothAxes, JumpOfTheNormalBecomesATurnAtTheAllowedRate) {
  const Line line = line_of(
      101, [](double x) { return x < 25.0 ? Vec3(0, 0.2, 1) : Vec3(0, -0.2, 1); }, [](double) { return 0.0; });
  std::vector<Vec3> axes(line.tips.size());
  const Tolerances tolerances;
  smooth_axes(line.toolpaths.points, line.tips, tolerances, axes);
  for (std::size_t i = 1; i < axes.size(); ++i) {
    const double rate =
        std::acos(std::min(1.0, axes[i].dot(axes[i - 1]))) / kDegree / (line.tips[i] - line.tips[i - 1]).norm();
    EXPECT_LE(rate, tolerances.max_tilt_rate_deg_mm * 1.001);
    EXPECT_LE(std::acos(std::min(1.0, axes[i].dot(line.axes[i]))), tolerances.max_tilt_deviation.radians() + 1e-9);
  }
  EXPECT_LT((axes[0] - line.axes[0]).norm(), 1e-12);
}

std::vector<Waypoint> chain_through(const std::vector<Vec3>& tips, double speed) {
  std::vector<Waypoint> chain;
  for (const Vec3& tip : tips) {
    Waypoint point;
    point.tip_mm = tip;
    if (!chain.empty()) point.duration_s = (tip - chain.back().tip_mm).norm() / speed;
    chain.push_back(point);
  }
  return chain;
}

TEST(SetBlends, RadiusKeepsCornerCutAndNeighbours) {
  for (const double degrees : {1.0, 5.0, 20.0, 45.0, 80.0, 120.0, 155.0, 179.0}) {
    const double turn = degrees * kDegree;
    auto chain =
        chain_through({Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(4 + 3 * std::cos(turn), 3 * std::sin(turn), 0)}, 4.0);
    set_blends(chain, Tolerances{}, 500.0);
    const double r = chain[1].blend_mm;
    EXPECT_EQ(chain[0].blend_mm, 0.0);
    EXPECT_EQ(chain[2].blend_mm, 0.0);
    EXPECT_LE(r, 0.4 * 3.0);
    EXPECT_LE(r * std::tan(turn / 4), 0.05 + 1e-9);
    EXPECT_TRUE(degrees < 150 || r == 0.0);
    EXPECT_TRUE(degrees > 50 || r > 0.1);
    EXPECT_TRUE(r == 0.0 || 4.0 * 4.0 <= 500.0 * r / std::tan(turn / 2) + 1e-9);
  }
}

TEST(SetBlends, FastSharpCornerStops) {
  auto chain = chain_through({Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(4, 4, 0)}, 50.0);
  set_blends(chain, Tolerances{}, 500.0);
  EXPECT_EQ(chain[1].blend_mm, 0.0);
}

}  // namespace
}  // namespace curvesup
