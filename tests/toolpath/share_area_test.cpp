#include "toolpath/share_area.h"

#include <gtest/gtest.h>

#include "toolpath/tracks.h"

namespace curvesup::toolpath {
namespace {

// A patch of 1.2 x 0.8 mm that runs out into a ribbon of 2 mm, thinner than any bead.
PieceMesh patch_with_ribbon(double ribbon) {
  return sheets::only_piece(sheets::mapped_grid(32, 4, [=](double u, double v) {
    const double x = 3.2 * u;
    return Vec3(x, (v - 0.5) * (x <= 1.2 ? 0.8 : ribbon), 10.0);
  }));
}

TEST(ShareArea, CutsTheEndThatNothingBelongsToAndKeepsTheVolume) {
  const BeadWidths beads;
  for (const double ribbon : {0.01, 0.05}) {
    const PieceMesh mesh = patch_with_ribbon(ribbon);
    const std::vector<char> irregular(mesh.triangles.size(), 1);
    for (const bool turned : {false, true}) {
      Track track = sheets::track_through(mesh, sheets::line({0.1, 0, 10}, {3.1, 0, 10}));
      track.kind = PathKind::centre_line;
      if (turned) turn_round(track);
      for (TrackPoint& p : track.points) p.height = 0.8;
      std::vector<Track> tracks = {track};
      share_area(mesh, irregular, beads, tracks);
      ASSERT_EQ(tracks.size(), 1u);
      double farthest = 0.0, area = 0.0;
      const auto& points = tracks[0].points;
      for (std::size_t i = 0; i < points.size(); ++i) {
        farthest = std::max(farthest, points[i].position.x());
        if (i > 0) area += points[i].width * (points[i].position - points[i - 1].position).norm();
      }
      EXPECT_LT(farthest, 2.6) << ribbon;  // a stretch is up to a width and a half long
      EXPECT_NEAR(area, mesh.area, 0.05 * mesh.area) << ribbon;
    }
  }
}

}  // namespace
}  // namespace curvesup::toolpath
