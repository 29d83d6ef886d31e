#pragma once

#include <algorithm>

#include "curvesup/skeleton/grow_skeleton.h"
#include "curvesup/skeleton/stand_angle.h"
#include "skeleton/angle_limit.h"
#include "skeleton/tet_walk.h"

namespace curvesup {

// Why a node has no edge down.
enum class Drop : std::uint8_t { none, blocked, short_branch, no_platform, left_hull, steep };
[[nodiscard]] const char* reason(Drop drop);

// What hangs on a node.
struct Branch {
  Index count = 1;           // leaves
  double lowest_leaf = 0.0;  // smallest G of them
};

// One step down from a node.
struct Step {
  WalkResult walk;
  Drop drop = Drop::none;
};

// How hosts drop to the next layer, and where they may stand on the model.
class NodeDrop {
 public:
  NodeDrop(const Model& model, const Domain& domain, const ScalarField& field, int layer_count,
           const SkeletonOptions& options);

  // From p in a tet down to a value of G. The wanted direction first; where it leads nowhere, directions within the
  // angle, the least bent one first: towards -z, then all around.
  [[nodiscard]] Step step(const Vec3& p, Index tet, const Vec3& wanted, double value, const Branch& branch) const;
  [[nodiscard]] Vec3 host_direction(Index tet) const;
  // Did a walk along u start within the angle?
  [[nodiscard]] bool within_angle(const WalkResult& walk, const Vec3& u) const {
    const std::span<const Index> tets = walk.entered();
    return !tets.empty() && std::all_of(tets.begin(), tets.end(), [&](Index t) { return self_support_.holds(walk_.down(t), u); });
  }

 private:
  // How well a branch stands where its walk along u met the model.
  struct Stand {
    bool allowed = false;  // the face looks up, a layer below the lowest leaf
    double angle = -std::numeric_limits<double>::infinity();  // of its cone
    [[nodiscard]] bool broad() const { return angle >= kSlenderestStand; }
  };
  [[nodiscard]] Stand stand_of(const WalkResult& walk, const Vec3& u, const Branch& branch) const;
  [[nodiscard]] Index interface_face(Index model_tet, Index support_tet) const;

  const Model& model_;
  const Domain& domain_;
  const ScalarField& field_;
  TetWalk walk_;
  int count_;
  const SkeletonOptions& options_;
  AngleLimit self_support_;
};

// Area rule: pi r^2 = sum of pi r_k^2 (paper, section III-B), so rho = rho_leaf sqrt(n) for a strut that carries n leaves.
[[nodiscard]] double radius_by_area(const SkeletonOptions& options, Index leaves);

}  // namespace curvesup
