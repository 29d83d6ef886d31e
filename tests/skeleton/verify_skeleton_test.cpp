#include "skeleton/verify_skeleton.h"

#include <gtest/gtest.h>

#include <set>

#include "helpers/support_domain.h"

namespace curvesup {
namespace {

using Names = std::set<std::string>;

// Trees on the platform and on a plate [4,32] x [4,24] x [2,4] under a slab.
class VerifySkeleton : public testing::Test {
 protected:
  static constexpr int kCount = 40;  // layers per unit of G = z / 20

  VerifySkeleton()
      : scene(shapes::support_domain(
            {0, 0, -2}, {36, 28, 16}, {18, 14, 18},
            [](const Vec3& c) {
              return (c.x() > 8 && c.x() < 28 && c.y() > 8 && c.y() < 20 && c.z() > 10 && c.z() < 13) ||
                     (c.x() > 4 && c.x() < 32 && c.y() > 4 && c.y() < 24 && c.z() > 2 && c.z() < 4);
            },
            [](const Vec3& p) { return p.z() / 20; })),
        skeleton(grow_skeleton(scene.model, scene.domain, scene.field, scene.overhang, kCount).skeleton) {}

  [[nodiscard]] SkeletonReport verify(int layer_count = kCount, int threads = 1,
                                      const SkeletonOptions& options = {}) const {
    SkeletonReport report;
    RunContext run;
    run.threads = threads;
    verify_skeleton(scene.domain, scene.field, layer_count, options, skeleton, report, run);
    return report;
  }
  static Names failed(const SkeletonReport& report) {
    Names names;
    for (const Check& c : report.checks) {
      if (!c.ok) names.insert(c.name.substr(std::string("skeleton.").size()));
    }
    return names;
  }
  // The edge that ends on such a node.
  SkeletonEdge& edge_to(NodeKind kind) {
    return *std::find_if(skeleton.edges.begin(), skeleton.edges.end(),
                         [&](const SkeletonEdge& e) { return skeleton.nodes[e.lower].kind == kind; });
  }
  SkeletonNode& lower_node(NodeKind kind) { return skeleton.nodes[edge_to(kind).lower]; }

  shapes::SupportDomain scene;
  Skeleton skeleton;
};

TEST_F(VerifySkeleton, ASoundTreeHolds) {
  const SkeletonReport report = verify();
  EXPECT_EQ(failed(report), Names{});
  EXPECT_GT(report.platform_ends, 0);
  EXPECT_GT(report.model_ends, 0);
}

TEST_F(VerifySkeleton, ALostLeafFails) {
  --edge_to(NodeKind::platform_end).branch_count;
  EXPECT_EQ(failed(verify()), Names{"leaves_conserved"});
}

TEST_F(VerifySkeleton, ALostEdgeFails) {
  skeleton.edges.erase(skeleton.edges.begin());
  EXPECT_EQ(failed(verify()), Names{"loose_nodes"});
}

TEST_F(VerifySkeleton, AnEdgeThroughTheModelFails) {
  lower_node(NodeKind::model_end).position.z() -= 0.5;
  EXPECT_EQ(failed(verify()), (Names{"edges_through_model", "loose_nodes"}));
}

TEST_F(VerifySkeleton, AnEdgeOutOfTheDomainFails) {
  lower_node(NodeKind::platform_end).position.z() = -5.0;
  EXPECT_EQ(failed(verify()), (Names{"edges_through_model", "loose_nodes"}));
}

TEST_F(VerifySkeleton, ASteepEdgeFails) {
  const SkeletonEdge& edge = edge_to(NodeKind::platform_end);
  const double fall = skeleton.nodes[edge.upper].position.z();
  skeleton.nodes[edge.lower].position = skeleton.nodes[edge.upper].position + fall * Vec3(1.01, 0, -1);
  skeleton.nodes[edge.lower].position.z() = 0.0;
  EXPECT_EQ(failed(verify()), Names{"edge_angle_deg"});
}

TEST_F(VerifySkeleton, AnEndAboveThePlatformFails) {
  lower_node(NodeKind::platform_end).position.z() = 0.01;
  EXPECT_EQ(failed(verify()), Names{"loose_nodes"});
}

TEST_F(VerifySkeleton, AnEndAboveTheModelFails) {
  lower_node(NodeKind::model_end).position.z() += 0.01;
  EXPECT_EQ(failed(verify()), Names{"loose_nodes"});
}

TEST_F(VerifySkeleton, AnEndOnTheModelFailsWhereThatIsForbidden) {
  EXPECT_EQ(failed(verify(kCount, 1, {.model_contact = ModelContact::forbidden})), Names{"loose_nodes"});
}

TEST_F(VerifySkeleton, BranchesShorterThanALayerFail) {
  EXPECT_EQ(failed(verify(4)), Names{}) << "6 mm from the slab to the plate, layers of 5 mm";
  EXPECT_EQ(failed(verify(3)), Names{"short_branches"}) << "layers of 6.7 mm";
}

TEST_F(VerifySkeleton, ThreadsDoNotChangeAByte) {
  const SkeletonReport one = verify(kCount, 1), two = verify(kCount, 2);
  EXPECT_GT(one.edges, 1024) << "fewer are walked in one piece";
  EXPECT_EQ(one.length_mm, two.length_mm);
  EXPECT_EQ(one.max_edge_angle_deg, two.max_edge_angle_deg);
}

}  // namespace
}  // namespace curvesup
