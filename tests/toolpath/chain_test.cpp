#include "toolpath/chain.h"

#include <gtest/gtest.h>

#include "toolpath/tracks.h"

namespace curvesup::toolpath {
namespace {

struct Plane {
  PieceMesh mesh = sheets::only_piece(sheets::strip(20, 20, 25, 25));
  std::vector<Track> tracks;
  std::vector<char> irregular = std::vector<char>(mesh.triangles.size(), 0);

  void add_line(const Vec3& from, const Vec3& to) { tracks.push_back(sheets::track_through(mesh, sheets::line(from, to))); }
  void add_circle(const Vec3& centre, double radius) { tracks.push_back(sheets::track_through(mesh, sheets::circle(centre, radius), true)); }
  void chain(double reach) { chain_tracks(mesh, reach, tracks, irregular); }
  [[nodiscard]] double length() const {
    double sum = 0.0;
    for (const Track& track : tracks) sum += length_of(track);
    return sum;
  }
  [[nodiscard]] double step_length() const {
    double sum = 0.0;
    for (const Track& track : tracks) {
      for (std::size_t i = 1; i < track.points.size(); ++i) {
        if (track.points[i].step) sum += (track.points[i].position - track.points[i - 1].position).norm();
      }
    }
    return sum;
  }
};

TEST(ChainTracks, JoinsLinesByTheirNearestEnds) {
  Plane plane;
  for (int i = 0; i < 5; ++i) plane.add_line({3, 5 + 0.9 * i, 10}, {15, 5 + 0.9 * i, 10});
  plane.chain(1.5);
  ASSERT_EQ(plane.tracks.size(), 1u);  // there and back, like a plough
  EXPECT_NEAR(plane.length(), 5 * 12 + 4 * 0.9, 1e-9);
  EXPECT_NEAR(plane.step_length(), 4 * 0.9, 1e-9);
  EXPECT_GT(std::count(plane.irregular.begin(), plane.irregular.end(), 1), 0);
}

TEST(ChainTracks, TakesTheShortestStepFirst) {
  Plane plane;
  plane.add_line({2, 5, 10}, {6, 5, 10});
  plane.add_line({7.4, 5, 10}, {12, 5, 10});  // 1.4 from the first ...
  plane.add_line({7.0, 5.6, 10}, {7.0, 9, 10});  // ... and this one is nearer to both
  plane.chain(1.5);
  ASSERT_EQ(plane.tracks.size(), 2u);
  EXPECT_NEAR(plane.step_length(), std::hypot(0.4, 0.6), 1e-9);
}

TEST(ChainTracks, StaysApartBeyondItsReach) {
  Plane plane;
  plane.add_line({2, 5, 10}, {6, 5, 10});
  plane.add_line({7.6, 5, 10}, {12, 5, 10});
  plane.chain(1.5);
  EXPECT_EQ(plane.tracks.size(), 2u);
  EXPECT_EQ(plane.step_length(), 0.0);
}

TEST(ChainTracks, OpensLoopsWhereTheyAreNearest) {
  Plane plane;
  for (const double x : {5.0, 10.0, 15.0}) plane.add_circle({x, 10, 10}, 2.0);
  const double before = plane.length();
  plane.chain(1.5);
  // The middle one is opened at one place only: it cannot reach both others.
  ASSERT_EQ(plane.tracks.size(), 2u);
  EXPECT_NEAR(plane.length(), before + 1.0, 0.01 * before);  // arcs are laid as chords
  EXPECT_NEAR(plane.step_length(), 1.0, 1e-2);
  EXPECT_EQ(std::count_if(plane.tracks.begin(), plane.tracks.end(), [](const Track& t) { return t.closed; }), 1);
}

TEST(ChainTracks, RunsALoopBetweenTwoLines) {
  Plane plane;
  plane.add_line({2, 10, 10}, {6, 10, 10});
  plane.add_circle({9, 10, 10}, 2.0);
  plane.add_line({6.2, 8.9, 10}, {3, 6, 10});
  const double before = plane.length();
  plane.chain(1.6);
  ASSERT_EQ(plane.tracks.size(), 1u);
  EXPECT_FALSE(plane.tracks[0].closed);
  EXPECT_NEAR(plane.length(), before + plane.step_length(), 0.05);
}

// A chain takes widths as rings do as soon as there is one in it, even one that ends on a step between rings.
TEST(ChainTracks, IsAContourWithARingInIt) {
  for (const bool ends_on_step : {false, true}) {
    Plane plane;
    plane.add_line({2, 5, 10}, {6, 5, 10});
    plane.tracks.back().kind = PathKind::centre_line;
    plane.add_line({7, 5, 10}, {12, 5, 10});
    plane.tracks.back().points.back().step = ends_on_step;
    plane.chain(1.5);
    ASSERT_EQ(plane.tracks.size(), 1u);
    EXPECT_EQ(plane.tracks[0].kind, PathKind::contour) << ends_on_step;
  }
}

TEST(ChainTracks, NeverStepsAcrossAGap) {
  const auto sheet = sheets::mapped_grid(
      40, 40, [](double u, double v) { return Vec3(20 * u, 20 * v, 10); }, 0.8, false,
      [](double u, double v) { return u < 0.5 || u > 0.525 || v > 0.9; });
  Plane plane;
  plane.mesh = sheets::only_piece(sheet);
  plane.irregular.assign(plane.mesh.triangles.size(), 0);
  plane.add_line({4, 5, 10}, {9.8, 5, 10});
  plane.add_line({10.7, 5, 10}, {16, 5, 10});
  plane.chain(1.5);
  EXPECT_EQ(plane.tracks.size(), 2u);
}

}  // namespace
}  // namespace curvesup::toolpath
