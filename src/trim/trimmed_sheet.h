#pragma once

#include <array>
#include <vector>

#include "curvesup/layers/layer_stack.h"
#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

// A face-connected part of a trimmed sheet.
struct Piece {
  double area = 0.0;
  Vec3 centroid = Vec3::Zero();
  double thickness_p95 = 0.0;  // 1 / (N |grad G|) by area, before any division into passes
  double thickness_max = 0.0;
  bool too_small = false;      // goes; its triangles stay until it is known what lay on it
};

// What the solid leaves of one sheet, with vertices of its own: `source` is the vertex of the untrimmed stack that a vertex
// is, or kNone where trimming made it.
struct TrimmedSheet {
  Sheet head;  // triangle range is not used
  std::vector<Vec3> vertices;
  std::vector<Index> source;
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> triangle_tet;
  std::vector<Index> triangle_piece;
  std::vector<Piece> pieces;
  double cut_away_area = 0.0;

  [[nodiscard]] double area(std::size_t triangle) const;
};

// Fills triangle_piece and pieces; pieces are numbered by their first triangle.
void find_pieces(TrimmedSheet& sheet, const ScalarField& field, int layer_count);

// Removes the triangles of the pieces for which keep is false; pieces keep their numbers.
void keep_pieces(TrimmedSheet& sheet, const std::vector<char>& keep);

// Gives back the memory of vertices that no triangle uses; the triangles keep their order.
void compact(TrimmedSheet& sheet);

}  // namespace curvesup
