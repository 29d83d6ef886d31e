#include "curvesup/check/support_certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <tuple>

#include "curvesup/layers/layers.h"
#include "curvesup/overhang/overhang.h"
#include "helpers/layer_stacks.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

// A slab [0,8] x [0,8] x [6,8] over a block [0,3] x [0,8] x [0,2] that stands on the platform, in the domain [0,8]^3
// with G = z / 8; N = 8, so layers are 1 mm thick and lie at z = 0.5, 1.5, ... 7.5. The untrimmed support fills the
// domain.
struct Scene {
  Model model;
  Domain domain;
  ScalarField field;
  LayerStack printed;
  Skeleton skeleton;

  Scene() {
    const auto in_model = [](const Vec3& c) { return c.z() > 6 || (c.z() < 2 && c.x() < 3); };
    TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {8, 8, 8}, {8, 8, 8}, in_model);
    model = shapes::as_model(mesh);
    domain.model_vertices = static_cast<Index>(mesh.vertices.size());
    domain.model_tets = static_cast<Index>(mesh.tets.size());
    const TetMesh rest =
        shapes::brick_mesh({0, 0, 0}, {8, 8, 8}, {8, 8, 8}, [&](const Vec3& c) { return !in_model(c); });
    std::map<std::tuple<double, double, double>, Index> id;
    for (Index v = 0; v < domain.model_vertices; ++v)
      id[{mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()}] = v;
    for (auto tet : rest.tets) {
      for (Index& v : tet) {
        const Vec3& p = rest.vertices[v];
        const auto [at, fresh] = id.try_emplace({p.x(), p.y(), p.z()}, static_cast<Index>(mesh.vertices.size()));
        if (fresh) mesh.vertices.push_back(p);
        v = at->second;
      }
      mesh.tets.push_back(tet);
    }
    domain.topology = build_topology(mesh);
    std::vector<double> value;
    for (const Vec3& p : mesh.vertices) value.push_back(p.z() / 8);
    field = make_scalar_field(mesh, std::move(value));
    domain.mesh = std::move(mesh);
    printed = slice_layers(domain, field, 8).stack;

    // Two leaves merge at node 2 and stand on the platform (3); leaf 4 stands on the block (5).
    skeleton.nodes = {
        {Vec3(4.3, 4.3, 6), kNone, 5, NodeKind::leaf}, {Vec3(2.3, 4.3, 6), kNone, 5, NodeKind::leaf},
        {Vec3(4.3, 4.3, 3), kNone, 2, NodeKind::node}, {Vec3(4.3, 4.3, 0), kNone, 0, NodeKind::platform_end},
        {Vec3(1.6, 4.3, 6), kNone, 5, NodeKind::leaf}, {Vec3(1.6, 4.3, 2), kNone, 2, NodeKind::model_end}};
    skeleton.edges = {{0, 2, 1, 0.8, 5}, {1, 2, 1, 0.8, 5}, {2, 3, 2, 1.1, 2}, {4, 5, 1, 0.8, 5}};
  }

  // Takes support triangles for which drop(layer, centroid) holds out of the stack.
  void drop_support(const std::function<bool(Index, const Vec3&)>& drop) {
    printed = shapes::without_triangles(printed, [&](const Sheet& sheet, const Vec3& centroid) {
      return sheet.material == Material::support && drop(sheet.layer, centroid);
    });
  }

  SupportCertificate certify(const SupportCertificateOptions& options = {}, const std::vector<Index>& blocked = {},
                             int threads = 1) const {
    RunContext run;
    run.threads = threads;
    return certify_support(model, blocked, domain, field, printed, &skeleton, options, run);
  }
};

std::vector<std::string> failed(const SupportCertificate& certificate) {
  std::vector<std::string> names;
  for (const Check& check : certificate.checks) {
    if (!check.ok) names.push_back(check.name);
  }
  return names;
}

using Names = std::vector<std::string>;

TEST(SupportCertificate, HoldsForFullSupportAndASoundSkeleton) {
  const auto certificate = Scene().certify();
  EXPECT_EQ(failed(certificate), Names{});
  EXPECT_EQ(certificate.checks.size(), 8u);
  EXPECT_NEAR(certificate.overhang_area_mm2, 64.0, 1e-9);
  EXPECT_GE(certificate.samples, 4 * 64);
  EXPECT_EQ(certificate.covered_fraction, 1.0);
  EXPECT_EQ(certificate.floor_fraction, 0.0) << "the slab's own layers lie above its underside, not below";
  EXPECT_EQ(certificate.pieces, 6);
  EXPECT_EQ(certificate.leaves, 3);
  EXPECT_NEAR(certificate.max_edge_angle_deg, std::atan2(2.0, 3.0) * 180 / std::numbers::pi, 1e-9);
}

TEST(SupportCertificate, MissingSupportIsUncoveredFaceByFace) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3& c) { return layer >= 4 && c.x() > 4; });
  const auto certificate = scene.certify({.samples_per_mm2 = 36});
  EXPECT_EQ(failed(certificate), Names{"certificate.coverage"});
  EXPECT_NEAR(certificate.uncovered_area_mm2, (8 - 4 - 0.8) * 8, 0.5) << "support reaches leaf_radius_mm sideways";
  double sum = 0.0;
  for (const auto& [face, area] : certificate.uncovered) {
    sum += area;
    for (const Index v : scene.model.boundary[face].vertices) EXPECT_GE(scene.model.mesh.vertices[v].x(), 4.0);
  }
  EXPECT_NEAR(sum, certificate.uncovered_area_mm2, 1e-9);

  const Overhang overhang = find_overhang(
      scene.model,
      make_scalar_field(scene.model.mesh,
                        [&] {
                          return std::vector<double>(scene.field.value.begin(),
                                                     scene.field.value.begin() + scene.domain.model_vertices);
                        }()),
      {.block = {Region::box(Vec3(4, -1, 5), Vec3(9, 9, 7))}});
  const auto blocked = scene.certify({}, overhang.blocked);
  EXPECT_EQ(failed(blocked), Names{});
  EXPECT_NEAR(blocked.blocked_area_mm2, 32.0, 1e-9);
}

TEST(SupportCertificate, EnforcedFacesAreSampledWhateverTheirSlope) {
  Scene scene;
  std::vector<Index> wall;  // of the slab, x = 8: the layers below it begin at z = 6
  for (Index f = 0; f < static_cast<Index>(scene.model.boundary.size()); ++f) {
    const auto& v = scene.model.boundary[f].vertices;
    const auto on = [&](Index i) { return scene.model.mesh.vertices[i].x() == 8.0 && scene.model.mesh.vertices[i].z() <= 7.0; };
    if (on(v[0]) && on(v[1]) && on(v[2])) wall.push_back(f);
  }
  ASSERT_EQ(wall.size(), 16u);
  EXPECT_EQ(failed(scene.certify({.enforced_faces = wall})), Names{});
  EXPECT_NEAR(scene.certify({.enforced_faces = wall}).overhang_area_mm2, 64.0 + 8.0, 1e-9);
  scene.drop_support([](Index layer, const Vec3&) { return layer >= 4; });
  const auto bare = scene.certify({.enforced_faces = wall});
  EXPECT_EQ(failed(bare), Names{"certificate.coverage"});
  EXPECT_TRUE(std::any_of(bare.uncovered.begin(), bare.uncovered.end(), [&](const auto& face) {
    return std::binary_search(wall.begin(), wall.end(), face.face);
  }));
}

TEST(SupportCertificate, NoSupportAtAllLeavesTheFloor) {
  Scene scene;
  scene.drop_support([](Index, const Vec3&) { return true; });
  const auto certificate = scene.certify();
  EXPECT_EQ(certificate.covered_fraction, 0.0);
  EXPECT_EQ(certificate.uncovered.size(), 128u);
  EXPECT_EQ(certificate.pieces, 0);
}

TEST(SupportCertificate, ReachIsACylinderAlongThePrintDirection) {
  Scene scene;
  scene.drop_support(
      [](Index layer, const Vec3& c) { return layer != 5 || c.x() < 3 || c.x() > 4 || c.y() < 4 || c.y() > 5; });
  // A unit square grown by a disc of radius 0.8.
  const double straight = 1 + 4 * 0.8 + std::numbers::pi * 0.64;
  EXPECT_NEAR(scene.certify({.samples_per_mm2 = 400}).covered_fraction * 64, straight, 0.02 * straight);
  // Leaning d_p: the disc across d_p is an ellipse in the layer's plane.
  for (Vec3& g : scene.field.gradient) g = Vec3(1, 0, 2).normalized() / 8;
  const double a = 0.8 * std::sqrt(5.0) / 2;
  const double leaning = 1 + 2 * 0.8 + 2 * a + std::numbers::pi * 0.8 * a;
  EXPECT_NEAR(scene.certify({.samples_per_mm2 = 400}).covered_fraction * 64, leaning, 0.02 * leaning);
}

TEST(SupportCertificate, TopGapReachesFarther) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3&) { return layer == 5 || layer == 4; });
  EXPECT_EQ(scene.certify().covered_fraction, 0.0);  // the first layer lies 2.5 mm below
  EXPECT_EQ(scene.certify({.top_gap_mm = 0.9}).covered_fraction, 0.0);
  EXPECT_EQ(scene.certify({.top_gap_mm = 1.1}).covered_fraction, 1.0);
}

TEST(SupportCertificate, PieceOverAMissingLayerFloats) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3&) { return layer == 4; });
  const auto certificate = scene.certify();
  EXPECT_EQ(failed(certificate), Names{"certificate.floating_pieces"});
  ASSERT_EQ(certificate.floating.size(), 1u);
  EXPECT_EQ(certificate.floating[0].layer, 5);
  EXPECT_NEAR((certificate.floating[0].centroid - Vec3(4, 4, 5.5)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(certificate.floating[0].area_mm2, 64.0, 1e-9);
}

TEST(SupportCertificate, AFifthOfTheAreaCarriesAPiece) {
  for (const double held : {1.0, 2.0}) {  // of 8 mm
    Scene scene;
    scene.drop_support([&](Index layer, const Vec3& c) { return layer == 4 && c.x() > held; });
    EXPECT_EQ(scene.certify().floating.size(), held == 1.0 ? 1u : 0u);
  }
}

TEST(SupportCertificate, PiecesMayStandOnTheModel) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3& c) { return layer < 2 || c.x() > 3; });
  EXPECT_TRUE(scene.certify().floating.empty());  // on the block
  Scene beside;
  beside.drop_support([](Index layer, const Vec3& c) { return layer < 3 || c.x() < 3; });
  EXPECT_EQ(beside.certify().floating.size(), 1u);  // in the air next to it
}

TEST(SupportCertificate, PiecesThatTouchInACornerAreTwo) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3& c) { return layer == 5 && (c.x() < 4) != (c.y() < 4); });
  EXPECT_EQ(scene.certify().pieces, 7);
}

TEST(SupportCertificate, SteepEdgeFails) {
  Scene scene;
  scene.skeleton.nodes[2].position.x() = scene.skeleton.nodes[3].position.x() = 5.4;  // leaf 1: 3.1 sideways, 3 down
  const auto certificate = scene.certify();
  EXPECT_EQ(failed(certificate), Names{"certificate.edge_angle_deg"});
  EXPECT_EQ(certificate.steep_edges, std::vector<Index>{1});
}

TEST(SupportCertificate, EdgeThroughTheModelFails) {
  Scene scene;
  scene.skeleton.nodes[5] = {Vec3(1.6, 4.3, 0), kNone, 0, NodeKind::platform_end};
  const auto certificate = scene.certify();
  EXPECT_EQ(failed(certificate), Names{"certificate.edges_through_model"});
  EXPECT_EQ(certificate.edges_through_model, std::vector<Index>{3});
}

TEST(SupportCertificate, LostBranchFails) {
  Scene scene;
  scene.skeleton.edges.erase(scene.skeleton.edges.begin() + 2);  // node 2 hangs in the air
  auto certificate = scene.certify();
  EXPECT_EQ(certificate.ungrounded_leaves, (std::vector<Index>{0, 1}));
  EXPECT_EQ(failed(certificate),
            (Names{"certificate.leaves_grounded", "certificate.branch_counts", "certificate.leaf_count_at_ends"}));
  Scene circle;
  circle.skeleton.nodes.push_back({Vec3(4.3, 4.3, 4), kNone, 3, NodeKind::node});
  circle.skeleton.edges[2] = {2, 6, 2, 1.0, 2};
  circle.skeleton.edges.push_back({6, 2, 2, 1.0, 2});
  EXPECT_EQ(circle.certify().ungrounded_leaves, (std::vector<Index>{0, 1}));
}

TEST(SupportCertificate, WrongBranchCountFails) {
  Scene scene;
  scene.skeleton.edges[2].branch_count = 1;
  const auto certificate = scene.certify();
  EXPECT_EQ(failed(certificate), (Names{"certificate.branch_counts", "certificate.leaf_count_at_ends"}));
  EXPECT_EQ(certificate.miscounted_nodes, std::vector<Index>{2});
}

TEST(SupportCertificate, EndsMustStandSomewhere) {
  Scene above_platform;
  above_platform.skeleton.nodes[3].position.z() = 0.2;
  EXPECT_EQ(failed(above_platform.certify()), Names{"certificate.ends"});

  Scene above_block;
  above_block.skeleton.nodes[5].position.z() = 2.3;
  EXPECT_EQ(failed(above_block.certify()), Names{"certificate.ends"});

  Scene on_wall;  // the block's side at x = 3 does not look up
  on_wall.skeleton.nodes[4].position.x() = 3.0 + 1e-4;
  on_wall.skeleton.nodes[5].position = Vec3(3.0 + 1e-4, 4.3, 1);
  EXPECT_EQ(failed(on_wall.certify()), Names{"certificate.ends"});

  Scene short_branch;  // its leaf hangs half a layer above the end
  short_branch.skeleton.nodes[4].position.z() = 2.5;
  EXPECT_EQ(failed(short_branch.certify()), Names{"certificate.ends"});
}

TEST(SupportCertificate, ThreadCountDoesNotMatter) {
  Scene scene;
  scene.drop_support([](Index layer, const Vec3& c) { return layer >= 3 && c.x() > 4 + 0.3 * c.y(); });
  const auto one = scene.certify(), two = scene.certify({}, {}, 2);
  EXPECT_EQ(one.uncovered_area_mm2, two.uncovered_area_mm2);
  EXPECT_EQ(one.uncovered.size(), two.uncovered.size());
  EXPECT_EQ(one.floating.size(), two.floating.size());
}

}  // namespace
}  // namespace curvesup
