#include "toolpath/border_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "toolpath/sheets.h"

namespace curvesup {
namespace {

using sheets::NamedSheet;
using toolpath::BorderDistance;

constexpr double kBead = 0.8, kLimit = 0.05 * kBead;

BorderDistance only_piece(const NamedSheet& sheet) {
  auto pieces = toolpath::split_into_pieces(sheet.stack, sheet.stack.sheets[0], sheet.gradient);
  EXPECT_EQ(pieces.size(), 1u);
  return BorderDistance(std::move(pieces.at(0)), {});
}

double largest_error(const BorderDistance& distance, const std::function<double(const Vec3&)>& truth) {
  double worst = 0.0;
  const auto& vertices = distance.mesh().vertices;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    worst = std::max(worst, std::abs(distance.distance(static_cast<Index>(v)) - truth(vertices[v])));
  }
  return worst;
}

TEST(BorderDistance, IsExactOnAPlane) {
  const auto truth = [](const Vec3& p) {
    return std::min(std::min(p.x(), 20.0 - p.x()), std::min(p.y(), 9.0 - p.y()));
  };
  EXPECT_LT(largest_error(only_piece(sheets::strip(20, 9, 17, 7)), truth), 1e-6);
}

// At an end of a strip three sides come equally near; cuts that know two of them must hear of the third.
TEST(BorderDistance, ThirdSidesAreHeardOf) {
  for (const double width : {1.1, 1.7, 2.6, 4.4}) {
    const auto truth = [&](const Vec3& p) { return std::min(std::min(p.x(), 6.4 - p.x()), std::min(p.y(), width - p.y())); };
    EXPECT_LT(largest_error(only_piece(sheets::strip(6.4, width, 8, 8)), truth), 1e-6) << width;
  }
}

// Two triangles, all of whose corners lie on the border.
TEST(BorderDistance, LooksBetweenTheCornersOfLargeTriangles) {
  for (const double width : {5.0, 6.0, 13.0, 20.0}) {
    const BorderDistance distance = only_piece(sheets::plate(20.0, width));
    const auto truth = [&](const Vec3& p) { return std::min(std::min(p.x(), 20.0 - p.x()), std::min(p.y(), width - p.y())); };
    EXPECT_LT(largest_error(distance, truth), 1e-6);
    // In between it is linear.
    double worst = 0.0;
    for (const auto& [a, b, c] : distance.mesh().triangles) {
      const auto& v = distance.mesh().vertices;
      const double linear = (distance.distance(a) + distance.distance(b) + distance.distance(c)) / 3.0;
      worst = std::max(worst, std::abs(linear - truth((v[a] + v[b] + v[c]) / 3.0)));
    }
    EXPECT_LT(worst, kLimit) << width;
  }
}

TEST(BorderDistance, KnowsHoles) {
  // A square hole: the border's inner corners are reflex, so distances to it are round there.
  const auto inside = [](double u, double v) { return std::abs(u - 0.5) > 0.2 || std::abs(v - 0.5) > 0.2; };
  const NamedSheet sheet = sheets::mapped_grid(20, 20, [](double u, double v) { return Vec3(20 * u, 20 * v, 5); }, 0.8,
                                               false, inside);
  const auto truth = [](const Vec3& p) {
    const double outer = std::min(std::min(p.x(), 20.0 - p.x()), std::min(p.y(), 20.0 - p.y()));
    const double dx = std::max(0.0, std::abs(p.x() - 10.0) - 4.0), dy = std::max(0.0, std::abs(p.y() - 10.0) - 4.0);
    return std::min(outer, std::hypot(dx, dy));
  };
  EXPECT_LT(largest_error(only_piece(sheet), truth), kLimit);
}

TEST(BorderDistance, IsUnrolledOnACylinder) {
  const double radius = 8.0, angle = 2.0, length = 12.0;
  const auto truth = [&](const Vec3& p) {
    const double a = std::atan2(p.x(), p.z() - 10.0);
    return std::min(radius * (0.5 * angle - std::abs(a)), std::min(p.y(), length - p.y()));
  };
  EXPECT_LT(largest_error(only_piece(sheets::cylinder(radius, angle, length, 40, 15)), truth), kLimit);
}

TEST(BorderDistance, FollowsASphereAndStandsDegenerateTriangles) {
  // The triangles around the top have no area and leave it open: the top is a border of no length.
  const double radius = 20.0, polar = 0.5;
  const auto truth = [&](const Vec3& p) {
    const double from_top = std::atan2(std::hypot(p.x(), p.y()), p.z() - 10.0);
    return radius * std::min(polar - from_top, from_top);
  };
  EXPECT_LT(largest_error(only_piece(sheets::sphere_cap(radius, polar, 60, 9)), truth), kLimit);
}

TEST(BorderDistance, StandsNeedles) {
  // Rows of cells 1e-7 mm high between ordinary ones.
  const auto row = [](double v) {
    const int j = static_cast<int>(v * 12 + 0.5);
    return (j / 2) * 1.5 + (j % 2 ? 1e-7 : 0.0);
  };
  const NamedSheet sheet = sheets::mapped_grid(13, 12, [&](double u, double v) { return Vec3(15 * u, row(v), 3); });
  const auto truth = [](const Vec3& p) {
    return std::min(std::min(p.x(), 15.0 - p.x()), std::min(p.y(), 9.0 - p.y()));
  };
  EXPECT_LT(largest_error(only_piece(sheet), truth), 1e-4);
}

TEST(BorderDistance, StaysBoundedOnARoughSheet) {
  // No way is shorter than the straight line in space, none longer than the one along the edges of the sheet; arcs apart.
  constexpr double kArcs = 1e-4;
  const auto noise = [](double u, double v) {
    const double x = std::sin(12.9898 * std::round(40 * u) + 78.233 * std::round(24 * v)) * 43758.5453;
    return 0.3 * (x - std::floor(x));
  };
  const NamedSheet sheet =
      sheets::mapped_grid(40, 24, [&](double u, double v) { return Vec3(48 * u, 28.8 * v, 10 + noise(u, v)); });
  const BorderDistance distance = only_piece(sheet);
  const auto& mesh = distance.mesh();
  const std::size_t n = mesh.vertices.size();
  std::vector<double> longest(n, 1e9);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      if (mesh.neighbours[t][i] == kNone) longest[mesh.triangles[t][i]] = 0.0;
    }
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& corner : mesh.triangles) {
      for (int i = 0; i < 3; ++i) {
        for (const int j : {toolpath::next3(i), toolpath::prev3(i)}) {
          const double way = longest[corner[i]] + (mesh.vertices[corner[i]] - mesh.vertices[corner[j]]).norm();
          if (way < longest[corner[j]] - 1e-12) longest[corner[j]] = way, changed = true;
        }
      }
    }
  }
  for (std::size_t v = 0; v < n; ++v) {
    const Vec3& p = mesh.vertices[v];
    const double straight = std::min(std::min(p.x(), 48.0 - p.x()), std::min(p.y(), 28.8 - p.y()));
    EXPECT_GE(distance.distance(static_cast<Index>(v)), straight - 0.05 * kBead);
    EXPECT_LE(distance.distance(static_cast<Index>(v)), longest[v] * (1.0 + kArcs));
  }
}

TEST(BorderDistance, HasVerticesWhereFrontsMeet) {
  const BorderDistance distance = only_piece(sheets::strip(20, 9, 17, 7));
  const auto& vertices = distance.mesh().vertices;
  const auto sides = [](const Vec3& p) { return std::array{p.x(), 20.0 - p.x(), p.y(), 9.0 - p.y()}; };
  ASSERT_GT(distance.meetings().size(), 20u);
  for (const auto& meeting : distance.meetings()) {
    auto to = sides(vertices[meeting.vertex]);
    std::sort(to.begin(), to.end());
    EXPECT_NEAR(to[0], distance.distance(meeting.vertex), 1e-3);
    EXPECT_NEAR(to[1], to[0], 2 * 0.04 * 1.8);  // fronts that meet very near to a vertex meet there
    EXPECT_LT(meeting.other.way.dot(distance.front(meeting.vertex).way), 0.8 * to[0] * to[0]);
  }
  // Between its ends each edge that may be cut tells the distance by a straight line, across the medial line too.
  for (const auto& edge : distance.edges().edges) {
    if ((vertices[edge.to] - vertices[edge.from]).norm() < toolpath::DistanceOptions{}.min_edge_mm) continue;
    for (const double part : {0.2, 0.4, 0.6, 0.8}) {
      const auto to = sides(vertices[edge.from] + part * (vertices[edge.to] - vertices[edge.from]));
      const double linear = (1.0 - part) * distance.distance(edge.from) + part * distance.distance(edge.to);
      EXPECT_NEAR(linear, *std::min_element(to.begin(), to.end()), kLimit);
    }
  }
}

TEST(BorderDistance, TakesTheFrontsOfOneSide) {
  const BorderDistance distance = only_piece(sheets::strip(20, 4, 40, 10));
  int joined = 0;
  for (const auto& edge : distance.edges().edges) {
    const Vec3 middle = 0.5 * (distance.mesh().vertices[edge.from] + distance.mesh().vertices[edge.to]);
    if (middle.x() < 2.5 || middle.x() > 17.5) continue;  // fronts from the ends of the strip
    const auto [one, other] = distance.alike(edge.from, edge.to);
    if (one->distance > 0.0 && other->distance > 0.0) {
      EXPECT_GT(one->way.dot(other->way), 0.0);
    }
    if (distance.meeting_of(edge.from) == kNone || distance.meeting_of(edge.to) == kNone) continue;
    if (!distance.meet_alike(edge.from, edge.to)) continue;
    ++joined;
    EXPECT_NEAR(middle.y(), 2.0, 1e-6);
  }
  EXPECT_GT(joined, 20);
}

TEST(BorderDistance, DoublesAVertexWhereTwoFansTouch) {
  // Two squares that touch in a corner only are two pieces.
  const NamedSheet sheet = sheets::mapped_grid(2, 2, [](double u, double v) { return Vec3(4 * u, 4 * v, 0); }, 0.8, false,
                                               [](double u, double v) { return (u < 0.5) == (v < 0.5); });
  EXPECT_EQ(toolpath::split_into_pieces(sheet.stack, sheet.stack.sheets[0], sheet.gradient).size(), 2u);
}

}  // namespace
}  // namespace curvesup
