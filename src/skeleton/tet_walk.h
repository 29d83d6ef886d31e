#pragma once

#include <array>
#include <limits>
#include <span>

#include "curvesup/domain/domain.h"

namespace curvesup {

// How a walk through the support tets ended.
enum class WalkStop {
  value,     // G fell to the wanted value
  platform,  // z = 0, exactly
  model,     // a model face; `position` lies on it
  hull,      // the outer boundary of the domain
  length,    // the wanted length was walked
  lost,      // degenerate tets: no way on
};

struct WalkResult {
  WalkStop stop = WalkStop::lost;
  Vec3 position = Vec3::Zero();
  Index tet = kNone;        // support tet that holds position
  Index model_tet = kNone;  // behind the face, when stop is model
  double length = 0.0;

  // The tets in which the walk covers its first kEntry mm: where it only grazes one, the next one counts, too. None where
  // it makes no way.
  static constexpr double kEntry = 1e-4;
  [[nodiscard]] std::span<const Index> entered() const { return std::span(first_tets).first(static_cast<std::size_t>(first_tet_count)); }
  void enter(Index t) {
    if (first_tet_count < static_cast<int>(first_tets.size())) first_tets[static_cast<std::size_t>(first_tet_count++)] = t;
  }
  std::array<Index, 4> first_tets{kNone, kNone, kNone, kNone};
  int first_tet_count = 0;
};

struct WalkGoal {
  double value = -std::numeric_limits<double>::infinity();
  double length = std::numeric_limits<double>::infinity();
  bool stop_at_platform = true;
};

// Walks straight rays through the support tets of a domain. Exact up to rounding on the piecewise linear field.
class TetWalk {
 public:
  TetWalk(const Domain& domain, const ScalarField& field) : domain_(domain), field_(field) {}

  // From `start` inside or on the border of support tet `tet` along the unit vector `direction`.
  [[nodiscard]] WalkResult walk(const Vec3& start, Index tet, const Vec3& direction, const WalkGoal& goal) const;

  [[nodiscard]] double value_at(Index tet, const Vec3& p) const {
    const Index v = domain_.mesh.tets[tet][0];
    return field_.value[v] + field_.gradient[tet].dot(p - domain_.mesh.vertices[v]);
  }
  // How fast G rises along a unit vector.
  [[nodiscard]] double slope(Index tet, const Vec3& direction) const { return field_.gradient[tet].dot(direction); }
  // Unit -grad G of a tet.
  [[nodiscard]] Vec3 down(Index tet) const { return -print_direction(field_, tet); }

 private:
  const Domain& domain_;
  const ScalarField& field_;
};

}  // namespace curvesup
