#include "curvesup/solid/envelope_solid.h"

#include <gtest/gtest.h>

#include <random>

#include "curvesup/core/error.h"
#include "helpers/support_domain.h"

namespace curvesup {
namespace {

// A leaf for every vertex of the underside of a slab [0,30] x [0,10] that floats at z = 12: the complex is the box
// below.
TEST(EnvelopeSolid, BelowASlabItIsTheBoxThickenedByTheRadius) {
  const Model model = shapes::floating_slab();
  std::vector<double> height;
  for (const Vec3& v : model.mesh.vertices) height.push_back(v.z());
  const ScalarField field = make_scalar_field(model.mesh, height);
  const auto leaves = place_leaves(model, field, shapes::plain_overhang(model, field), 0.0);
  const EnvelopeResult envelope = build_envelope(model, leaves);
  EXPECT_GT(envelope.report.inner_tets, 100);
  const auto by_definition = [](const Vec3& p) {
    const Vec3 nearest = p.cwiseMax(Vec3(0, 0, 0)).cwiseMin(Vec3(30, 10, 12));
    return 0.8 - std::min(3.2, (p - nearest).norm());
  };
  std::mt19937 random(4);
  std::uniform_real_distribution<double> x(-4, 34), y(-4, 14), z(-4, 16), size(0.0, 2.0);
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p(x(random), y(random), z(random));
    const double value = envelope.solid->value(p);
    EXPECT_NEAR(value, by_definition(p), 0.03) << p.transpose();  // rays stand 0.02 off the slab and bow by that much
    const double radius = size(random);
    const Solid::Bounds bounds = envelope.solid->bounds(p + 0.57 * radius * Vec3(1, -1, 1), radius);
    EXPECT_LE(bounds.low, value);
    EXPECT_GE(bounds.high, value);
  }
}

TEST(EnvelopeSolid, SmallAlphaLeavesTheGap) {
  const auto two_plates = shapes::as_model(
      shapes::brick_mesh({0, 0, 10}, {40, 10, 12}, {20, 5, 1}, [](const Vec3& c) { return c.x() < 12 || c.x() > 28; }));
  std::vector<double> height;
  for (const Vec3& v : two_plates.mesh.vertices) height.push_back(v.z());
  const ScalarField field = make_scalar_field(two_plates.mesh, height);
  const auto leaves = place_leaves(two_plates, field, shapes::plain_overhang(two_plates, field), 1.2);
  EXPECT_LT(build_envelope(two_plates, leaves, {.alpha_mm = 3.0}).solid->value({20, 5, 5}), 0.0);
  EXPECT_GT(build_envelope(two_plates, leaves, {.alpha_mm = 20.0}).solid->value({20, 5, 5}), 0.0);
}

TEST(EnvelopeSolid, NoLeavesNoSolidAndBadLengthsAreRefused) {
  const Model model = shapes::floating_slab();
  EXPECT_LT(build_envelope(model, {}).solid->value(Vec3::Zero()), 0.0);
  EXPECT_THROW((void)build_envelope(model, {}, {.alpha_mm = 0.0}), Error);
}

}  // namespace
}  // namespace curvesup
