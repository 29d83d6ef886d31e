#include "check/polyline_match.h"

#include <gtest/gtest.h>

#include <cmath>

namespace curvesup::emitted {
namespace {

constexpr PolylineLimits kLimits{0.031, 0.08};

double worst_vertex(const std::vector<PolylinePlace>& places) {
  double worst = 0.0;
  for (const PolylinePlace& place : places) worst = std::max(worst, place.distance);
  return worst;
}

double worst_aside(const std::vector<PolylinePlace>& places) {
  double worst = 0.0;
  for (const PolylinePlace& place : places) worst = std::max(worst, place.aside);
  return worst;
}

TEST(MatchPolylines, ThinnedArcFollowsItsSource) {
  std::vector<Vec3> source, emitted;
  for (int i = 0; i <= 60; ++i) {
    const double a = 0.02 * i;
    source.push_back(5.0 * Vec3(std::cos(a), std::sin(a), 0.0));
    if (i % 6 == 0) emitted.push_back(source.back());
  }
  const auto places = match_polylines(source, emitted, kLimits);
  ASSERT_EQ(places.size(), emitted.size());
  EXPECT_LT(worst_vertex(places), 1e-12);
  EXPECT_NEAR(worst_aside(places), 5.0 * (1.0 - std::cos(0.06)), 1e-4);
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_GE(places[i].segment, places[i - 1].segment);
}

// A hairpin: the way comes to (2, 0), makes a loop aside and passes (2, 0.01) again. The emitted vertex near the first
// pass lies nearer to the second one.
TEST(MatchPolylines, VertexNearerToALaterPassKeepsItsTurn) {
  const std::vector<Vec3> source = {Vec3(0, 0, 0),      Vec3(2, 0, 0),     Vec3(2.02, 0.02, 0), Vec3(2.1, -0.18, 0),
                                    Vec3(2.25, -0.1, 0), Vec3(1.9, 0.02, 0), Vec3(2.1, 0.02, 0),  Vec3(2.4, 1.5, 0)};
  const std::vector<Vec3> emitted = {source[0], Vec3(2.005, 0.018, 0), source[3], source[4], source[5], source[6], source[7]};
  const auto places = match_polylines(source, emitted, kLimits);
  EXPECT_LE(worst_vertex(places), kLimits.vertex);
  EXPECT_LE(worst_aside(places), kLimits.aside);
  EXPECT_LE(places[1].segment, 2u);
}

TEST(MatchPolylines, LoopThatIsNotEmittedIsFound) {
  const std::vector<Vec3> source = {Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(2, -0.3, 0), Vec3(2.2, -0.3, 0), Vec3(2.2, 0, 0), Vec3(5, 0, 0)};
  const std::vector<Vec3> emitted = {source[0], Vec3(2.1, 0, 0), source[5]};
  EXPECT_GT(worst_aside(match_polylines(source, emitted, kLimits)), 0.29);
}

TEST(MatchPolylines, VertexBesideTheWayIsFound) {
  const std::vector<Vec3> source = {Vec3(0, 0, 0), Vec3(10, 0, 0)};
  const std::vector<Vec3> emitted = {source[0], Vec3(3, 0.2, 0), source[1]};
  EXPECT_NEAR(worst_vertex(match_polylines(source, emitted, kLimits)), 0.2, 1e-12);
}

TEST(MatchPolylines, WayBackIsNotOnTheWay) {
  const std::vector<Vec3> source = {Vec3(0, 0, 0), Vec3(10, 0, 0)};
  const std::vector<Vec3> emitted = {source[0], Vec3(6, 0, 0), Vec3(4, 0, 0), source[1]};
  EXPECT_NEAR(worst_vertex(match_polylines(source, emitted, kLimits)), 2.0, 1e-12);
}

}  // namespace
}  // namespace curvesup::emitted
