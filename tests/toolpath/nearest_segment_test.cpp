#include "toolpath/nearest_segment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace curvesup::toolpath {
namespace {

Segment make_segment(const Vec3& from, const Vec3& to, const Vec3& normal = Vec3::UnitZ()) {
  return {from, to - from, normal};
}

// Distance to the best of many points of a segment.
double sampled_distance(const Segment& s, const Vec3& place) {
  double best = 1e300;
  for (int i = 0; i <= 4000; ++i) best = std::min(best, (s.from + i / 4000.0 * s.along - place).norm());
  return best;
}

std::vector<Index> nearest_segments(const std::vector<Place>& places, const std::vector<Segment>& segments, double reach, Index guess = kNone) {
  const SegmentGrid grid(segments, 0.4 * reach);
  std::vector<Index> nearest;
  for (const Place& place : places) nearest.push_back(grid.nearest(place, reach, guess).id);
  return nearest;
}

TEST(NearestSegment, AgreesWithTryingAll) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> along(-6.0, 6.0), step(-0.7, 0.7);
  std::vector<Segment> segments;
  for (int i = 0; i < 60; ++i) {
    const Vec3 from(along(random), along(random), 0.2 * along(random));
    segments.push_back(make_segment(from, from + Vec3(step(random), step(random), step(random))));
  }
  segments.push_back(make_segment(Vec3(1, 1, 0), Vec3(1, 1, 0)));  // of no length
  std::vector<Place> places;
  for (int i = 0; i < 200; ++i) places.push_back({Vec3(along(random), along(random), 0.2 * along(random)), Vec3::UnitZ()});
  const double reach = 1.1;
  const std::vector<Index> nearest = nearest_segments(places, segments, reach);
  int found = 0;
  for (std::size_t p = 0; p < places.size(); ++p) {
    double least = 1e300;
    for (const Segment& s : segments) least = std::min(least, sampled_distance(s, places[p].position));
    if (std::abs(least - reach) < 1e-3) continue;
    ASSERT_EQ(nearest[p] != kNone, least < reach) << p;
    if (nearest[p] == kNone) continue;
    ++found;
    EXPECT_NEAR(sampled_distance(segments[nearest[p]], places[p].position), least, 1e-3);
  }
  for (const Index guess : {0, 17, 60}) EXPECT_EQ(nearest_segments(places, segments, reach, guess), nearest) << guess;
  EXPECT_GT(found, 50);
  EXPECT_LT(found, 200);
}

TEST(NearestSegment, LooksOnlyAtItsOwnSideOfAWall) {
  const std::vector<Segment> segments = {make_segment(Vec3(0, 0, 0.1), Vec3(1, 0, 0.1), -Vec3::UnitZ()),
                                         make_segment(Vec3(0, 0.4, 0), Vec3(1, 0.4, 0))};
  const std::vector<Place> places = {{Vec3(0.5, 0, 0), Vec3::UnitZ()}, {Vec3(0.5, 0, 0), -Vec3::UnitZ()}};
  EXPECT_EQ(nearest_segments(places, segments, 1.0), (std::vector<Index>{1, 0}));
}

TEST(NearestSegment, OfEqualOnesTakesTheFirst) {
  const std::vector<Segment> segments = {make_segment(Vec3(0, 1, 0), Vec3(1, 1, 0)), make_segment(Vec3(0, -1, 0), Vec3(1, -1, 0))};
  const std::vector<Place> places = {{Vec3(0.5, 0, 0), Vec3::UnitZ()}};
  EXPECT_EQ(nearest_segments(places, segments, 2.0), std::vector<Index>{0});
}

}  // namespace
}  // namespace curvesup::toolpath
