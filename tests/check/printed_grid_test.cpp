#include "check/printed_grid.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "check/sheet_pieces.h"

namespace curvesup::certificate {
namespace {

// Small triangles strewn over a box, each in a tet of its own; a layer is 0.3 mm thick in most tets and up to 300 mm in some.
struct Strewn {
  Model model;
  Domain domain;
  ScalarField field;
  LayerStack stack;
  std::mt19937 random{7};

  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random); }
  Vec3 point(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

  explicit Strewn(Index count) {
    stack.count = 10;
    stack.sheets = {{.material = Material::model, .first_triangle = 0, .triangle_count = count / 2},
                    {.passes = 2, .material = Material::support, .first_triangle = count / 2, .triangle_count = count - count / 2}};
    for (Index t = 0; t < count; ++t) {
      const Vec3 middle = point(12.0);
      for (int c = 0; c < 3; ++c) stack.vertices.push_back(middle + point(0.7));
      stack.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
      stack.triangle_tet.push_back(t);
      const double thickness = 0.3 * (t % 7 == 0 ? std::pow(10.0, uniform(0.0, 3.0)) : uniform(0.8, 1.2));
      field.gradient.push_back(point(1.0).normalized() / (thickness * stack.count));
    }
  }
};

TEST(PrintedGrid, FindsEveryTriangleBelowHoweverThick) {
  Strewn strewn(3000);
  const SupportCertificateOptions options;
  const RunContext run;
  const Subject subject{strewn.model, strewn.domain, strewn.field, strewn.stack, options, run};
  for (const Material material : {Material::model, Material::support}) {
    const PrintedGrid grid(subject, material);
    const Sheet& sheet = strewn.stack.sheets[static_cast<int>(material)];
    Index expected_in_all = 0;
    for (int query = 0; query < 200; ++query) {
      const Vec3 q = strewn.point(13.0), down = strewn.point(1.0).normalized();
      const double thickness = strewn.uniform(0.1, 2.0), gap = strewn.uniform(0.0, 0.5), radius = strewn.uniform(0.0, 1.0);
      std::set<Index> visited;
      grid.visit_below(q, down, thickness, gap, radius, [&](Index t) {
        visited.insert(t);
        return false;
      });
      for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
        const double reach = 1.5 * std::max(thickness, subject.thickness(t, sheet.passes)) + gap;
        // Points of the triangle, one of them in the cylinder: it must have been visited.
        const auto [a, b, c] = corners_of(strewn.stack, t);
        bool inside = false;
        for (int i = 0; i <= 4; ++i) {
          for (int j = 0; i + j <= 4; ++j) {
            const Vec3 way = a + 0.25 * i * (b - a) + 0.25 * j * (c - a) - q;
            const double depth = way.dot(down);
            inside = inside || (depth >= 0.0 && depth <= reach && (way - depth * down).norm() <= radius);
          }
        }
        expected_in_all += inside;
        EXPECT_TRUE(!inside || visited.contains(t)) << "triangle " << t << " of thickness " << subject.thickness(t, sheet.passes);
      }
      for (const Index t : visited) EXPECT_EQ(&grid.sheet(t), &sheet);
    }
    EXPECT_GT(expected_in_all, 100);
  }
}

TEST(PrintedGrid, SearchesNoFartherThanTrianglesReach) {
  Strewn strewn(3000);
  for (Vec3& g : strewn.field.gradient) g = Vec3::UnitZ() / (0.3 * strewn.stack.count);
  const SupportCertificateOptions options;
  const RunContext run;
  const Subject subject{strewn.model, strewn.domain, strewn.field, strewn.stack, options, run};
  const PrintedGrid grid(subject, Material::model);
  int visited = 0;
  grid.visit_below(Vec3::Zero(), -Vec3::UnitZ(), 0.3, 0.0, 0.4, [&](Index t) {
    ++visited;
    for (const Vec3& corner : corners_of(strewn.stack, t)) EXPECT_LT(corner.norm(), 5.0);
    return false;
  });
  EXPECT_LT(visited, 50);
  EXPECT_FALSE(PrintedGrid().visit_below(Vec3::Zero(), -Vec3::UnitZ(), 0.3, 0.0, 0.4, [](Index) { return true; }));
}

}  // namespace
}  // namespace curvesup::certificate
