#pragma once

#include "curvesup/toolpath/plan_toolpaths.h"
#include "toolpath/beads.h"

namespace curvesup::toolpath {

struct FilledPiece {
  std::vector<BeadPath> paths;
  Index rings = 0, centre_lines = 0, lines = 0, dots = 0;
  Index naive_paths = 0;  // one for each ring, line and dot
};

// All beads of one piece. Where the material is filled by lines and `sparse` holds, they are line_spacing_mm apart.
[[nodiscard]] FilledPiece fill_piece(PieceMesh mesh, const Sheet& sheet, const ToolpathOptions& options, bool sparse = false);

}  // namespace curvesup::toolpath
