#pragma once

#include <array>
#include <functional>
#include <vector>

#include "trim/trimmed_sheet.h"

namespace curvesup {

// Whether something carries a point of the sheet, in a tet.
using RestsThere = std::function<bool(Index tet, const Vec3& position)>;

// Leaves of a piece what rests on something and what lies no farther beside that than the layer is thick, so that each layer
// overhangs the one below by half a right angle at most; less where of what stays too little would rest. What stays becomes
// new pieces of at least `min_area_mm2`, numbered behind the others; what goes is given back in `gone`. False, with the sheet
// as it was, when nothing would stay. O(area + rests² / area), of a piece's triangles made as small as 0.25 mm.
bool clip_piece(TrimmedSheet& sheet, Index piece, const RestsThere& rests, double min_area_mm2,
                std::vector<std::array<Vec3, 3>>& gone);

}  // namespace curvesup
