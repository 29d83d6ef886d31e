#include "trim/coarsen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/solid/solid.h"
#include "layers/sheet_edges.h"
#include "trim/sheet_cutter.h"

namespace curvesup {
namespace {

// Everything between two upright cylinders about the z axis.
class Tube : public Solid {
 public:
  Tube(double inner, double outer) : inner_(inner), outer_(outer) {}
  double value(const Vec3& p) const override {
    const double r = std::hypot(p.x(), p.y());
    return std::min(outer_ - r, r - inner_);
  }
  Bounds bounds(const Vec3& centre, double radius) const override { return {value(centre) - radius, value(centre) + radius}; }

 private:
  double inner_, outer_;
};

struct CutSheet {
  TrimmedSheet sheet;
  std::vector<Vec3> gradient;  // per tet
};

// The surface z(x, y) over 20 x 20 mm, linear in each triangle of a grid, cut by the solid; each triangle is a tet's.
CutSheet cut_surface(const Solid& solid, int cells, const std::function<double(double, double)>& height) {
  CutSheet result;
  SheetCutter cutter(solid, 0.4);
  const auto at = [&](int i, int j) { return j * (cells + 1) + i; };
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      // Off the grid by a little, so that some triangles are flatter than others.
      const double x = 20.0 * i / cells - 10.0 + 0.3 * std::sin(7.0 * i + 3.0 * j), y = 20.0 * j / cells - 10.0 + 0.3 * std::cos(5.0 * i - 2.0 * j);
      (void)cutter.add_vertex(Vec3(x, y, height(x, y)));
    }
  }
  const auto add = [&](std::array<Index, 3> t) {
    const auto& v = cutter.vertices();
    const double thickness = 0.6 + 0.02 * (static_cast<double>(result.gradient.size() % 7) - 3.0) / 3.0;
    result.gradient.push_back((v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).normalized() / thickness);
    cutter.add_polygon(t, static_cast<Index>(result.gradient.size()) - 1);
  };
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      add({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      add({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  result.sheet.vertices = cutter.vertices();
  result.sheet.source.assign(cutter.vertices().size(), kNone);
  result.sheet.triangles = cutter.triangles();
  result.sheet.triangle_tet = cutter.triangle_tet();
  return result;
}

double flat(double, double) { return 5.0; }
double folded(double x, double y) { return 5.0 + 0.2 * std::abs(x - 0.37) + 0.1 * y; }
double dome(double x, double y) { return 5.0 - (x * x + y * y) / 120.0; }

double area_of(const TrimmedSheet& sheet) {
  double sum = 0.0;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) sum += sheet.area(t);
  return sum;
}

std::vector<std::array<Vec3, 2>> border_of(const TrimmedSheet& sheet) {
  std::vector<std::array<Vec3, 2>> border;
  for (const SheetEdge& e : sheet_edges(sheet.triangles)) {
    if (e.border()) border.push_back({sheet.vertices[e.low], sheet.vertices[e.high]});
  }
  return border;
}

// Farthest that any place on border a is from border b.
double distance_from_to(const std::vector<std::array<Vec3, 2>>& a, const std::vector<std::array<Vec3, 2>>& b) {
  double farthest = 0.0;
  for (const auto& [from, to] : a) {
    const int steps = 1 + static_cast<int>((to - from).norm() / 0.02);
    for (int i = 0; i <= steps; ++i) {
      const Vec3 p = from + static_cast<double>(i) / steps * (to - from);
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& [c, d] : b) nearest = std::min(nearest, (closest_point_on_segment(p, c, d) - p).norm());
      farthest = std::max(farthest, nearest);
    }
  }
  return farthest;
}

double border_distance(const TrimmedSheet& before, const TrimmedSheet& after) {
  const auto a = border_of(before), b = border_of(after);
  return std::max(distance_from_to(a, b), distance_from_to(b, a));
}

// Vertices less edges plus triangles; -1 where an edge has more than two triangles or two that disagree.
int euler_characteristic(const TrimmedSheet& sheet) {
  std::set<Index> used;
  for (const auto& t : sheet.triangles) used.insert(t.begin(), t.end());
  const auto edges = sheet_edges(sheet.triangles);
  if (!std::all_of(edges.begin(), edges.end(), [](const SheetEdge& e) { return e.manifold(); })) return -1;
  return static_cast<int>(used.size()) - static_cast<int>(edges.size()) + static_cast<int>(sheet.triangles.size());
}

double height_of(const TrimmedSheet& sheet, std::size_t t) {
  const auto& [a, b, c] = sheet.triangles[t];
  const auto& v = sheet.vertices;
  return 2.0 * sheet.area(t) / std::max({(v[b] - v[a]).norm(), (v[c] - v[b]).norm(), (v[a] - v[c]).norm()});
}

double least_height(const TrimmedSheet& sheet) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) least = std::min(least, height_of(sheet, t));
  return least;
}

// Each triangle faces along the gradient of its tet, and its corners are within `tolerance` of the plane of that tet in `before`.
void expect_planes_kept(const CutSheet& before, const TrimmedSheet& after, double tolerance) {
  std::vector<Vec3> point(before.gradient.size(), Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t t = 0; t < before.sheet.triangles.size(); ++t) {
    point[before.sheet.triangle_tet[t]] = before.sheet.vertices[before.sheet.triangles[t][0]];
  }
  for (std::size_t t = 0; t < after.triangles.size(); ++t) {
    const Index tet = after.triangle_tet[t];
    const Vec3 normal = before.gradient[tet].normalized();
    const auto& [a, b, c] = after.triangles[t];
    EXPECT_GT((after.vertices[b] - after.vertices[a]).cross(after.vertices[c] - after.vertices[a]).dot(normal), 0.0);
    for (const Index v : after.triangles[t]) EXPECT_LE(std::abs(normal.dot(after.vertices[v] - point[tet])), tolerance + 1e-9);
  }
}

TEST(Coarsen, ARingKeepsItsAreaItsBorderAndItsHole) {
  for (const auto& surface : {flat, folded, dome}) {
    const CutSheet cut = cut_surface(Tube(2.3, 7.1), 10, surface);
    ASSERT_EQ(euler_characteristic(cut.sheet), 0);
    CoarsenOptions options;
    TrimmedSheet after = cut.sheet;
    const CoarsenReport report = coarsen(after, cut.gradient, options);
    EXPECT_LT(after.triangles.size(), 0.75 * cut.sheet.triangles.size());
    EXPECT_EQ(euler_characteristic(after), 0);
    EXPECT_NEAR(report.area_before_mm2, area_of(cut.sheet), 1e-9);
    EXPECT_NEAR(report.area_after_mm2, area_of(after), 1e-9);
    EXPECT_NEAR(report.area_after_mm2 / report.area_before_mm2, 1.0, 1e-4);
    EXPECT_NEAR(report.volume_after / report.volume_before, 1.0, options.volume);
    EXPECT_LE(border_distance(cut.sheet, after), options.border_mm + 1e-9);
    EXPECT_GE(least_height(after), std::min(0.1, least_height(cut.sheet)) - 1e-9);
    expect_planes_kept(cut, after, options.surface_mm);
  }
}

TEST(Coarsen, TheBorderMovesAsFarAsItMay) {
  const CutSheet cut = cut_surface(Tube(1.1, 4.0), 7, flat);
  std::size_t before = cut.sheet.triangles.size();
  double moved_before = 0.0;
  for (const double tolerance : {0.005, 0.02, 0.08}) {
    TrimmedSheet after = cut.sheet;
    (void)coarsen(after, cut.gradient, {.border_mm = tolerance});
    const double moved = border_distance(cut.sheet, after);
    EXPECT_LE(moved, tolerance + 1e-9);
    EXPECT_GT(moved, 0.5 * tolerance);
    EXPECT_GT(moved, moved_before);
    EXPECT_LT(after.triangles.size(), before);
    EXPECT_NEAR(area_of(after) / area_of(cut.sheet), 1.0, 1e-3);
    EXPECT_EQ(euler_characteristic(after), 0);
    before = after.triangles.size();
    moved_before = moved;
  }
}

TEST(Coarsen, ATinyPieceStaysAPiece) {
  const CutSheet cut = cut_surface(Tube(-1.0, 0.3), 10, flat);
  TrimmedSheet after = cut.sheet;
  (void)coarsen(after, cut.gradient, {.border_mm = 0.2, .surface_mm = 1.0});
  EXPECT_EQ(euler_characteristic(after), 1);
  EXPECT_GE(after.triangles.size(), 1u);
  EXPECT_GT(area_of(after), 0.5 * area_of(cut.sheet));
}

TEST(Coarsen, TheSurfaceOfADomeStaysInPlace) {
  const CutSheet cut = cut_surface(Tube(-1.0, 8.0), 30, dome);
  for (const double tolerance : {1e-9, 0.01, 0.05}) {
    TrimmedSheet after = cut.sheet;
    (void)coarsen(after, cut.gradient, {.surface_mm = tolerance, .step_volume = 1.0, .volume = 1.0});
    expect_planes_kept(cut, after, tolerance);
    double farthest = 0.0;
    for (const Vec3& p : cut.sheet.vertices) {
      if (std::hypot(p.x(), p.y()) > 7.5) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& [a, b, c] : after.triangles) {
        nearest = std::min(nearest, (closest_point_on_triangle(p, after.vertices[a], after.vertices[b], after.vertices[c]) - p).norm());
      }
      farthest = std::max(farthest, nearest);
    }
    EXPECT_LE(farthest, 2.0 * tolerance + 1e-9);
    if (tolerance > 0.02) {
      EXPECT_GT(farthest, 1e-3) << "something inside has gone";
    }
  }
}

TEST(Coarsen, NeedlesInsideAPlaneGo) {
  // Two vertices 0.01 mm apart in the middle of a square.
  CutSheet cut;
  cut.sheet.vertices = {{0, 0, 1}, {4, 0, 1}, {4, 4, 1}, {0, 4, 1}, {1.995, 2, 1}, {2.005, 2, 1}};
  cut.sheet.source = {0, 1, 2, 3, 4, 5};
  cut.sheet.triangles = {{0, 1, 4}, {1, 5, 4}, {1, 2, 5}, {2, 3, 5}, {3, 4, 5}, {3, 0, 4}};
  cut.sheet.triangle_tet = {0, 1, 2, 3, 4, 5};
  cut.gradient.assign(6, Vec3(0, 0, 2));
  ASSERT_LT(least_height(cut.sheet), 0.02);
  (void)coarsen(cut.sheet, cut.gradient);
  EXPECT_GT(least_height(cut.sheet), 1.0);
  EXPECT_NEAR(area_of(cut.sheet), 16.0, 1e-12);
}

TEST(Coarsen, NoNeedlesAreMade) {
  // A disc in rings of six, twelve, eighteen ... triangles, none of them flat.
  CutSheet cut;
  const auto start = [](int ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); };
  constexpr int kRings = 8;
  cut.sheet.vertices.push_back(Vec3(0, 0, 1));
  for (int ring = 1; ring <= kRings; ++ring) {
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = std::numbers::pi / 3.0 * i / ring;
      cut.sheet.vertices.push_back(Vec3(0.5 * ring * std::cos(angle), 0.5 * ring * std::sin(angle), 1));
    }
    const auto outer = [&](int i) { return start(ring) + i % (6 * ring); };
    const auto inner = [&](int i) { return ring == 1 ? 0 : start(ring - 1) + i % (6 * ring - 6); };
    for (int side = 0; side < 6; ++side) {
      for (int i = 0; i < ring; ++i) {
        cut.sheet.triangles.push_back({inner(side * (ring - 1) + i), outer(side * ring + i), outer(side * ring + i + 1)});
        if (i + 1 < ring) cut.sheet.triangles.push_back({inner(side * (ring - 1) + i), outer(side * ring + i + 1), inner(side * (ring - 1) + i + 1)});
      }
    }
  }
  cut.sheet.source.assign(cut.sheet.vertices.size(), kNone);
  cut.sheet.triangle_tet.assign(cut.sheet.triangles.size(), 0);
  cut.gradient.assign(1, Vec3(0, 0, 2));
  ASSERT_EQ(euler_characteristic(cut.sheet), 1);
  ASSERT_GT(least_height(cut.sheet), 0.35);
  for (const double tolerance : {0.02, 0.1, 0.3, 1.0}) {
    for (const double height : {0.1, 0.3}) {
      TrimmedSheet after = cut.sheet;
      (void)coarsen(after, cut.gradient, {.border_mm = tolerance, .height_mm = height});
      EXPECT_LT(after.triangles.size(), 0.5 * cut.sheet.triangles.size());
      EXPECT_GE(least_height(after), height - 1e-9);
      EXPECT_NEAR(area_of(after) / area_of(cut.sheet), 1.0, 5e-4);
      EXPECT_EQ(euler_characteristic(after), 1);
    }
  }
}

TEST(Coarsen, WhatIsSharedWithAnotherSheetStays) {
  const CutSheet cut = cut_surface(Tube(2.3, 7.1), 10, dome);
  TrimmedSheet before = cut.sheet;
  std::set<Index> shared;
  for (const SheetEdge& e : sheet_edges(before.triangles)) {
    if (e.border() && before.vertices[e.low].x() > 0.5 && before.vertices[e.high].x() > 0.5) shared.insert({e.low, e.high});
  }
  ASSERT_GT(shared.size(), 30u);
  for (const Index v : shared) before.source[v] = v;
  TrimmedSheet after = before;
  (void)coarsen(after, cut.gradient);
  EXPECT_LT(after.triangles.size(), before.triangles.size());
  std::set<std::pair<Index, Index>> border;
  for (const SheetEdge& e : sheet_edges(after.triangles)) {
    if (e.border()) border.insert({e.low, e.high});
  }
  for (const SheetEdge& e : sheet_edges(before.triangles)) {
    if (!e.border() || (shared.count(e.low) == 0 && shared.count(e.high) == 0)) continue;
    EXPECT_EQ(border.count({e.low, e.high}), 1u) << "an edge of the shared border";
    for (const Index v : {e.low, e.high}) EXPECT_EQ(after.vertices[v], before.vertices[v]);
  }
}

TEST(Coarsen, PiecesAndTetsGoWithTheirTriangles) {
  CutSheet cut = cut_surface(Tube(2.3, 7.1), 10, flat);
  cut.sheet.triangle_piece = cut.sheet.triangle_tet;
  TrimmedSheet first = cut.sheet, second = cut.sheet;
  (void)coarsen(first, cut.gradient);
  (void)coarsen(second, cut.gradient);
  EXPECT_EQ(first.triangle_piece, first.triangle_tet);
  ASSERT_EQ(first.triangle_tet.size(), first.triangles.size());
  EXPECT_EQ(first.triangles, second.triangles);
  ASSERT_EQ(first.vertices.size(), second.vertices.size());
  EXPECT_EQ(std::memcmp(first.vertices.data(), second.vertices.data(), first.vertices.size() * sizeof(Vec3)), 0);
}

}  // namespace
}  // namespace curvesup
