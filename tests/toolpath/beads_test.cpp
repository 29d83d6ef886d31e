#include "toolpath/beads.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "toolpath/tracks.h"

namespace curvesup::toolpath {
namespace {

// Ten cells of 0.2 mm, twenty of 4 um, ten of 0.2 mm: as across a fan of narrow triangles, which are thicker.
constexpr int kWide = 10, kNarrow = 20;
constexpr double kWideCell = 0.2, kNarrowCell = 0.004, kStart = kWide * kWideCell, kEnd = kStart + kNarrow * kNarrowCell;

double border(int cell) {
  return std::min(cell, kWide) * kWideCell + std::clamp(cell - kWide, 0, kNarrow) * kNarrowCell + std::max(0, cell - kWide - kNarrow) * kWideCell;
}

PieceMesh mesh_with_narrow_cells(double thickness_there) {
  const int cells = 2 * kWide + kNarrow;
  PieceMesh mesh = sheets::only_piece(sheets::mapped_grid(cells, 1, [&](double u, double v) {
    return Vec3(border(static_cast<int>(std::lround(u * cells))), v, 10.0);
  }));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    double x = 0.0;
    for (const Index v : mesh.triangles[t]) x += mesh.vertices[v].x() / 3.0;
    mesh.thickness[t] = x > kStart && x < kEnd ? thickness_there : 0.8;
  }
  return mesh;
}

Track thinned_track_across(const PieceMesh& mesh) {
  std::vector<Vec3> places;
  for (int i = 0; i <= 2 * kWide + kNarrow; ++i) places.push_back({border(i), 0.5, 10.0});
  Track track = sheets::track_through(mesh, places);
  thin_track(mesh, std::vector<char>(mesh.triangles.size(), 0), track);
  return track;
}

TEST(ThinTrack, OneSegmentWhereTheLayerIsEquallyThick) { EXPECT_EQ(thinned_track_across(mesh_with_narrow_cells(0.8)).points.size(), 2u); }

TEST(ThinTrack, ManyNarrowTrianglesTogetherAreNotOverlooked) {
  const Track track = thinned_track_across(mesh_with_narrow_cells(0.84));
  double on_thicker = 0.0;
  for (std::size_t i = 1; i < track.points.size(); ++i) {
    const double from = track.points[i - 1].position.x(), to = track.points[i].position.x();
    const double under = std::max(0.0, std::min(to, kEnd) - std::max(from, kStart));
    if (std::abs(track.points[i].thickness / 0.84 - 1.0) < 0.02) on_thicker += under;
  }
  EXPECT_GT(on_thicker, 0.85 * (kEnd - kStart));
}

TEST(ThinTrack, OneNarrowTriangleIsNoStretchOfItsOwn) {
  PieceMesh mesh = mesh_with_narrow_cells(0.8);
  for (std::size_t t = 2 * (kWide + 8); t < 2 * (kWide + 9); ++t) mesh.thickness[t] = 0.84;
  EXPECT_EQ(thinned_track_across(mesh).points.size(), 2u);
}

// Against a sum over many places; the layer's middle reaches from below the platform to far above it.
TEST(ClippedHeight, ItsMeanOverATriangleIsExact) {
  constexpr int kRows = 400;
  const std::vector<std::array<double, 3>> heights = {{-1.0, 0.2, 2.0}, {0.1, -0.1, 0.0}, {3.0, 1.0, 2.0}, {-2.0, -1.0, 0.9}, {0.3, 0.3, -0.8}};
  for (const auto& z : heights) {
    for (const double rise : {0.6, 1.0}) {
      double sum = 0.0;
      for (int i = 0; i < kRows; ++i) {
        for (int j = 0; i + j < kRows; ++j) {
          const double x = (i + 1.0 / 3.0) / kRows, y = (j + 1.0 / 3.0) / kRows;
          sum += clipped_height(0.8, z[0] + x * (z[1] - z[0]) + y * (z[2] - z[0]), rise);
        }
      }
      EXPECT_NEAR(mean_clipped_height(0.8, z, rise), sum / (0.5 * kRows * (kRows + 1)), 2e-3);
    }
  }
}

}  // namespace
}  // namespace curvesup::toolpath
