#pragma once

#include <optional>
#include <span>
#include <vector>

#include "curvesup/skeleton/grow_skeleton.h"
#include "skeleton/angle_limit.h"
#include "skeleton/tet_walk.h"

namespace curvesup {

// A leaf with the place and direction in which its first edge starts.
struct Start {
  Vec3 position = Vec3::Zero();
  Vec3 direction = -Vec3::UnitZ();
  Index tet = kNone;
};

// Where the branches of leaves start: along -d_p as far as the angle allows.
class LeafStarts {
 public:
  // For sites on vertices of `sites` and on any face.
  LeafStarts(const Model& model, const Domain& domain, const ScalarField& field, const AngleLimit& self_support,
             std::span<const LeafSite> sites);

  // None where no direction within the angle leads out of the model.
  [[nodiscard]] std::optional<Start> start(const LeafSite& site) const;

 private:
  void collect_tets_around(std::span<const LeafSite> sites);
  [[nodiscard]] std::optional<Start> start_at_vertex(const LeafSite& site) const;
  [[nodiscard]] std::optional<Start> start_on_face(Index face, const Vec3& p) const;
  [[nodiscard]] bool enters(Index tet, Index vertex, const Vec3& u) const;

  const Model& model_;
  const Domain& domain_;
  const ScalarField& field_;
  TetWalk walk_;
  AngleLimit self_support_;
  std::vector<std::pair<Index, Index>> tets_around_;  // (vertex, support tet) for the sites' vertices, sorted
};

}  // namespace curvesup
