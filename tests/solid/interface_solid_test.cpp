#include "curvesup/solid/interface_solid.h"

#include <gtest/gtest.h>

#include <random>

#include "curvesup/core/error.h"
#include "helpers/closed_form_solids.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

// A block 20 x 12 x 10 whose lower face hangs at z = 11, under planar layers 0.5 mm thick.
struct Hanging {
  Model model;
  ScalarField field;
  Overhang overhang;
  int layer_count = 20;

  Hanging() {
    model.mesh = shapes::brick_mesh(Vec3(0, 0, 11), Vec3(20, 12, 21), {5, 3, 3});
    model.topology = build_topology(model.mesh);
    model.boundary = boundary_faces(model.mesh, model.topology);
    std::vector<double> value;
    for (const Vec3& p : model.mesh.vertices) value.push_back((p.z() - 11.0) / 10.0);
    field = make_scalar_field(model.mesh, value);
    overhang = find_overhang(model, field);
  }
  [[nodiscard]] std::shared_ptr<const Solid> solid(const InterfaceOptions& options) const {
    auto post = std::make_shared<shapes::Capsules>(std::vector<shapes::Capsules::Capsule>{{{5, 5, -2}, {5, 5, 12}, 1.5}, {{-1.0, 6, -2}, {-1.0, 6, 30}, 1.2}});
    return with_interface(post, model, field, overhang, layer_count, options);
  }
};

TEST(InterfaceSolid, FillsTheLayersUnderTheOverhangAndNothingElse) {
  const Hanging h;
  const auto plain = h.solid({}), solid = h.solid({.interface_layers = 3});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(-3, 23), y(-3, 15), z(6, 11);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(x(random), y(random), z(random));
    const bool under = p.x() > 0 && p.x() < 20 && p.y() > 0 && p.y() < 12 && p.z() > 11.0 - 3 * 0.5;
    ASSERT_EQ(solid->inside(p), under || plain->inside(p)) << p.transpose();
  }
}

TEST(InterfaceSolid, GapsKeepOffOverhangAndWalls) {
  const Hanging h;
  const InterfaceOptions options{.interface_layers = 3, .top_gap_mm = 0.3, .side_gap_mm = 0.4};
  const auto solid = h.solid(options), full = h.solid({.interface_layers = 3});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> x(-3, 23), y(-3, 15), z(6, 21);
  int taken = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p(x(random), y(random), z(random));
    if (p.x() > 0 && p.x() < 20 && p.y() > 0 && p.y() < 12 && p.z() > 11) continue;  // the model
    const bool under = p.x() > 0 && p.x() < 20 && p.y() > 0 && p.y() < 12;
    const Vec3 wall(std::clamp(p.x(), 0.0, 20.0), std::clamp(p.y(), 0.0, 12.0), std::clamp(p.z(), 11.0, 21.0));
    const bool gap = (under && p.z() > 10.7) || (!under && (p - wall).norm() < 0.4);
    const bool near_rim = under && (p - Vec3(std::abs(p.x() - 10) > std::abs(p.y() - 6) + 4 ? (p.x() < 10 ? 0 : 20) : p.x(),
                                             std::abs(p.x() - 10) > std::abs(p.y() - 6) + 4 ? p.y() : (p.y() < 6 ? 0 : 12), 11)).norm() < 0.4;
    if (near_rim) continue;
    ASSERT_EQ(solid->inside(p), full->inside(p) && !gap) << p.transpose();
    taken += full->inside(p) && gap;
  }
  EXPECT_GT(taken, 100);
}

// Support that stands on a wall touches it there, and only there.
TEST(InterfaceSolid, NoWallIsKeptOffWhereATrunkStandsOnIt) {
  const Hanging h;
  const auto post = std::make_shared<shapes::Capsules>(std::vector<shapes::Capsules::Capsule>{{{-1.0, 6, -2}, {-1.0, 6, 30}, 1.2}});
  const std::vector<Contact> contacts = {{Vec3(0, 6, 15), 1.5}};
  const auto solid = with_interface(post, h.model, h.field, h.overhang, h.layer_count, {.side_gap_mm = 0.4}, contacts);
  const auto beside_wall = [&](double z) { return solid->inside(Vec3(-0.1, 6, z)); };
  EXPECT_TRUE(beside_wall(15));
  EXPECT_TRUE(beside_wall(16.4));
  EXPECT_FALSE(beside_wall(17.1));  // the whole gap again, 0.4 mm beyond the contact
  EXPECT_FALSE(beside_wall(12.9));
  EXPECT_TRUE(solid->inside(Vec3(-0.5, 6, 17.1)));
}

TEST(Contacts, HoldTheConeOfATrunk) {
  Skeleton skeleton;
  skeleton.nodes.resize(2);
  skeleton.nodes[0].position = Vec3(1, 2, 9);
  skeleton.nodes[1].position = Vec3(1, 2, 3);
  skeleton.nodes[1].kind = NodeKind::model_end;
  skeleton.edges.push_back({0, 1, 4, 3.0, 0});
  const std::vector<ModelStand> stands = {{.node = 1, .radius_mm = 1.0, .slope = 0.5}};
  const auto contacts = contacts_of(skeleton, stands);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].centre, Vec3(1, 2, 3));
  EXPECT_NEAR(contacts[0].radius_mm, 5.0, 1e-12);  // 4 mm up the cone is 3 mm wide
}

TEST(InterfaceSolid, BoundsHold) {
  const Hanging h;
  const auto solid = h.solid({.interface_layers = 2, .top_gap_mm = 0.2, .side_gap_mm = 0.3});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> x(-3, 23), y(-3, 15), z(4, 21), unit(-1, 1);
  int outside = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 centre(x(random), y(random), z(random));
    const double radius = 0.1 + 1.5 * std::abs(unit(random));
    const auto bounds = solid->bounds(centre, radius);
    const bool sure = solid->surely_outside(centre, radius);
    outside += sure;
    for (int k = 0; k < 10; ++k) {
      const Vec3 p = centre + radius * Vec3(unit(random), unit(random), unit(random)) / 1.7321;
      const double value = solid->value(p);
      ASSERT_GE(value, bounds.low);
      ASSERT_LE(value, bounds.high);
      ASSERT_FALSE(sure && value >= 0.0) << p.transpose();
    }
  }
  EXPECT_GT(outside, 500);
}

// Gaps leave strips that are thinner than any strut, and the cutter must know where.
TEST(InterfaceSolid, SaysWhereThinRestsMayBe) {
  const Hanging h;
  const std::vector<Strut> struts = {{{-1, 6, -2}, {-1, 6, 30}, 1.2}};
  const auto solid = with_interface(std::make_shared<ConvolutionSolid>(struts), h.model, h.field, h.overhang, 20, {.side_gap_mm = 0.4});
  EXPECT_EQ(solid->thinnest_rest(Vec3(-0.8, 6, 15), 0.5), 0.5);
  EXPECT_EQ(solid->thinnest_rest(Vec3(-1, 6, 5), 0.5), 0.0);
  EXPECT_NEAR(solid->thinnest_radius(Vec3(-1, 6, 5), 0.5, 0.0), 1.2, 1e-9);
}

TEST(InterfaceSolid, NothingAskedForIsTheSolidItself) {
  const Hanging h;
  const std::shared_ptr<const Solid> base = std::make_shared<shapes::Capsules>(std::vector<shapes::Capsules::Capsule>{});
  EXPECT_EQ(with_interface(base, h.model, h.field, h.overhang, 20, {}), base);
  EXPECT_THROW((void)with_interface(base, h.model, h.field, h.overhang, 20, {.top_gap_mm = -0.1}), Error);
}

}  // namespace
}  // namespace curvesup
