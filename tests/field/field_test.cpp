#include "curvesup/field/field.h"

#include <gtest/gtest.h>

#include <limits>

#include "curvesup/core/error.h"
#include "curvesup/model/place.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

TetMesh block() { return shapes::brick_mesh({0, 0, 5}, {4, 6, 15}, {4, 6, 10}); }

FieldInput values_of(const Model& model, const auto& f) {
  FieldInput input;
  for (const Vec3& p : model.mesh.vertices) input.vertex_value.push_back(f(p));
  return input;
}

const FieldOptions kScalar{.source = FieldSource::scalar_file};

TEST(Field, DirectionIsLinearFromZeroToOne) {
  const Model model = shapes::as_model(block());
  const auto result = compute_field(model, {}, {.direction = Vec3(0, 0, 3)});
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(result.field.value[v], (model.mesh.vertices[v].z() - 5) / 10, 1e-14);
  }
  EXPECT_NEAR(result.report.grad_median, 0.1, 1e-14);
  EXPECT_FALSE(result.report.flipped);
  EXPECT_TRUE(result.report.interior_minima.empty());
  EXPECT_TRUE(compute_field(model, {}, {.direction = Vec3(0, 0.1, -1)}).report.flipped);
}

TEST(Field, ScalarsAreMappedLinearlyAndTurnedUpward) {
  const Model model = shapes::as_model(block());
  const auto f = [](const Vec3& p) { return 7.0 - p.z() + 0.01 * p.x() * p.x(); };
  const auto result = compute_field(model, values_of(model, f), kScalar);
  EXPECT_TRUE(result.report.flipped);
  const auto [low, high] = std::minmax_element(result.field.value.begin(), result.field.value.end());
  EXPECT_EQ(*low, 0.0);
  EXPECT_EQ(*high, 1.0);
  const double range = result.report.input_max - result.report.input_min;
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(result.field.value[v], 1.0 - (f(model.mesh.vertices[v]) - result.report.input_min) / range, 1e-14);
  }
}

TEST(Field, VectorsGiveBackTheFieldTheyAreTheGradientOf) {
  PlaceOptions place;
  place.rotate_deg = Vec3(20, -35, 70);
  place.translate_mm = Vec3(1, 2, 30);
  const TetMesh file = block();
  const Model model = load_model("block", file, place).model;
  std::vector<double> g;
  for (const Vec3& p : model.mesh.vertices) g.push_back(p.z() + 0.02 * p.x() * p.y() - 0.01 * p.z() * p.z());
  const ScalarField exact = make_scalar_field(model.mesh, g);
  FieldInput input;
  for (const Vec3& gradient : exact.gradient) input.tet_vector.push_back(model.rotation.transpose() * gradient);
  const auto result = compute_field(model, input, {.source = FieldSource::vector_file});
  const auto [low, high] = std::minmax_element(g.begin(), g.end());
  for (std::size_t v = 0; v < g.size(); ++v) EXPECT_NEAR(result.field.value[v], (g[v] - *low) / (*high - *low), 1e-10);
  EXPECT_TRUE(result.report.inverted_tets.empty());
  EXPECT_LT(result.report.solve_residual, 1e-10);
}

TEST(Field, VectorSolveIsTheLeastSquaresMinimum) {
  // A field of vectors that is no gradient: the energy must rise whichever vertex is moved.
  const Model model = shapes::as_model(shapes::brick_mesh({0, 0, 0}, {3, 2, 2}, {3, 2, 2}));
  FieldInput input;
  for (const auto& tet : model.mesh.tets) {
    const Vec3& p = model.mesh.vertices[tet[0]];
    input.tet_vector.push_back(Vec3(-0.4 * p.y(), 0.3 * p.x(), 1.0));
  }
  const auto result = compute_field(model, input, {.source = FieldSource::vector_file});
  const double range = result.report.input_max - result.report.input_min;
  const auto energy = [&](const std::vector<double>& unit) {
    double sum = 0.0;
    for (Index t = 0; t < static_cast<Index>(model.mesh.tets.size()); ++t) {
      sum +=
          tet_volume(model.mesh, t) * (range * tet_gradient(model.mesh, t, unit) - input.tet_vector[t]).squaredNorm();
    }
    return sum;
  };
  const double best = energy(result.field.value);
  for (std::size_t v = 0; v < result.field.value.size(); ++v) {
    for (const double step : {-1e-3, 1e-3}) {
      auto moved = result.field.value;
      moved[v] += step;
      EXPECT_GT(energy(moved), best);
    }
  }
}

TEST(Field, PartsOfAConstantVectorFieldFormOneLinearFunction) {
  const Model model = shapes::as_model(
      shapes::brick_mesh({0, 0, 0}, {2, 2, 9}, {2, 2, 9}, [](const Vec3& c) { return c.z() < 3 || c.z() > 5; }));
  const FieldInput input{.vertex_value = {}, .tet_vector = std::vector<Vec3>(model.mesh.tets.size(), Vec3(0, 0, 2))};
  const auto result = compute_field(model, input, {.source = FieldSource::vector_file});
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v) {
    EXPECT_NEAR(result.field.value[v], model.mesh.vertices[v].z() / 9, 1e-12);
  }
}

TEST(Field, InteriorExtremaAreFoundAndPlateausCountOnce) {
  const Model model = shapes::as_model(block());
  const auto dip = [](const Vec3& p) { return p.z() - 30.0 * std::exp(-(p - Vec3(2, 3, 10)).squaredNorm()); };
  auto result = compute_field(model, values_of(model, dip), kScalar);
  ASSERT_EQ(result.report.interior_minima.size(), 1u);
  EXPECT_EQ(model.mesh.vertices[result.report.interior_minima[0]], Vec3(2, 3, 10));

  const auto flat_dip = [](const Vec3& p) { return (p - Vec3(2, 3, 10)).cwiseAbs().maxCoeff() < 1.1 ? 1.0 : p.z(); };
  result = compute_field(model, values_of(model, flat_dip), kScalar);
  EXPECT_EQ(result.report.interior_minima.size(), 1u);
  EXPECT_FALSE(result.report.weak_tets.empty());
}

TEST(Field, LayersThatCloseAroundAnInteriorExtremumAreCounted) {
  const Model model = shapes::as_model(block());
  for (const double sign : {-1.0, 1.0}) {
    // In the middle the value is as low (high) as anywhere, and a millimetre beside it as everywhere at that height.
    const auto bump = [&](const Vec3& p) { return p.z() + (p == Vec3(2, 3, 10) ? sign * 5.0 : 0.0); };
    const auto result = compute_field(model, values_of(model, bump), kScalar);
    const auto closed = find_closed_layers(model, result.field, result.report, 10);
    ASSERT_TRUE(closed.has_value());
    EXPECT_EQ(model.mesh.vertices[closed->vertex], Vec3(2, 3, 10));
    EXPECT_EQ(closed->around_minimum, sign < 0.0);
    EXPECT_EQ(closed->count, 4) << "out past a neighbour, a millimetre lower (higher)";
  }
  // An extremum that no layer's value separates from its surroundings is noise.
  const auto noise = [](const Vec3& p) { return p.z() + (p == Vec3(2, 3, 10) ? -1.1 : 0.0); };
  const auto result = compute_field(model, values_of(model, noise), kScalar);
  ASSERT_EQ(result.report.interior_minima.size(), 1u);
  EXPECT_FALSE(find_closed_layers(model, result.field, result.report, 10).has_value());
}

TEST(Field, RefusesWhatIsNoField) {
  const Model model = shapes::as_model(block());
  EXPECT_THROW((void)compute_field(model, values_of(model, [](const Vec3&) { return 0.3; }), kScalar), Error);
  EXPECT_THROW((void)compute_field(model, {}, kScalar), Error);
  const FieldInput zero{.vertex_value = {}, .tet_vector = std::vector<Vec3>(model.mesh.tets.size(), Vec3::Zero()), .where = "v.txt"};
  try {
    (void)compute_field(model, zero, {.source = FieldSource::vector_file});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "v.txt");
    EXPECT_EQ(error.problem(), "every vector is zero: there is no print direction");
  }
  auto input = values_of(model, [](const Vec3& p) { return p.z(); });
  input.vertex_value[11] = std::numeric_limits<double>::infinity();
  try {
    (void)compute_field(model, input, kScalar);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    EXPECT_NE(error.where().find("vertex 11"), std::string::npos);
  }
  EXPECT_THROW((void)compute_field(model, {}, {.direction = Vec3::Zero()}), Error);
}

TEST(Field, LayerCountForThickness) {
  const Model model = shapes::as_model(block());
  const auto field = compute_field(model, {}).field;
  EXPECT_EQ(layer_count_for_thickness(model, field, 0.8), 13);  // 10 mm / 0.8 mm = 12.5
  EXPECT_EQ(layer_count_for_thickness(model, field, 100.0), 1);
  EXPECT_THROW((void)layer_count_for_thickness(model, field, 0.0), Error);
  EXPECT_THROW((void)layer_count_for_thickness(model, field, 1e-9), Error);
}

}  // namespace
}  // namespace curvesup
