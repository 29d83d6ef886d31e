#pragma once

#include <array>
#include <optional>
#include <vector>

#include "curvesup/domain/domain.h"
#include "curvesup/layers/layers.h"
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

// One pass of a slab, extracted and cut only where it is asked for: from a tet the sheet is followed across every face at
// which it may be inside the solid, so that what is found consists of whole pieces.
class PassSheet {
 public:
  PassSheet(const Domain& domain, const ScalarField& field, const std::vector<char>& reachable, const Solid& solid,
            double edge_length_mm, const Level& level)
      : domain_(domain), field_(field), reachable_(reachable), cutter_(solid, edge_length_mm), level_(level) {}

  void grow_from(Index tet);
  [[nodiscard]] const Level& level() const { return level_; }
  // What has been found up to now, with its pieces.
  [[nodiscard]] TrimmedSheet snapshot(int layer_count) const;

 private:
  void visit(Index tet);
  [[nodiscard]] Index crossing(Index tet, int edge);
  void add_clipped(const std::array<Index, 4>& ring, int size, Index tet);

  const Domain& domain_;
  const ScalarField& field_;
  const std::vector<char>& reachable_;
  SheetCutter cutter_;
  Level level_;
  EdgeMap visited_, crossings_, platform_cuts_;
  std::vector<Index> pending_;
};

}  // namespace curvesup
