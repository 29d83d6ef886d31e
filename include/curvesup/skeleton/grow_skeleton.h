#pragma once

#include <string>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/skeleton/skeleton.h"

namespace curvesup {

// What a branch may stand on.
//   allowed          platform or model, whichever it meets
//   forbidden        platform only; leaves that cannot reach it within the angle are dropped and listed
//   prefer_platform  goes round the model where the angle allows it, stands on the model elsewhere
enum class ModelContact { allowed, forbidden, prefer_platform };

// How a host drops: along the inverse layer normal (the paper), or straight down as far as the angle allows.
enum class HostDirection { normal, down };

struct SkeletonOptions {
  Angle self_support = Angle::degrees(45);
  double leaf_radius_mm = 0.8;
  double bead_width_mm = 0.8;
  double leaf_spacing_mm =
      -1.0;  // negative: leaf_radius_mm + half a bead; 0: a leaf for every overhang vertex (the paper)
  double merge_radius_mm = 6.0;
  double max_radius_mm = 6.0;
  double min_trunk_radius_mm = 0.0;  // of edges that carry two leaves or more
  double thickening_per_mm = 0.0;    // added to the radius for each mm of the way down from the farthest leaf
  ModelContact model_contact = ModelContact::allowed;
  HostDirection host_direction = HostDirection::normal;
};

// The spacing that is used for `leaf_spacing_mm`.
[[nodiscard]] double effective_leaf_spacing(const SkeletonOptions& options);

// A leaf that got no branch; the overhang around it has no tree below it.
struct DroppedLeaf {
  Vec3 position = Vec3::Zero();
  Index face = kNone;  // Model::boundary face it lies on
  std::string reason;
};

struct SkeletonReport {
  Index leaves = 0, nodes = 0, edges = 0;
  Index platform_ends = 0, model_ends = 0;
  Index leaf_count_at_ends = 0;
  Index max_branch_count = 0;
  double max_edge_angle_deg = 0.0;  // at upper ends, against -grad G of the tet entered
  double length_mm = 0.0;
  Index points_added = 0;  // leaves that are not vertices of the model
  std::vector<DroppedLeaf> dropped;
  std::vector<Check> checks;
};

struct SkeletonResult {
  Skeleton skeleton;
  SkeletonReport report;
};

// Support tree (paper, section III-A): leaves on the overhang, traced from layer to layer, (k + 1/2) / N, by walking
// the tets of the support domain, which is exact for the piecewise linear field. On each layer the node with the most
// branches (ties: lowest id) is host and drops; the nodes within merge_radius_mm that see its drop point follow: they
// merge into it where that takes less than the self-support angle, else they turn by that angle towards it. Guarantees:
// nodes of a skeleton are ordered so that an edge's upper node comes before its lower one; every node but the ends is
// the upper node of exactly one edge; every leaf is connected to exactly one end; ends lie at z = 0 exactly or on a
// model face with n . d_p > 0, at least one layer below each of their leaves; no edge crosses the model or the hull; no
// edge deviates from -grad G of the tet it enters by more than self_support. Leaves without such a branch are in
// `dropped`. `field` is the extended field on the whole domain. Throws Error{usage} on contradictory options. O(tets
// passed + samples log samples), about 0.1 s for 3000 leaves; the same bytes for any thread count.
[[nodiscard]] SkeletonResult grow_skeleton(const Model& model, const Domain& domain, const ScalarField& field,
                                           const Overhang& overhang, int layer_count,
                                           const SkeletonOptions& options = {}, const RunContext& run = {});

// A leaf before it is traced. Also the starting points of the envelope baseline.
struct LeafSite {
  Vec3 position = Vec3::Zero();
  Vec3 direction = -Vec3::UnitZ();  // unit, -d_p around the site, out of the model
  Index face = kNone;               // Model::boundary face it lies on
  Index vertex = kNone;             // model vertex, or kNone for a point inside a face
};

// Sites such that every overhang point is within the spacing of one (measured across d_p, and no farther along it): all
// local minima, then hexagonal lattices that follow the overhang, sqrt(3) spacings from leaf to leaf. A lattice starts at
// the place farthest from all leaves, among points of the overhang a quarter of the spacing apart, and spreads as far as there
// is room; the next one starts where something is still uncovered. Neither hangs on how the overhang is divided into
// triangles. Spacing 0: all overhang vertices. In an order in which early ones lie well apart. O(samples log samples + leaves^2).
[[nodiscard]] std::vector<LeafSite> place_leaves(const Model& model, const ScalarField& field, const Overhang& overhang,
                                                 double spacing_mm, const RunContext& run = {});

}  // namespace curvesup
