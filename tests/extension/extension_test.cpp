#include "curvesup/extension/extension.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "curvesup/core/error.h"
#include "extension/least_squares.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

DomainResult around(const Model& model) { return mesh_domain(model, shapes::box_surface(Vec3(-6, -6, -6), Vec3(36, 16, 24), 6)); }

template <typename Function>
ScalarField field_of(const Model& model, Function&& function) {
  std::vector<double> value;
  for (const Vec3& p : model.mesh.vertices) value.push_back(function(p));
  return make_scalar_field(model.mesh, value);
}

// Extrema off the hull, by the plain definition.
Index extrema_by_brute_force(const Domain& domain, const std::vector<double>& value) {
  Index count = 0;
  for (Index v = domain.model_vertices; v < static_cast<Index>(domain.mesh.vertices.size()); ++v) {
    if (domain.vertex_flags[v] & Domain::kOnHull) continue;
    double low = value[v], high = value[v];
    for (const auto& tet : domain.mesh.tets) {
      if (std::find(tet.begin(), tet.end(), v) == tet.end()) continue;
      for (const Index w : tet) {
        low = std::min(low, value[w]);
        high = std::max(high, value[w]);
      }
    }
    count += low == value[v] || high == value[v];
  }
  return count;
}

TEST(Extension, AnUprightLinearFieldStaysLinear) {
  for (const Model& model : {shapes::block_on_legs(), shapes::floating_slab()}) {
    const DomainResult domain = around(model);
    const ScalarField field = field_of(model, [](const Vec3& p) { return 0.1 + p.z() / 20.0; });
    const ExtensionResult result = extend_field(domain.domain, field, 40);
    for (std::size_t v = 0; v < domain.domain.mesh.vertices.size(); ++v) {
      EXPECT_NEAR(result.field.value[v], 0.1 + domain.domain.mesh.vertices[v].z() / 20.0, 1e-9);
    }
    EXPECT_NEAR(result.report.thickness_p1_mm, 0.5, 1e-6);
    EXPECT_NEAR(result.report.thickness_p99_mm, 0.5, 1e-6);
    EXPECT_EQ(result.report.false_extrema, 0);
    EXPECT_GT(result.report.hull_extrema, 0);  // the corners of the box
    for (const Check& check : result.report.checks) EXPECT_TRUE(check.ok) << check.name;
  }
}

TEST(Extension, ATiltedLinearFieldStaysLinearWithoutFloorAndOutflow) {
  const Model model = shapes::block_on_legs();
  const DomainResult domain = around(model);
  const auto linear = [](const Vec3& p) { return p.dot(Vec3(0.01, -0.02, 0.04)); };
  ExtensionOptions options;
  options.floor_weight = 0.0;
  options.outflow_weight = 0.0;
  const ExtensionResult result = extend_field(domain.domain, field_of(model, linear), 40, options);
  for (std::size_t v = 0; v < domain.domain.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(result.field.value[v], linear(domain.domain.mesh.vertices[v]), 1e-8);
  }
}

// Moves a free vertex until one of its tets has next to no height, and no other one has; false where none can be moved so.
bool flatten_a_tet(Domain& domain) {
  TetMesh& mesh = domain.mesh;
  for (Index t = domain.model_tets; t < static_cast<Index>(mesh.tets.size()); ++t) {
    for (int c = 0; c < 4; ++c) {
      const Index v = mesh.tets[t][c];
      if (v < domain.model_vertices || (domain.vertex_flags[v] & Domain::kOnHull)) continue;
      const auto face = face_vertices(mesh.tets[t], c);
      const Vec3 a = mesh.vertices[face[0]], was = mesh.vertices[v];
      const Vec3 n = area_normal(a, mesh.vertices[face[1]], mesh.vertices[face[2]]).normalized();
      mesh.vertices[v] -= (1.0 - 1e-14) * n.dot(was - a) * n;
      bool good = true;
      for (Index other = 0; other < static_cast<Index>(mesh.tets.size()); ++other) {
        const auto& corners = mesh.tets[other];
        if (other != t && std::find(corners.begin(), corners.end(), v) != corners.end()) good = good && tet_volume(mesh, other) > 1e-2;
      }
      if (good) return true;
      mesh.vertices[v] = was;
    }
  }
  return false;
}

TEST(Extension, ATetWithoutHeightDoesNoHarm) {
  const Model model = shapes::block_on_legs();
  DomainResult domain = around(model);
  ASSERT_TRUE(flatten_a_tet(domain.domain));
  const ScalarField field = field_of(model, [](const Vec3& p) { return 0.1 + p.z() / 20.0; });
  const ExtensionResult result = extend_field(domain.domain, field, 40);
  for (std::size_t v = 0; v < domain.domain.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(result.field.value[v], 0.1 + domain.domain.mesh.vertices[v].z() / 20.0, 1e-9);
  }
  for (const Vec3& gradient : result.field.gradient) EXPECT_NEAR((gradient - Vec3(0, 0, 0.05)).norm(), 0.0, 1e-6);
  for (const Check& check : result.report.checks) EXPECT_TRUE(check.ok) << check.name;
}

TEST(Extension, KeepsTheModelsValuesToTheBit) {
  const Model model = shapes::block_on_legs();
  const DomainResult domain = around(model);
  const ScalarField field = field_of(model, [](const Vec3& p) { return p.z() / 20.0 + 0.1 * std::sin(0.2 * p.x()); });
  const ExtensionResult result = extend_field(domain.domain, field, 40);
  ASSERT_EQ(result.field.value.size(), domain.domain.mesh.vertices.size());
  ASSERT_EQ(result.field.gradient.size(), domain.domain.mesh.tets.size());
  for (std::size_t v = 0; v < field.value.size(); ++v) EXPECT_EQ(result.field.value[v], field.value[v]);
}

TEST(Extension, ACurvedFieldHasNoFalseExtrema) {
  const Model model = shapes::block_on_legs();
  const DomainResult domain = around(model);
  const ScalarField field = field_of(model, [](const Vec3& p) { return p.z() / 20.0 + 0.1 * std::sin(0.2 * p.x()); });
  const ExtensionResult result = extend_field(domain.domain, field, 40);
  EXPECT_EQ(result.report.false_extrema, 0);
  EXPECT_EQ(extrema_by_brute_force(domain.domain, result.field.value), 0);
  EXPECT_LT(result.report.residual, 1e-10);
}

TEST(Extension, OutflowTermTurnsLayersAtTheSide) {
  const Model model = shapes::floating_slab();
  const DomainResult domain = around(model);
  // Layers tilted so that -grad G leaves the hull through the side x = 36.
  const ScalarField field = field_of(model, [](const Vec3& p) { return (p.z() - 0.8 * p.x()) / 20.0; });
  const auto mean_sideways = [&](double weight) {
    ExtensionOptions options;
    options.outflow_weight = weight;
    const ExtensionResult result = extend_field(domain.domain, field, 40, options);
    double sum = 0.0, area = 0.0;
    for (const BoundaryFace& face : boundary_faces(domain.domain.mesh, domain.domain.topology)) {
      const auto& p = domain.domain.mesh.vertices;
      const Vec3 n = area_normal(p[face.vertices[0]], p[face.vertices[1]], p[face.vertices[2]]);
      if (n.normalized().x() < 0.9) continue;
      sum += std::max(0.0, -result.field.gradient[face.tet].dot(n));
      area += n.norm();
    }
    return sum / area;
  };
  EXPECT_GT(mean_sideways(0.0), 0.02);
  EXPECT_LT(mean_sideways(1000.0), 0.3 * mean_sideways(0.0));
}

TEST(Extension, SameBytesForAnyThreadCount) {
  const Model model = shapes::block_on_legs(1.0);
  const DomainResult domain = around(model);
  const ScalarField field = field_of(model, [](const Vec3& p) { return p.z() / 20.0 + 0.1 * std::sin(0.2 * p.x()); });
  RunContext two;
  two.threads = 2;
  const ExtensionResult a = extend_field(domain.domain, field, 40), b = extend_field(domain.domain, field, 40, {}, two);
  EXPECT_EQ(a.field.value, b.field.value);
}

// Against dense normal equations.
TEST(LeastSquares, AgreesWithADenseSolve) {
  constexpr Index kUnknowns = 30;
  std::vector<LeastSquaresRow> rows;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(kUnknowns, kUnknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kUnknowns);
  std::uint32_t state = 12345;
  const auto next = [&] { return (state = state * 1664525u + 1013904223u) >> 8; };
  for (int r = 0; r < 200; ++r) {
    LeastSquaresRow row;
    const Index first = static_cast<Index>(next() % kUnknowns);
    Eigen::VectorXd dense = Eigen::VectorXd::Zero(kUnknowns);
    for (int c = 0; c < 1 + static_cast<int>(next() % 5); ++c) {
      const Index column = (first + 3 * c) % kUnknowns;
      row.add(column, (next() % 1000) / 500.0 - 1.0);
      dense[column] += row.coefficient[c];
    }
    row.target = (next() % 1000) / 100.0;
    row.weight = 0.5 + (next() % 1000) / 1000.0;
    matrix += row.weight * dense * dense.transpose();
    right += row.weight * row.target * dense;
    rows.push_back(row);
  }
  LeastSquaresSolver solver(kUnknowns, rows);
  const Eigen::VectorXd expected = matrix.ldlt().solve(right);
  for (int repeat = 0; repeat < 2; ++repeat) {
    const std::vector<double> x = solver.solve(rows);
    for (Index i = 0; i < kUnknowns; ++i) EXPECT_NEAR(x[i], expected[i], 1e-9);
    EXPECT_LT(solver.residual(), 1e-12);
  }
}

TEST(LeastSquares, SingularIsAnError) {
  LeastSquaresRow row;
  row.add(0, 1.0);
  row.add(1, -1.0);
  row.weight = 1.0;
  const std::vector<LeastSquaresRow> rows = {row, row};
  LeastSquaresSolver solver(3, rows);
  EXPECT_THROW((void)solver.solve(rows), Error);
}

}  // namespace
}  // namespace curvesup
