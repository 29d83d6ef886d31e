#include "trim/clip_piece.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace curvesup {
namespace {

// A rectangle of 6 x 3 mm at z = 0, of two triangles, as one piece of a layer 0.8 mm thick.
TrimmedSheet rectangle() {
  TrimmedSheet sheet;
  sheet.head.passes = 1;
  sheet.vertices = {{0, 0, 0}, {6, 0, 0}, {6, 3, 0}, {0, 3, 0}};
  sheet.source = {7, kNone, kNone, 9};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  sheet.triangle_tet = {4, 5};
  sheet.triangle_piece = {0, 0};
  sheet.pieces = {{.area = 18.0, .centroid = {3, 1.5, 0}, .thickness_p95 = 0.8}};
  return sheet;
}

double area(const std::vector<std::array<Vec3, 3>>& triangles) {
  double sum = 0.0;
  for (const auto& [a, b, c] : triangles) sum += 0.5 * (b - a).cross(c - a).norm();
  return sum;
}

TEST(ClipPiece, LeavesWhatRestsAndAsMuchBesideItAsTheLayerIsThick) {
  TrimmedSheet sheet = rectangle();
  std::vector<std::array<Vec3, 3>> gone;
  ASSERT_TRUE(clip_piece(sheet, 0, [](Index, const Vec3& p) { return p.x() < 2.0; }, 0.32, gone));
  ASSERT_EQ(sheet.pieces.size(), 2u);
  const Piece& left = sheet.pieces[1];
  EXPECT_NEAR(left.area, 3 * 2.8, 0.15 * 3);  // places are looked at every 0.3 mm at least
  EXPECT_NEAR(left.area + area(gone), 18.0, 1e-9);
  EXPECT_NEAR(left.centroid.x(), 0.5 * left.area / 3.0, 0.01);
  double sum = 0.0;
  for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
    EXPECT_EQ(sheet.triangle_piece[i], 1);
    EXPECT_TRUE(sheet.triangle_tet[i] == 4 || sheet.triangle_tet[i] == 5);
    for (const Index v : sheet.triangles[i]) EXPECT_LT(sheet.vertices[v].x(), 2.95);
    sum += sheet.area(i);
  }
  EXPECT_NEAR(sum, left.area, 1e-9);
  // Vertices that other sheets have, too, are still known.
  EXPECT_EQ(std::count(sheet.source.begin(), sheet.source.end(), 7), 1);
  EXPECT_EQ(sheet.source.size(), sheet.vertices.size());
}

TEST(ClipPiece, LeavesLessBesideANarrowRest) {
  TrimmedSheet sheet = rectangle();
  std::vector<std::array<Vec3, 3>> gone;
  ASSERT_TRUE(clip_piece(sheet, 0, [](Index, const Vec3& p) { return p.x() < 0.5; }, 0.32, gone));
  EXPECT_LT(sheet.pieces[1].area, 3 * 0.5 / 0.4);
  EXPECT_GT(sheet.pieces[1].area, 3 * 0.3);
}

TEST(ClipPiece, PartsThatRestApartBecomePieces) {
  TrimmedSheet sheet = rectangle();
  std::vector<std::array<Vec3, 3>> gone;
  ASSERT_TRUE(clip_piece(sheet, 0, [](Index, const Vec3& p) { return p.x() < 1.5 || p.x() > 4.5; }, 0.32, gone));
  ASSERT_EQ(sheet.pieces.size(), 3u);
  EXPECT_NEAR(sheet.pieces[1].area, sheet.pieces[2].area, 0.6);
  EXPECT_NEAR(sheet.pieces[1].area + sheet.pieces[2].area + area(gone), 18.0, 1e-9);
}

TEST(ClipPiece, LeavesASheetAsItIsWhereNothingWouldStay) {
  TrimmedSheet sheet = rectangle();
  std::vector<std::array<Vec3, 3>> gone;
  EXPECT_FALSE(clip_piece(sheet, 0, [](Index, const Vec3&) { return false; }, 0.32, gone));
  EXPECT_FALSE(clip_piece(sheet, 0, [](Index, const Vec3& p) { return p.x() < 0.4 && p.y() < 0.4; }, 0.5, gone));
  EXPECT_EQ(sheet.triangles.size(), 2u);
  EXPECT_EQ(sheet.vertices.size(), 4u);
  EXPECT_EQ(sheet.pieces.size(), 1u);
}

}  // namespace
}  // namespace curvesup
