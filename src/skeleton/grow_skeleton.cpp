#include "curvesup/skeleton/grow_skeleton.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "skeleton/tree_growth.h"
#include "skeleton/verify_skeleton.h"

namespace curvesup {
namespace {

constexpr int kGrowthRounds = 4;

void require(bool ok, const char* what) {
  if (!ok) throw Error(ErrorKind::usage, "support", what, "change one of the two");
}

void validate(const SkeletonOptions& o) {
  require(o.leaf_radius_mm >= 0.5 * o.bead_width_mm,
          "support.leaf_radius_mm is below half of toolpath.bead_width_mm: such a strut holds no bead");
  require(o.max_radius_mm >= o.leaf_radius_mm, "support.max_radius_mm is below support.leaf_radius_mm");
  require(o.min_trunk_radius_mm <= o.max_radius_mm, "support.min_trunk_radius_mm is above support.max_radius_mm");
  const double degrees = o.self_support.degrees();
  require(degrees > 0.0 && degrees < 90.0, "support.self_support_angle_deg must lie between 0 and 90");
}

// The branches that stand, with dense ids.
Skeleton assemble(const std::vector<GrowingNode>& nodes, const std::vector<Drop>& fate) {
  std::vector<Index> count(nodes.size(), 0), id(nodes.size(), kNone);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (n < fate.size()) count[n] = fate[n] == Drop::none ? 1 : 0;
    if (nodes[n].lower != kNone) count[nodes[n].lower] += count[n];
  }
  Skeleton skeleton;
  skeleton.nodes.reserve(nodes.size());
  skeleton.edges.reserve(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (count[n] == 0) continue;
    id[n] = static_cast<Index>(skeleton.nodes.size());
    skeleton.nodes.push_back(nodes[n].node);
  }
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (count[n] > 0 && nodes[n].lower != kNone) {
      skeleton.edges.push_back({id[n], id[nodes[n].lower], count[n], 0.0, nodes[n].node.layer});
    }
  }
  return skeleton;
}

// By area, thicker towards the platform where asked for, within the bounds.
void set_radii(Skeleton& skeleton, const SkeletonOptions& o) {
  std::vector<double> way(skeleton.nodes.size(), 0.0);
  for (SkeletonEdge& e : skeleton.edges) {
    double radius = radius_by_area(o, e.branch_count) + o.thickening_per_mm * way[e.upper];
    if (e.branch_count > 1) radius = std::max(radius, o.min_trunk_radius_mm);
    e.radius_mm = std::min(radius, o.max_radius_mm);
    const double length = (skeleton.nodes[e.upper].position - skeleton.nodes[e.lower].position).norm();
    way[e.lower] = std::max(way[e.lower], way[e.upper] + length);
  }
}

}  // namespace

SkeletonResult grow_skeleton(const Model& model, const Domain& domain, const ScalarField& field,
                             const Overhang& overhang, int layer_count, const SkeletonOptions& options,
                             const RunContext& run) {
  validate(options);
  SkeletonResult result;
  const std::vector<LeafSite> sites = place_leaves(model, field, overhang, effective_leaf_spacing(options), run);
  if (sites.empty()) {
    verify_skeleton(domain, field, layer_count, options, result.skeleton, result.report, run);
    return result;
  }
  const LeafStarts leaf_starts(model, domain, field, AngleLimit(options.self_support.radians()), sites);
  std::vector<const LeafSite*> kept;
  std::vector<Start> starts;
  const auto drop = [&](const LeafSite& site, Drop why) {
    result.report.dropped.push_back({site.position, site.face, reason(why)});
  };
  for (const LeafSite& site : sites) {
    if (const auto start = leaf_starts.start(site)) {
      kept.push_back(&site);
      starts.push_back(*start);
    } else {
      drop(site, Drop::steep);
    }
  }
  // Leaves without a branch must not count when hosts are chosen: grow again without them.
  TreeGrowth growth(model, domain, field, layer_count, options, run);
  std::vector<GrowingNode> nodes;
  std::vector<Drop> fate;
  for (int round = 0; round < kGrowthRounds; ++round) {
    nodes = growth.grow(starts);
    fate = growth.judge(nodes, static_cast<Index>(starts.size()));
    if (round + 1 == kGrowthRounds || std::count(fate.begin(), fate.end(), Drop::none) == std::ssize(fate)) break;
    std::size_t next = 0;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      if (fate[i] != Drop::none) {
        drop(*kept[i], fate[i]);
        continue;
      }
      starts[next] = starts[i];
      kept[next++] = kept[i];
    }
    starts.resize(next);
    kept.resize(next);
  }
  for (std::size_t i = 0; i < fate.size(); ++i) {
    if (fate[i] != Drop::none)
      drop(*kept[i], fate[i]);
    else if (kept[i]->vertex == kNone)
      ++result.report.points_added;
  }
  result.skeleton = assemble(nodes, fate);
  set_radii(result.skeleton, options);
  verify_skeleton(domain, field, layer_count, options, result.skeleton, result.report, run);
  return result;
}

}  // namespace curvesup
