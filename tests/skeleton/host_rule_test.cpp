#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/skeleton/grow_skeleton.h"
#include "helpers/support_domain.h"

namespace curvesup {
namespace {

constexpr double kThickness = 0.5;
constexpr int kCount = 40;  // layers per unit of G = z / 20

// A slab 10 mm above the platform, with nothing below it: rays are straight, and every step has a closed form.
shapes::SupportDomain floating_slab() {
  return shapes::support_domain(
      {0, 0, -2}, {36, 28, 16}, {18, 14, 18},
      [](const Vec3& c) { return c.x() > 8 && c.x() < 28 && c.y() > 8 && c.y() < 20 && c.z() > 10 && c.z() < 13; },
      [](const Vec3& p) { return p.z() / 20; });
}

struct PlainNode {
  Vec3 position;
  int layer;
  Index count = 0;
  Index lower = kNone;
};

// The paper's rule by trying all pairs: no tets, no grids, no queue.
class PlainTree {
 public:
  PlainTree(const Skeleton& skeleton, double merge_radius) : merge_radius_(merge_radius) {
    for (const SkeletonNode& n : skeleton.nodes) {
      if (n.kind == NodeKind::leaf) nodes.push_back({n.position, n.layer, 1});
    }
    const Index leaves = static_cast<Index>(nodes.size());
    for (Index i = 0; i < leaves; ++i) drop(i, Vec3::Zero());
    for (int k = nodes[0].layer - 1; k >= 0; --k) grow(k, leaves);
  }

  std::vector<PlainNode> nodes;

 private:
  static double height(int layer) { return std::max(0.0, (layer + 0.5) * kThickness); }

  // To the next layer, `across` away from straight down for each mm.
  void drop(Index n, const Vec3& across) {
    const double below = height(nodes[n].layer - 1), fall = nodes[n].position.z() - below;
    Vec3 p = nodes[n].position + fall * across;
    p.z() = below;
    nodes[n].lower = static_cast<Index>(nodes.size());
    nodes.push_back({p, nodes[n].layer - 1, nodes[n].count});
  }

  void grow(int k, Index leaves) {
    std::vector<Index> open;
    for (Index n = leaves; n < static_cast<Index>(nodes.size()); ++n) {
      if (nodes[n].layer == k) open.push_back(n);
    }
    while (!open.empty()) {
      const auto largest = [&](Index a, Index b) {
        return nodes[a].count != nodes[b].count ? nodes[a].count < nodes[b].count : a > b;
      };
      const auto host = std::max_element(open.begin(), open.end(), largest);
      const Index h = *host;
      open.erase(host);
      drop(h, Vec3::Zero());
      const Index end = nodes[h].lower;
      std::erase_if(open, [&](Index f) {
        if ((nodes[f].position - nodes[h].position).norm() > merge_radius_) return false;
        const Vec3 way = nodes[end].position - nodes[f].position, level(way.x(), way.y(), 0);
        if (level.norm() <= -way.z() * (1 + 1e-9)) {  // within 45 degrees
          nodes[f].lower = end;
          nodes[end].count += nodes[f].count;
        } else {
          drop(f, level.normalized());
        }
        return true;
      });
    }
  }

  double merge_radius_;
};

TEST(HostRule, TheTreeIsTheOneThatTryingAllPairsGives) {
  const shapes::SupportDomain d = floating_slab();
  for (const double merge_radius : {2.0, 6.0}) {
    const SkeletonResult r = grow_skeleton(d.model, d.domain, d.field, d.overhang, kCount, {.merge_radius_mm = merge_radius});
    ASSERT_TRUE(r.report.dropped.empty());
    ASSERT_GT(r.report.max_branch_count, 3);
    const std::vector<PlainNode> plain = PlainTree(r.skeleton, merge_radius).nodes;
    ASSERT_EQ(r.skeleton.nodes.size(), plain.size());
    for (std::size_t n = 0; n < plain.size(); ++n) {
      EXPECT_NEAR((r.skeleton.nodes[n].position - plain[n].position).norm(), 0.0, 1e-9) << n;
    }
    std::size_t edge = 0;
    for (std::size_t n = 0; n < plain.size(); ++n) {
      if (plain[n].lower == kNone) continue;
      ASSERT_LT(edge, r.skeleton.edges.size());
      EXPECT_EQ(r.skeleton.edges[edge].upper, static_cast<Index>(n));
      EXPECT_EQ(r.skeleton.edges[edge].lower, plain[n].lower);
      EXPECT_EQ(r.skeleton.edges[edge].branch_count, plain[n].count);
      ++edge;
    }
    EXPECT_EQ(edge, r.skeleton.edges.size());
  }
}

}  // namespace
}  // namespace curvesup
