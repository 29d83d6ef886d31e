#pragma once

#include <vector>

#include "skeleton/leaf_start.h"
#include "skeleton/node_drop.h"

namespace curvesup {

struct GrowingNode {
  SkeletonNode node;
  Index lower = kNone;       // node at the other end of its edge
  Index count = 0;           // leaves above
  double lowest_leaf = 0.0;  // smallest G of those leaves
  Drop drop = Drop::none;    // why it has no edge
};

// Traces leaves from layer to layer, hosts and followers, down to the platform or the model.
class TreeGrowth {
 public:
  TreeGrowth(const Model& model, const Domain& domain, const ScalarField& field, int layer_count,
             const SkeletonOptions& options, const RunContext& run);

  // The first starts.size() nodes are the leaves; the lower node of an edge comes after the upper one.
  [[nodiscard]] std::vector<GrowingNode> grow(const std::vector<Start>& starts);
  // Why the branch of each leaf does not hold, or none.
  [[nodiscard]] std::vector<Drop> judge(const std::vector<GrowingNode>& nodes, Index leaves) const;

 private:
  [[nodiscard]] double layer_value(Index k) const { return (k + 0.5) / count_; }
  // Highest layer strictly below a value.
  [[nodiscard]] Index layer_below(double value) const;

  void place_leaves(const std::vector<Start>& starts);
  Index add_node(const WalkResult& walk, Index layer_above);
  void connect(Index upper, Index lower);
  void process_layer(Index k);
  void attract(Index host, const std::vector<Index>& followers, Index layer);
  [[nodiscard]] bool reaches(const WalkResult& walk, const Vec3& target, double length) const;
  std::vector<Index>& active(Index k) { return active_[k - lowest_layer_]; }

  TetWalk walk_;
  NodeDrop drop_;
  int count_;
  const SkeletonOptions& options_;
  AngleLimit self_support_;
  const RunContext& run_;
  Index lowest_layer_ = 0, highest_layer_ = 0;
  std::vector<GrowingNode> nodes_;
  std::vector<std::vector<Index>> active_;  // nodes of each layer
  std::vector<char> processed_;
};

}  // namespace curvesup
