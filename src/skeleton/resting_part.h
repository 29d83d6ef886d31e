#pragma once

#include "curvesup/skeleton/stand_angle.h"
#include "skeleton/tet_walk.h"

namespace curvesup {

// A trunk where it stands on the model.
struct StandingTrunk {
  Vec3 end;    // on the model's face
  Index tet;   // support tet there
  Vec3 axis;   // unit, upwards
  double radius_mm;
  Foot foot;
};

// Of the trunk's sections by the layers next to its end, the least part that lies over the model or over the trunk's own
// section a layer below; parts below `min_piece_area_mm2` are not printed. A foot may lie well on its face and still hang
// beside a bar that is thinner than the trunk.
[[nodiscard]] double resting_part(const TetWalk& walk, int layer_count, const StandingTrunk& trunk, double min_piece_area_mm2);

}  // namespace curvesup
