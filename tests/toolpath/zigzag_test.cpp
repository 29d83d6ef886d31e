#include "toolpath/zigzag.h"

#include <gtest/gtest.h>

#include "curvesup/core/error.h"
#include "curvesup/toolpath/plan_toolpaths.h"
#include "toolpath/tracks.h"

namespace curvesup::toolpath {
namespace {

constexpr double kWidth = 0.8;

struct Lines {
  std::vector<Track> tracks;

  Lines(const sheets::NamedSheet& sheet, const ZigzagOptions& options) {
    const BorderDistance distance(sheets::only_piece(sheet), {});
    const Ridge ridge(distance, {});
    tracks = trace_lines(distance, ridge, options);
  }
  [[nodiscard]] double length() const {
    double sum = 0.0;
    for (const Track& track : tracks) sum += length_of(track);
    return sum;
  }
};

TEST(DistanceFromSection, IsThatFromTheCutOnAPlane) {
  // Cells of uneven sides and a slanting plane: inside a convex piece nothing is in the way of the straight line.
  const PieceMesh mesh = sheets::only_piece(sheets::strip(10, 7, 23, 31));
  const Vec3 origin(4.1, 3.3, 10), direction = Vec3(2, 1, 0).normalized();
  const Vec3 low = origin + 3.3 / 2.0 * Vec3(1, -2, 0), high = origin + 3.7 / 2.0 * Vec3(-1, 2, 0);  // at y = 0 and 7
  const auto distance = distance_from_section(mesh, origin, direction);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Vec3& p = mesh.vertices[v];
    const double exact = (closest_point_on_segment(p, low, high) - p).norm();
    EXPECT_NEAR(std::abs(distance[v]), exact, 0.04 + 0.01 * exact) << p.transpose();
    EXPECT_EQ(distance[v] < 0.0, direction.dot(p - origin) < 0.0);
  }
}

TEST(DistanceFromSection, IsTheArcOnACylinder) {
  const double radius = 8.0;
  const PieceMesh mesh = sheets::only_piece(sheets::cylinder(radius, 2.4, 10.0, 60, 24));
  const auto distance = distance_from_section(mesh, Vec3(0, 0, 0), Vec3::UnitX());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double arc = radius * std::asin(mesh.vertices[v].x() / radius);
    EXPECT_NEAR(distance[v], arc, 0.005 * radius);
  }
}

TEST(TraceLines, FillsARectangleWithEvenLines) {
  // 20 x 10 with lines along y: between the insets 17.6 of x, at (j + 1/2) 0.8 from a multiple of 0.8.
  const Lines lines(sheets::strip(20, 10, 40, 20), {.spacing = kWidth, .inset = 1.2});
  ASSERT_GE(lines.tracks.size(), 21u);
  ASSERT_LE(lines.tracks.size(), 23u);
  std::vector<double> places;
  for (const Track& track : lines.tracks) {
    EXPECT_EQ(track.kind, PathKind::infill);
    EXPECT_NEAR(length_of(track), 10 - 2 * 1.2, 0.02);
    places.push_back(track.points.front().position.x());
    for (const TrackPoint& p : track.points) EXPECT_NEAR(p.position.x(), places.back(), 1e-6);
  }
  std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_NEAR(places[i] - places[i - 1], kWidth, 1e-6);
  const double phase = places.front() / kWidth - 0.5;
  EXPECT_NEAR(phase, std::round(phase), 1e-6);
}

TEST(TraceLines, StandOverEachOtherInShiftedPieces) {
  auto sheet = sheets::strip(20, 10, 40, 20);
  const Lines lines(sheet, {.spacing = 2.4, .inset = 1.2});
  for (Vec3& v : sheet.stack.vertices) v += Vec3(0.7, 0.3, 0.8);
  const Lines shifted(sheet, {.spacing = 2.4, .inset = 1.2});
  const auto phase = [](const Lines& l) { return std::fmod(l.tracks.front().points.front().position.x(), 2.4); };
  EXPECT_NEAR(phase(lines), phase(shifted), 1e-6);
}

TEST(TraceLines, AreAsFarApartAlongASlope) {
  // A plane that rises by 60 degrees along x: in plan the lines are half as far apart.
  const auto sheet = sheets::mapped_grid(40, 20, [](double u, double v) { return Vec3(10 * u, 10 * v, 10 + 10 * std::sqrt(3.0) * u); });
  const Lines lines(sheet, {.spacing = kWidth, .inset = 1.2});
  std::vector<double> places;
  for (const Track& track : lines.tracks) places.push_back(track.points.front().position.x());
  std::sort(places.begin(), places.end());
  ASSERT_GT(places.size(), 15u);
  for (std::size_t i = 1; i < places.size(); ++i) EXPECT_NEAR(places[i] - places[i - 1], 0.5 * kWidth, 1e-3);
}

TEST(TraceLines, TurnByTheAngle) {
  const Lines lines(sheets::strip(20, 10, 40, 20), {.spacing = kWidth, .inset = 1.1, .angle = 0.5 * std::numbers::pi});
  for (const Track& track : lines.tracks) EXPECT_NEAR(length_of(track), 20 - 2 * 1.1, 0.02);
  EXPECT_EQ(lines.tracks.size(), 10u);  // at 1.2, 2.0, ... 8.4
}

TEST(TraceLines, ShortLinesAndNarrowPlacesAreLeftOut) {
  const auto strip = sheets::strip(20, 4, 40, 10);
  EXPECT_FALSE(Lines(strip, {.spacing = kWidth, .inset = 1.2}).tracks.empty());
  EXPECT_TRUE(Lines(strip, {.spacing = kWidth, .inset = 1.2, .shortest = 1.7}).tracks.empty());
  EXPECT_TRUE(Lines(strip, {.spacing = kWidth, .inset = 1.2, .narrowest = 2.1}).tracks.empty());
}

TEST(TraceLines, RunRoundAHole) {
  const auto ring = sheets::annulus(3, 12, 120, 24);
  const Lines lines(ring, {.spacing = kWidth, .inset = 1.2});
  for (const Track& track : lines.tracks) {
    for (const TrackPoint& p : track.points) {
      const double r = std::hypot(p.position.x(), p.position.y());
      EXPECT_GT(r, 4.2 - 0.05);
      EXPECT_LT(r, 10.8 + 0.05);
    }
  }
  const double area = std::numbers::pi * (10.8 * 10.8 - 4.2 * 4.2);
  EXPECT_NEAR(lines.length() * kWidth / area, 1.0, 0.03);
}

// ---- as part of the plan

ToolpathResult plan(const sheets::NamedSheet& sheet, const ToolpathOptions& options, int threads = 1) {
  RunContext run;
  run.threads = threads;
  return plan_toolpaths(sheet.gradient, sheet.stack, options, run);
}

ToolpathOptions zigzag() {
  ToolpathOptions options;
  for (auto& material : options.material) material.pattern = FillPattern::contour_zigzag;
  return options;
}

double length_of_kind(const Toolpaths& toolpaths, PathKind kind) {
  double sum = 0.0;
  for (const Path& path : toolpaths.paths) {
    if (path.kind != kind) continue;
    for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
      sum += (toolpaths.points[k].position - toolpaths.points[k - 1].position).norm();
    }
  }
  return sum;
}

TEST(Zigzag, DenseLinesFillTheLayer) {
  for (const double width : {3.3, 4.1, 5.0, 6.4, 9.0, 15.0}) {
    const auto result = plan(sheets::strip(30, width, 60, static_cast<int>(2 * width)), zigzag());
    EXPECT_NEAR(result.report.volume_mm3[0] / result.report.layer_volume_mm3[0], 1.0, 0.01) << width;
    for (const PathPoint& p : result.toolpaths.points) {
      EXPECT_GE(p.width_mm, 0.2);
      EXPECT_LE(p.width_mm, 1.2);
    }
  }
  const auto cap = plan(sheets::sphere_cap(20, 0.8, 90, 24), zigzag());
  EXPECT_NEAR(cap.report.volume_mm3[0] / cap.report.layer_volume_mm3[0], 1.0, 0.01);
  EXPECT_GT(cap.report.lines, 20);
}

TEST(Zigzag, LinesOfAPieceAreOnePath) {
  const auto result = plan(sheets::strip(30, 15, 60, 30), zigzag());
  Index paths = 0;
  for (const Path& path : result.toolpaths.paths) paths += path.kind == PathKind::infill;
  EXPECT_LE(paths, 3);
  EXPECT_GT(result.report.lines, 20);
  EXPECT_LE(result.report.jumps_inside_pieces, 4);
}

TEST(Zigzag, PerimetersComeFirstAndAreCounted) {
  ToolpathOptions options = zigzag();
  for (const int perimeters : {1, 2, 4}) {
    options.material[0].perimeters = perimeters;
    EXPECT_EQ(plan(sheets::strip(30, 20, 60, 40), options).report.rings, perimeters);
  }
}

TEST(Zigzag, RingsFillWhatIsTooNarrowForThreeLines) {
  ToolpathOptions options = zigzag();
  EXPECT_EQ(plan(sheets::strip(30, 5.4, 60, 11), options).report.lines, 0);
  EXPECT_GT(plan(sheets::strip(30, 5.8, 60, 12), options).report.lines, 0);
  options.material[0].perimeters = 1;
  for (const double side : {2.8, 3.0, 3.2, 3.4, 3.6, 3.8}) {
    const auto result = plan(sheets::strip(side, side, 6, 6), options);
    EXPECT_NEAR(result.report.volume_mm3[0] / result.report.layer_volume_mm3[0], 1.0, 0.02) << side;
  }
}

TEST(Zigzag, SparseLinesKeepTheirWidthAndSpacing) {
  ToolpathOptions options = zigzag();
  for (const double spacing : {1.6, 2.4, 4.0}) {
    options.material[0].line_spacing_mm = spacing;
    options.material[0].line_angle_deg = 0.0;
    const auto result = plan(sheets::strip(60, 24, 120, 48), options);
    EXPECT_EQ(result.report.sparse_pieces, 1);
    const double inside = (60 - 3.6) * (24 - 3.6);
    const double lines = inside / spacing, turns = 60 - 3.6;
    EXPECT_NEAR(length_of_kind(result.toolpaths, PathKind::infill), lines + turns, 0.06 * lines + 2 * spacing) << spacing;
    for (const Path& path : result.toolpaths.paths) {
      if (path.kind != PathKind::infill) continue;
      for (Index k = path.first_point; k < path.first_point + path.point_count; ++k) EXPECT_EQ(result.toolpaths.points[k].width_mm, 0.8);
    }
    for (const Check& check : result.report.checks) EXPECT_NE(check.name, "toolpath.model_volume");
  }
}

TEST(Zigzag, DirectionTurnsFromLayerToLayer) {
  ToolpathOptions options = zigzag();
  options.material[0].line_angle_deg = 0.0;
  for (const Index layer : {-3, -2, 0, 1}) {
    auto sheet = sheets::strip(24, 24, 48, 48);
    sheet.stack.sheets[0].layer = layer;
    const auto result = plan(sheet, options);
    double along_x = 0.0, along_y = 0.0;
    for (const Path& path : result.toolpaths.paths) {
      if (path.kind != PathKind::infill) continue;
      for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
        const Vec3 step = result.toolpaths.points[k].position - result.toolpaths.points[k - 1].position;
        along_x += std::abs(step.x()), along_y += std::abs(step.y());
      }
    }
    EXPECT_EQ(along_y > 5 * along_x, layer % 2 == 0) << layer;
    EXPECT_EQ(along_x > 5 * along_y, layer % 2 != 0) << layer;
  }
}

TEST(Zigzag, SupportRightUnderTheModelIsDense) {
  // Two plates of support in layer 0; the model stands over the second one in layer 1.
  sheets::NamedSheet both;
  both.stack.count = 10;
  const auto add = [&](Index layer, Material material, double x) {
    const auto plate = sheets::mapped_grid(40, 40, [&](double u, double v) { return Vec3(x + 20 * u, 20 * v, 10.4 + 0.8 * layer); });
    const Index first = static_cast<Index>(both.stack.vertices.size());
    both.stack.sheets.push_back({.layer = layer, .material = material, .first_triangle = static_cast<Index>(both.stack.triangles.size()),
                                 .triangle_count = static_cast<Index>(plate.stack.triangles.size())});
    both.stack.vertices.insert(both.stack.vertices.end(), plate.stack.vertices.begin(), plate.stack.vertices.end());
    for (auto triangle : plate.stack.triangles) {
      for (Index& v : triangle) v += first;
      both.stack.triangles.push_back(triangle);
      both.stack.triangle_tet.push_back(static_cast<Index>(both.stack.triangle_tet.size()));
    }
    both.gradient.insert(both.gradient.end(), plate.gradient.begin(), plate.gradient.end());
  };
  add(0, Material::support, 0.0);
  add(0, Material::support, 30.0);
  add(1, Material::model, 35.0);
  ToolpathOptions options = zigzag();
  options.material[1].line_spacing_mm = 3.2;
  const auto result = plan(both, options);
  EXPECT_EQ(result.report.sparse_pieces, 1);
  EXPECT_EQ(result.report.interface_pieces, 1);
  double left = 0.0, right = 0.0;
  for (const Path& path : result.toolpaths.paths) {
    if (path.material != Material::support) continue;
    for (Index k = path.first_point; k < path.first_point + path.point_count; ++k) {
      (result.toolpaths.points[k].position.x() < 25 ? left : right) += result.toolpaths.points[k].volume_mm3;
    }
  }
  EXPECT_NEAR(right, 20 * 20 * 0.8, 0.01 * right);
  EXPECT_LT(left, 0.6 * right);
  options.interface_layers = 0;
  EXPECT_EQ(plan(both, options).report.sparse_pieces, 2);
}

TEST(Zigzag, SameBytesForAnyThreadCount) {
  const auto sheet = sheets::sphere_cap(20, 0.8, 90, 24);
  const auto one = plan(sheet, zigzag(), 1), three = plan(sheet, zigzag(), 3);
  ASSERT_EQ(one.toolpaths.points.size(), three.toolpaths.points.size());
  for (std::size_t i = 0; i < one.toolpaths.points.size(); ++i) {
    ASSERT_EQ(one.toolpaths.points[i].position, three.toolpaths.points[i].position);
    ASSERT_EQ(one.toolpaths.points[i].volume_mm3, three.toolpaths.points[i].volume_mm3);
  }
}

TEST(Zigzag, RefusesSpacingsThatMeanNothing) {
  ToolpathOptions options = zigzag();
  options.material[1].line_spacing_mm = 0.5;
  EXPECT_THROW(plan(sheets::strip(3, 3, 3, 3), options), Error);
  options = {};
  options.material[1].line_spacing_mm = 2.4;
  EXPECT_THROW(plan(sheets::strip(3, 3, 3, 3), options), Error);
}

}  // namespace
}  // namespace curvesup::toolpath
