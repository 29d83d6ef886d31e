#include "skeleton/verify_skeleton.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "core/angle_between.h"
#include "skeleton/tet_walk.h"

namespace curvesup {
namespace {

constexpr double kArrival = 1e-6;  // mm: how near to its end an edge must come
constexpr std::size_t kGrain = 1024;

bool is_end(const SkeletonNode& node) {
  return node.kind == NodeKind::platform_end || node.kind == NodeKind::model_end;
}

// Does a point of a support tet lie on a model face that faces up?
bool on_upward_face(const Domain& domain, const ScalarField& field, const SkeletonNode& node) {
  for (int f = 0; f < 4; ++f) {
    const Index behind = domain.topology.neighbours[node.tet][f];
    if (behind == kNone || domain.region(behind) != Material::model) continue;
    const auto v = face_vertices(domain.mesh.tets[node.tet], f);
    const auto& at = domain.mesh.vertices;
    const Vec3 into_model = area_normal(at[v[0]], at[v[1]], at[v[2]]).normalized();
    if (std::abs(into_model.dot(node.position - at[v[0]])) < 1e-6 && into_model.dot(field.gradient[behind]) < 0.0)
      return true;
  }
  return false;
}

// What walking an edge again shows.
struct EdgeWalk {
  double length = 0.0;
  double angle = 0.0;  // against -grad G of the tets it enters
  bool arrives = false;
};

std::vector<EdgeWalk> walk_edges(const TetWalk& walk, const Skeleton& skeleton, const RunContext& run) {
  std::vector<EdgeWalk> result(skeleton.edges.size());
  parallel_for(result.size(), kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const SkeletonNode &a = skeleton.nodes[skeleton.edges[i].upper], &b = skeleton.nodes[skeleton.edges[i].lower];
      const double length = (b.position - a.position).norm();
      const Vec3 u = (b.position - a.position) / length;
      const WalkResult w = walk.walk(a.position, a.tet, u, {.length = length, .stop_at_platform = false});
      double angle = w.entered().empty() ? angle_between(walk.down(a.tet), u) : 0.0;
      for (const Index tet : w.entered()) angle = std::max(angle, angle_between(walk.down(tet), u));
      result[i] = {length, angle, w.stop == WalkStop::length || length - w.length <= kArrival};
    }
  });
  return result;
}

}  // namespace

void verify_skeleton(const Domain& domain, const ScalarField& field, int layer_count, const SkeletonOptions& options,
                     const Skeleton& skeleton, SkeletonReport& report, const RunContext& run) {
  const TetWalk walk(domain, field);
  Index through_model = 0, bad_ends = 0, short_branches = 0;
  std::vector<double> lowest_leaf(skeleton.nodes.size(), std::numeric_limits<double>::infinity());
  std::vector<Index> edges_below(skeleton.nodes.size(), 0);
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    const SkeletonNode& node = skeleton.nodes[n];
    if (node.kind == NodeKind::leaf) lowest_leaf[n] = walk.value_at(node.tet, node.position);
  }
  const std::vector<EdgeWalk> walks = walk_edges(walk, skeleton, run);
  for (std::size_t i = 0; i < walks.size(); ++i) {
    const SkeletonEdge& e = skeleton.edges[i];
    if (!walks[i].arrives) ++through_model;
    report.max_edge_angle_deg = std::max(report.max_edge_angle_deg, Angle::radians(walks[i].angle).degrees());
    report.length_mm += walks[i].length;
    report.max_branch_count = std::max(report.max_branch_count, e.branch_count);
    lowest_leaf[e.lower] = std::min(lowest_leaf[e.lower], lowest_leaf[e.upper]);
    ++edges_below[e.upper];
    if (is_end(skeleton.nodes[e.lower])) report.leaf_count_at_ends += e.branch_count;
  }
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    const SkeletonNode& node = skeleton.nodes[n];
    if (edges_below[n] != (is_end(node) ? 0 : 1)) ++bad_ends;
    if (node.kind == NodeKind::leaf) ++report.leaves;
    if (node.kind == NodeKind::platform_end) {
      ++report.platform_ends;
      if (node.position.z() != 0.0) ++bad_ends;
    }
    if (node.kind == NodeKind::model_end) {
      ++report.model_ends;
      if (lowest_leaf[n] - walk.value_at(node.tet, node.position) < 1.0 / layer_count) ++short_branches;
      if (options.model_contact == ModelContact::forbidden || !on_upward_face(domain, field, node)) ++bad_ends;
    }
  }
  report.nodes = static_cast<Index>(skeleton.nodes.size());
  report.edges = static_cast<Index>(skeleton.edges.size());
  report.checks.push_back(check_equal("skeleton.leaves_conserved", report.leaf_count_at_ends, report.leaves,
                                      "sum of the branch counts at the ends against the number of leaves"));
  report.checks.push_back(check_equal("skeleton.edges_through_model", through_model, 0,
                                      "edges that meet the model or leave the support domain"));
  report.checks.push_back(check_at_most("skeleton.edge_angle_deg", report.max_edge_angle_deg,
                                        options.self_support.degrees() + 0.1,
                                        "largest angle of an edge against -grad G of the tet it enters"));
  report.checks.push_back(
      check_equal("skeleton.loose_nodes", bad_ends, 0,
                  "nodes without exactly one edge down, ends neither at z = 0 nor on a model face that faces up"));
  report.checks.push_back(
      check_equal("skeleton.short_branches", short_branches, 0, "model ends less than a layer below their leaf"));
}

}  // namespace curvesup
