#include "skeleton/tree_growth.h"

#include <algorithm>
#include <cmath>

#include "skeleton/point_grid.h"

namespace curvesup {

namespace {
constexpr double kArrival = 1e-7;  // mm: how near to its end a segment on the model must come
}

TreeGrowth::TreeGrowth(const Model& model, const Domain& domain, const ScalarField& field, int layer_count,
                       const SkeletonOptions& options, const RunContext& run)
    : walk_(domain, field),
      drop_(model, domain, field, layer_count, options),
      count_(layer_count),
      options_(options),
      self_support_(options.self_support.radians()),
      run_(run) {
  const auto [low, high] = std::minmax_element(field.value.begin(), field.value.end());
  lowest_layer_ = static_cast<Index>(std::floor(*low * count_)) - 2;
  highest_layer_ = static_cast<Index>(std::ceil(*high * count_)) + 1;
}

Index TreeGrowth::layer_below(double value) const {
  return static_cast<Index>(std::ceil(value * count_ - 0.5 - 1e-9)) - 1;
}

Index TreeGrowth::add_node(const WalkResult& walk, Index layer_above) {
  GrowingNode n;
  n.node.position = walk.position;
  n.node.tet = walk.tet;
  n.lowest_leaf = std::numeric_limits<double>::infinity();
  const Index id = static_cast<Index>(nodes_.size());
  if (walk.stop == WalkStop::value) {
    n.node.layer = layer_above - 1;
    active(n.node.layer).push_back(id);
  } else {
    n.node.layer = layer_above;
    n.node.kind = walk.stop == WalkStop::platform ? NodeKind::platform_end : NodeKind::model_end;
  }
  nodes_.push_back(n);
  processed_.push_back(0);
  return id;
}

void TreeGrowth::connect(Index upper, Index lower) {
  nodes_[upper].lower = lower;
  nodes_[lower].count += nodes_[upper].count;
  nodes_[lower].lowest_leaf = std::min(nodes_[lower].lowest_leaf, nodes_[upper].lowest_leaf);
}

bool TreeGrowth::reaches(const WalkResult& walk, const Vec3& target, double length) const {
  if (walk.stop == WalkStop::length) return true;
  return (walk.stop == WalkStop::model || walk.stop == WalkStop::platform) && length - walk.length <= kArrival &&
         (walk.position - target).norm() <= kArrival;
}

// Followers merge into the host's drop point when that is within the angle, else they turn towards it by the full
// angle.
void TreeGrowth::attract(Index host, const std::vector<Index>& followers, Index layer) {
  const Index drop = nodes_[host].lower;
  const Vec3 target = nodes_[drop].node.position;
  for (const Index f : followers) {
    const Vec3 p = nodes_[f].node.position;
    const Index tet = nodes_[f].node.tet;
    const double length = (target - p).norm();
    if (length <= 0.0) continue;
    const Vec3 to_target = (target - p) / length;
    const WalkResult segment = walk_.walk(p, tet, to_target, {.length = length, .stop_at_platform = target.z() == 0.0});
    if (!reaches(segment, target, length)) continue;  // a wall between them
    const bool on_model = nodes_[drop].node.kind == NodeKind::model_end;
    const bool high_enough =
        !on_model || nodes_[f].lowest_leaf - walk_.value_at(nodes_[drop].node.tet, target) >= 1.0 / count_;
    if (drop_.within_angle(segment, to_target) && high_enough) {
      connect(f, drop);
      processed_[f] = 1;
      continue;
    }
    const Vec3 u = self_support_.turn(walk_.down(tet), to_target);
    const WalkResult turned = walk_.walk(p, tet, u, {.value = layer_value(layer - 1)});
    if (!drop_.within_angle(turned, u) || (turned.stop != WalkStop::value && turned.stop != WalkStop::platform)) continue;
    connect(f, add_node(turned, layer));
    processed_[f] = 1;
  }
}

// Largest branch count first, ties by id.
void TreeGrowth::process_layer(Index k) {
  std::vector<Index> order = active(k);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    return nodes_[a].count != nodes_[b].count ? nodes_[a].count > nodes_[b].count : a < b;
  });
  std::vector<Vec3> positions;
  for (const Index n : order) positions.push_back(nodes_[n].node.position);
  const PointGrid grid(positions, std::max(options_.merge_radius_mm, 1e-3));
  const double reach = options_.merge_radius_mm * options_.merge_radius_mm;
  std::vector<Index> followers;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Index host = order[i];
    if (processed_[host]) continue;
    processed_[host] = 1;
    const GrowingNode& n = nodes_[host];
    const Step step = drop_.step(n.node.position, n.node.tet, drop_.host_direction(n.node.tet), layer_value(k - 1),
                                 {n.count, n.lowest_leaf});
    if (step.drop != Drop::none) {
      nodes_[host].drop = step.drop;
      continue;
    }
    connect(host, add_node(step.walk, k));
    followers.clear();
    grid.near(positions[i], options_.merge_radius_mm, [&](Index j) {
      if (!processed_[order[j]] && (positions[j] - positions[i]).squaredNorm() <= reach) followers.push_back(order[j]);
    });
    std::sort(followers.begin(), followers.end());
    attract(host, followers, k);
  }
}

void TreeGrowth::place_leaves(const std::vector<Start>& starts) {
  nodes_.clear();
  for (const Start& s : starts) {
    GrowingNode leaf;
    leaf.lowest_leaf = walk_.value_at(s.tet, s.position);
    leaf.node = {s.position, s.tet, layer_below(leaf.lowest_leaf) + 1, NodeKind::leaf};
    leaf.count = 1;
    nodes_.push_back(leaf);
  }
  processed_.assign(nodes_.size(), 1);
  active_.assign(highest_layer_ - lowest_layer_ + 1, {});
}

std::vector<GrowingNode> TreeGrowth::grow(const std::vector<Start>& starts) {
  place_leaves(starts);
  for (Index i = 0; i < static_cast<Index>(starts.size()); ++i) {
    const Index layer = nodes_[i].node.layer;
    const Step step = drop_.step(starts[i].position, starts[i].tet, starts[i].direction, layer_value(layer - 1),
                                 {1, nodes_[i].lowest_leaf});
    if (step.drop != Drop::none) {
      nodes_[i].drop = step.drop == Drop::short_branch ? Drop::blocked : step.drop;
    } else {
      connect(i, add_node(step.walk, layer));
    }
  }
  for (Index k = highest_layer_; k > lowest_layer_; --k) {
    if (active(k).empty()) continue;
    run_.check_stop();
    process_layer(k);
  }
  return std::move(nodes_);
}

std::vector<Drop> TreeGrowth::judge(const std::vector<GrowingNode>& nodes, Index leaves) const {
  // Lower nodes come later: walk backwards and hand the fate of each end upwards.
  std::vector<Drop> fate(nodes.size(), Drop::none);
  std::vector<Index> end(nodes.size());
  for (Index n = static_cast<Index>(nodes.size()) - 1; n >= 0; --n) {
    const Index lower = nodes[n].lower;
    end[n] = lower == kNone ? n : end[lower];
    fate[n] = lower == kNone ? nodes[n].drop : fate[lower];
  }
  for (Index i = 0; i < leaves; ++i) {
    const GrowingNode& e = nodes[end[i]];
    if (fate[i] == Drop::none && e.node.kind == NodeKind::model_end &&
        nodes[i].lowest_leaf - walk_.value_at(e.node.tet, e.node.position) < 1.0 / count_) {
      fate[i] = Drop::short_branch;
    }
  }
  fate.resize(leaves);
  return fate;
}

}  // namespace curvesup
