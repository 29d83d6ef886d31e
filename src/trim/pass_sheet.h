#pragma once

#include <array>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/disjoint_sets.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layers.h"
#include "layers/cut_cases.h"
#include "trim/reachable_tets.h"
#include "trim/sheet_cutter.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

// The point with G = target on the gradient line through p. Followed through the support tets: none where the line meets
// the model or the outer boundary first. Followed through everything: with no tet where it leaves the domain.
// O(tets passed).
struct ColumnPoint {
  Index tet = kNone;
  Vec3 position = Vec3::Zero();
};
enum class Through { support, everything };
[[nodiscard]] std::optional<ColumnPoint> follow_gradient(const Domain& domain, const ScalarField& field, Index tet, const Vec3& p,
                                                         double target, Through through = Through::support);

// One pass of a slab, extracted and cut only where it is asked for: the pieces that are wanted are followed from tet to tet
// until they are whole. What else lies in the tets on the way is there in parts. With `only`, there is nothing but in its tets.
class PassSheet {
 public:
  PassSheet(const Domain& domain, const ScalarField& field, const ReachableTets& reachable, const Solid& solid,
            double edge_length_mm, const Level& level, std::function<bool(Index tet)> only = {})
      : domain_(domain), field_(field), reachable_(reachable), cutter_(solid, edge_length_mm), level_(level), only_(std::move(only)) {}

  // Wants what lies in the tet of a point and near it; or the piece of a vertex.
  void want(const ColumnPoint& at, double within_mm = 1.0);
  void want(Index vertex) { wanted_[pieces_.root(vertex)] = 1; }
  // Follows what is wanted; whether there was anything to follow.
  bool grow();
  [[nodiscard]] const Level& level() const { return level_; }
  [[nodiscard]] std::size_t triangle_count() const { return cutter_.triangles().size(); }
  // What has been found up to now, with its pieces.
  [[nodiscard]] TrimmedSheet snapshot(int layer_count) const;

 private:
  // The triangles of a tet.
  struct Range {
    std::size_t first, last;
  };
  // A tet that has not been visited, at a face which the piece of a vertex crosses.
  struct Step {
    Index tet, vertex;
  };

  Range visit(Index tet);
  void cut(Index tet);
  void join_corners(const Range& range);
  void look_beyond(Index tet, const CutCase& cut, const std::array<Index, 4>& ring);
  [[nodiscard]] Index crossing(Index tet, int edge);
  [[nodiscard]] Index platform_cut(Index a, Index b);
  void add_clipped(const std::array<Index, 4>& ring, int size, Index tet);

  const Domain& domain_;
  const ScalarField& field_;
  const ReachableTets& reachable_;
  SheetCutter cutter_;
  Level level_;
  std::function<bool(Index tet)> only_;
  EdgeMap range_of_, crossings_, platform_cuts_;
  std::vector<Range> ranges_;  // of the tets that have been visited
  std::vector<Step> steps_;
  DisjointSets pieces_{0};    // of the vertices, by the triangles found up to now
  std::vector<char> wanted_;  // at their roots
};

}  // namespace curvesup
