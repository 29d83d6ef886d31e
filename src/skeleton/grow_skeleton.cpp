#include "curvesup/skeleton/grow_skeleton.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "curvesup/core/error.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/skeleton/stand_angle.h"
#include "skeleton/point_grid.h"
#include "skeleton/resting_part.h"
#include "skeleton/tet_walk.h"

namespace curvesup {
namespace {

constexpr double kAngleSlack = 1e-9;  // radians: rounding of exact turns
constexpr double kLift = 0.02;        // mm above the face at which a blocked leaf starts again
constexpr double kArrival = 1e-7;     // mm: how near to its end a segment on the model must come
constexpr int kGrowthRounds = 4;
constexpr double kSteepestStand = 0.35;  // n . d_p of a model face on which a branch may stand; steeper ones are walls
constexpr double kLeastRest = 0.4;       // of each section next to a foot that must lie on something

enum class Drop : std::uint8_t { none, blocked, short_branch, no_platform, left_hull, steep };

const char* reason(Drop drop) {
  switch (drop) {
    case Drop::blocked:
      return "the model lies less than a layer below";
    case Drop::short_branch:
      return "its branch would meet the model less than a layer below";
    case Drop::no_platform:
      return "the platform cannot be reached within the self-support angle";
    case Drop::left_hull:
      return "its branch would leave the support domain";
    case Drop::steep:
      return "no direction within the self-support angle leads out of the model";
    case Drop::none:
      break;
  }
  return "";
}

// A leaf with the place and direction in which its first edge starts.
struct Start {
  Vec3 position = Vec3::Zero();
  Vec3 direction = -Vec3::UnitZ();
  Index tet = kNone;
};

struct GrowingNode {
  SkeletonNode node;
  Index lower = kNone;       // node at the other end of its edge
  Index count = 0;           // leaves above
  double lowest_leaf = 0.0;  // smallest G of those leaves
  Drop drop = Drop::none;    // why it has no edge
};

// What hangs on a node.
struct Branch {
  Index count = 1;           // leaves
  double lowest_leaf = 0.0;  // smallest G of them
};

// Of a strut that carries so many leaves: its section is the sum of theirs.
double radius_by_area(const SkeletonOptions& options, Index leaves) {
  return options.leaf_radius_mm * std::sqrt(static_cast<double>(leaves));
}

// One step down from a node.
struct Step {
  WalkResult walk;
  Drop drop = Drop::none;
};

class Grower {
 public:
  Grower(const Model& model, const Domain& domain, const ScalarField& field, int layer_count,
         const SkeletonOptions& options, const RunContext& run)
      : model_(model),
        domain_(domain),
        field_(field),
        walk_(domain, field),
        count_(layer_count),
        options_(options),
        alpha_(options.self_support.radians()),
        run_(run) {
    collect_tets_around_interface();
    lowest_layer_ =
        static_cast<Index>(std::floor(*std::min_element(field.value.begin(), field.value.end()) * count_)) - 2;
    highest_layer_ =
        static_cast<Index>(std::ceil(*std::max_element(field.value.begin(), field.value.end()) * count_)) + 1;
  }

  [[nodiscard]] std::optional<Start> start(const LeafSite& site) const;
  // Traces all leaves; the first starts.size() nodes are the leaves.
  [[nodiscard]] std::vector<GrowingNode> grow(const std::vector<Start>& starts);
  // The end of each leaf's branch, or why it has none.
  [[nodiscard]] std::vector<Drop> judge(const std::vector<GrowingNode>& nodes, Index leaves) const;
  [[nodiscard]] const TetWalk& walker() const { return walk_; }

 private:
  [[nodiscard]] double layer_value(Index k) const { return (k + 0.5) / count_; }
  // Highest layer strictly below a value.
  [[nodiscard]] Index layer_below(double value) const {
    return static_cast<Index>(std::ceil(value * count_ - 0.5 - 1e-9)) - 1;
  }

  void collect_tets_around_interface();
  [[nodiscard]] std::optional<Start> start_at_vertex(const LeafSite& site) const;
  [[nodiscard]] std::optional<Start> start_on_face(Index face, const Vec3& p) const;
  [[nodiscard]] bool enters(Index tet, Index vertex, const Vec3& u) const;

  [[nodiscard]] bool within_angle(const WalkResult& walk, const Vec3& u) const {
    return walk.entered != kNone && angle_between(walk_.down(walk.entered), u) <= alpha_ + kAngleSlack;
  }
  // How well a branch stands where its walk along u met the model.
  struct Stand {
    bool allowed = false;  // the face looks up, a layer below the lowest leaf
    double angle = -std::numeric_limits<double>::infinity();  // of its cone
    [[nodiscard]] bool broad() const { return angle >= kSlenderestStand; }
  };
  [[nodiscard]] Stand stand_of(const WalkResult& walk, const Vec3& u, const Branch& branch) const;
  [[nodiscard]] Index interface_face(Index model_tet, Index support_tet) const;
  [[nodiscard]] Step drop_node(const Vec3& p, Index tet, const Vec3& u, double value, const Branch& branch) const;
  [[nodiscard]] Vec3 host_direction(Index tet) const;

  Index add_node(const WalkResult& walk, Index layer_above);
  void connect(Index upper, Index lower);
  void process_layer(Index k);
  void attract(Index host, const std::vector<Index>& followers, Index layer);
  [[nodiscard]] bool reaches(const WalkResult& walk, const Vec3& target, double length) const;
  std::vector<Index>& active(Index k) { return active_[k - lowest_layer_]; }

  const Model& model_;
  const Domain& domain_;
  const ScalarField& field_;
  TetWalk walk_;
  int count_;
  const SkeletonOptions& options_;
  double alpha_;
  const RunContext& run_;
  Index lowest_layer_ = 0, highest_layer_ = 0;
  std::vector<Index> first_tet_, tets_around_;  // support tets around each model vertex
  std::vector<GrowingNode> nodes_;
  std::vector<std::vector<Index>> active_;  // nodes of each layer
  std::vector<char> processed_;
};

void Grower::collect_tets_around_interface() {
  first_tet_.assign(domain_.model_vertices + 1, 0);
  const auto each = [&](auto&& visit) {
    for (Index t = domain_.model_tets; t < static_cast<Index>(domain_.mesh.tets.size()); ++t) {
      for (const Index v : domain_.mesh.tets[t]) {
        if (v < domain_.model_vertices) visit(v, t);
      }
    }
  };
  each([&](Index v, Index) { ++first_tet_[v + 1]; });
  std::partial_sum(first_tet_.begin(), first_tet_.end(), first_tet_.begin());
  tets_around_.resize(first_tet_.back());
  std::vector<Index> next(first_tet_.begin(), first_tet_.end() - 1);
  each([&](Index v, Index t) { tets_around_[next[v]++] = t; });
}

// Does a ray from a corner of a tet run into it?
bool Grower::enters(Index tet, Index vertex, const Vec3& u) const {
  const auto& corner = domain_.mesh.tets[tet];
  for (int f = 0; f < 4; ++f) {
    if (corner[f] == vertex) continue;
    const auto v = face_vertices(corner, f);
    const Vec3 outward =
        area_normal(domain_.mesh.vertices[v[0]], domain_.mesh.vertices[v[1]], domain_.mesh.vertices[v[2]]);
    if (outward.dot(u) >= 0.0) return false;
  }
  return true;
}

std::optional<Start> Grower::start_at_vertex(const LeafSite& site) const {
  std::optional<Start> best;
  double best_angle = 0.0;
  for (Index i = first_tet_[site.vertex]; i < first_tet_[site.vertex + 1]; ++i) {
    const Index tet = tets_around_[i];
    const Vec3 u = turn_towards(walk_.down(tet), site.direction, alpha_);
    const double angle = angle_between(u, site.direction);
    if ((best && angle >= best_angle) || !enters(tet, site.vertex, u)) continue;
    best = Start{site.position, u, tet};
    best_angle = angle;
  }
  return best;
}

std::optional<Start> Grower::start_on_face(Index face, const Vec3& p) const {
  const Index tet = domain_.interface_tet[face];
  const auto& v = model_.boundary[face].vertices;
  const Vec3 normal =
      area_normal(model_.mesh.vertices[v[0]], model_.mesh.vertices[v[1]], model_.mesh.vertices[v[2]]).normalized();
  const Vec3 u = turn_towards(walk_.down(tet), -print_direction(field_, model_.boundary[face].tet), alpha_);
  if (u.dot(normal) <= 0.0) return std::nullopt;
  return Start{p, u, tet};
}

// A ray that would start into the solid starts again 25 % towards the face's centroid, lifted a little.
std::optional<Start> Grower::start(const LeafSite& site) const {
  if (site.vertex == kNone) return start_on_face(site.face, site.position);
  if (const auto at_vertex = start_at_vertex(site)) return at_vertex;
  const auto& v = model_.boundary[site.face].vertices;
  const Vec3 &a = model_.mesh.vertices[v[0]], &b = model_.mesh.vertices[v[1]], &c = model_.mesh.vertices[v[2]];
  const Vec3 inside = 0.75 * site.position + 0.25 * (a + b + c) / 3.0;
  auto restart = start_on_face(site.face, inside);
  if (!restart) return restart;
  const WalkResult lift =
      walk_.walk(inside, restart->tet, area_normal(a, b, c).normalized(), {.length = kLift, .stop_at_platform = false});
  if (lift.stop == WalkStop::length) {
    restart->position = lift.position;
    restart->tet = lift.tet;
    restart->direction = turn_towards(walk_.down(lift.tet), restart->direction, alpha_);
  }
  return restart;
}

Index Grower::interface_face(Index model_tet, Index support_tet) const {
  const auto& boundary = model_.boundary;
  auto it = std::lower_bound(boundary.begin(), boundary.end(), model_tet,
                             [](const BoundaryFace& f, Index tet) { return f.tet < tet; });
  const auto& corner = domain_.mesh.tets[support_tet];
  for (; it != boundary.end() && it->tet == model_tet; ++it) {
    const bool shared = std::all_of(it->vertices.begin(), it->vertices.end(), [&](Index v) {
      return std::find(corner.begin(), corner.end(), v) != corner.end();
    });
    if (shared) return static_cast<Index>(it - boundary.begin());
  }
  return kNone;
}

Grower::Stand Grower::stand_of(const WalkResult& walk, const Vec3& u, const Branch& branch) const {
  Stand stand;
  const Index face = interface_face(walk.model_tet, walk.tet);
  if (face == kNone || branch.lowest_leaf - walk_.value_at(walk.tet, walk.position) < 1.0 / count_) return stand;
  const auto& v = model_.boundary[face].vertices;
  const Vec3 normal =
      area_normal(model_.mesh.vertices[v[0]], model_.mesh.vertices[v[1]], model_.mesh.vertices[v[2]]).normalized();
  const Vec3 up = print_direction(field_, walk.model_tet);
  stand.allowed = normal.dot(up) > 0.0;
  if (normal.dot(up) < kSteepestStand) return stand;
  stand.angle = stand_angle(normal, up, -u);
  if (!stand.broad()) return stand;
  const double radius = std::min(radius_by_area(options_, branch.count), options_.max_radius_mm);
  const Foot foot = foot_of(normal, up, -u, radius, options_.leaf_radius_mm);
  const double part = resting_part(walk_, count_, {walk.position, walk.tet, -u, radius, foot},
                                   0.5 * options_.bead_width_mm * options_.bead_width_mm);
  if (part < kLeastRest) stand.angle = part - 1.0;
  return stand;
}

Vec3 Grower::host_direction(Index tet) const {
  const Vec3 down = walk_.down(tet);
  return options_.host_direction == HostDirection::normal ? down : turn_towards(down, -Vec3::UnitZ(), alpha_);
}

// The wanted direction first; where it leads nowhere, directions within the angle, the least bent one first: towards
// -z, then all around.
Step Grower::drop_node(const Vec3& p, Index tet, const Vec3& wanted, double value, const Branch& branch) const {
  const bool may_stand = options_.model_contact != ModelContact::forbidden;
  const WalkResult straight = walk_.walk(p, tet, wanted, {.value = value});
  const bool straight_allowed = within_angle(straight, wanted);
  const auto arrives = [](const WalkResult& w) { return w.stop == WalkStop::value || w.stop == WalkStop::platform; };
  if (straight_allowed && arrives(straight)) return {straight};
  Stand best;
  std::optional<WalkResult> stands;
  const auto try_stand = [&](const WalkResult& walk, const Vec3& u) {
    if (!may_stand || walk.stop != WalkStop::model) return;
    const Stand stand = stand_of(walk, u, branch);
    if (!stand.allowed || (stands && stand.angle <= best.angle)) return;
    stands = walk;
    best = stand;
  };
  if (straight_allowed) try_stand(straight, wanted);
  // A wall is left by the side, as the model is altogether where the platform is preferred.
  if (best.broad() && options_.model_contact == ModelContact::allowed) return {straight};

  const Vec3 down = walk_.down(tet);
  const Vec3 side = down.unitOrthogonal(), other = down.cross(side);
  constexpr int kTilts = 4, kAround = 8;
  for (int tilt = 1; tilt <= kTilts; ++tilt) {
    const double angle = alpha_ * tilt / kTilts;
    for (int around = -1; around < kAround; ++around) {
      const double azimuth = 2.0 * std::numbers::pi * around / kAround;
      const Vec3 u =
          around < 0
              ? turn_towards(down, -Vec3::UnitZ(), angle)
              : Vec3((std::cos(angle) * down + std::sin(angle) * (std::cos(azimuth) * side + std::sin(azimuth) * other))
                         .normalized());
      const WalkResult bent = walk_.walk(p, tet, u, {.value = value});
      if (!within_angle(bent, u)) continue;
      if (arrives(bent)) return {bent};
      if (!best.broad()) try_stand(bent, u);
    }
  }
  if (stands) return {*stands};
  if (straight.stop == WalkStop::model) return {straight, may_stand ? Drop::short_branch : Drop::no_platform};
  return {straight, straight.stop == WalkStop::hull ? Drop::left_hull : Drop::steep};
}

Index Grower::add_node(const WalkResult& walk, Index layer_above) {
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

void Grower::connect(Index upper, Index lower) {
  nodes_[upper].lower = lower;
  nodes_[lower].count += nodes_[upper].count;
  nodes_[lower].lowest_leaf = std::min(nodes_[lower].lowest_leaf, nodes_[upper].lowest_leaf);
}

bool Grower::reaches(const WalkResult& walk, const Vec3& target, double length) const {
  if (walk.stop == WalkStop::length) return true;
  return (walk.stop == WalkStop::model || walk.stop == WalkStop::platform) && length - walk.length <= kArrival &&
         (walk.position - target).norm() <= kArrival;
}

// Followers merge into the host's drop point when that is within the angle, else they turn towards it by the full
// angle.
void Grower::attract(Index host, const std::vector<Index>& followers, Index layer) {
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
    if (within_angle(segment, to_target) && high_enough) {
      connect(f, drop);
      processed_[f] = 1;
      continue;
    }
    const Vec3 u = turn_towards(walk_.down(tet), to_target, alpha_);
    const WalkResult turned = walk_.walk(p, tet, u, {.value = layer_value(layer - 1)});
    if (!within_angle(turned, u) || (turned.stop != WalkStop::value && turned.stop != WalkStop::platform)) continue;
    connect(f, add_node(turned, layer));
    processed_[f] = 1;
  }
}

// Largest branch count first, ties by id.
void Grower::process_layer(Index k) {
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
    const Step step =
        drop_node(n.node.position, n.node.tet, host_direction(n.node.tet), layer_value(k - 1), {n.count, n.lowest_leaf});
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

std::vector<GrowingNode> Grower::grow(const std::vector<Start>& starts) {
  nodes_.clear();
  processed_.clear();
  active_.assign(highest_layer_ - lowest_layer_ + 1, {});
  for (const Start& s : starts) {
    GrowingNode leaf;
    leaf.lowest_leaf = walk_.value_at(s.tet, s.position);
    leaf.node = {s.position, s.tet, layer_below(leaf.lowest_leaf) + 1, NodeKind::leaf};
    leaf.count = 1;
    nodes_.push_back(leaf);
    processed_.push_back(1);
  }
  for (Index i = 0; i < static_cast<Index>(starts.size()); ++i) {
    const Index layer = nodes_[i].node.layer;
    const Step step = drop_node(starts[i].position, starts[i].tet, starts[i].direction, layer_value(layer - 1),
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
  return nodes_;
}

std::vector<Drop> Grower::judge(const std::vector<GrowingNode>& nodes, Index leaves) const {
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

// Area rule: pi r^2 = sum of pi r_k^2 (paper, section III-B), so rho = rho_leaf sqrt(n).
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

// Walks every edge again and counts what the guarantees forbid.
void verify(const Domain& domain, const ScalarField& field, int layer_count, const SkeletonOptions& options,
            const Skeleton& skeleton, SkeletonReport& report) {
  const TetWalk walk(domain, field);
  Index through_model = 0, bad_ends = 0, short_branches = 0;
  std::vector<double> lowest_leaf(skeleton.nodes.size(), std::numeric_limits<double>::infinity());
  std::vector<Index> edges_below(skeleton.nodes.size(), 0);
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    const SkeletonNode& node = skeleton.nodes[n];
    if (node.kind == NodeKind::leaf) lowest_leaf[n] = walk.value_at(node.tet, node.position);
  }
  for (const SkeletonEdge& e : skeleton.edges) {
    const SkeletonNode &a = skeleton.nodes[e.upper], &b = skeleton.nodes[e.lower];
    const double length = (b.position - a.position).norm();
    const Vec3 u = (b.position - a.position) / length;
    const WalkResult w = walk.walk(a.position, a.tet, u, {.length = length, .stop_at_platform = false});
    if (w.stop != WalkStop::length && length - w.length > 1e-6) ++through_model;
    const Index entered = w.entered == kNone ? a.tet : w.entered;
    report.max_edge_angle_deg =
        std::max(report.max_edge_angle_deg, Angle::radians(angle_between(walk.down(entered), u)).degrees());
    report.length_mm += length;
    report.max_branch_count = std::max(report.max_branch_count, e.branch_count);
    lowest_leaf[e.lower] = std::min(lowest_leaf[e.lower], lowest_leaf[e.upper]);
    ++edges_below[e.upper];
    if (b.kind == NodeKind::platform_end || b.kind == NodeKind::model_end) report.leaf_count_at_ends += e.branch_count;
  }
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    const SkeletonNode& node = skeleton.nodes[n];
    const bool end = node.kind == NodeKind::platform_end || node.kind == NodeKind::model_end;
    if (edges_below[n] != (end ? 0 : 1)) ++bad_ends;
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

}  // namespace

SkeletonResult grow_skeleton(const Model& model, const Domain& domain, const ScalarField& field,
                             const Overhang& overhang, int layer_count, const SkeletonOptions& options,
                             const RunContext& run) {
  validate(options);
  SkeletonResult result;
  const std::vector<LeafSite> sites = place_leaves(model, field, overhang, effective_leaf_spacing(options), run);
  if (sites.empty()) {
    verify(domain, field, layer_count, options, result.skeleton, result.report);
    return result;
  }
  Grower grower(model, domain, field, layer_count, options, run);
  std::vector<const LeafSite*> kept;
  std::vector<Start> starts;
  const auto drop = [&](const LeafSite& site, Drop why) {
    result.report.dropped.push_back({site.position, site.face, reason(why)});
  };
  for (const LeafSite& site : sites) {
    if (const auto start = grower.start(site)) {
      kept.push_back(&site);
      starts.push_back(*start);
    } else {
      drop(site, Drop::steep);
    }
  }
  // Leaves without a branch must not count when hosts are chosen: grow again without them.
  std::vector<GrowingNode> nodes;
  std::vector<Drop> fate;
  for (int round = 0; round < kGrowthRounds; ++round) {
    nodes = grower.grow(starts);
    fate = grower.judge(nodes, static_cast<Index>(starts.size()));
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
  verify(domain, field, layer_count, options, result.skeleton, result.report);
  return result;
}

}  // namespace curvesup
