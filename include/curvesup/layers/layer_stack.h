#pragma once

#include <array>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// The part of one layer, in one material, that is laid in one pass.
//   layer     k, the layer's number everywhere; model and support of one k share the iso-surface G = (k + 1/2) / N
//   pass      j of `passes` m: the surface G = (k + (j + 1/2) / m) / N; m = 1 for all but thick support columns
//   triangles first_triangle .. first_triangle + triangle_count - 1 of the stack
struct Sheet {
  Index layer = 0;
  int pass = 0;
  int passes = 1;
  Material material = Material::model;
  double iso_value = 0.0;
  Index first_triangle = 0;
  Index triangle_count = 0;
};

// Iso-surfaces as one flat triangle mesh. Sheets are in ascending order of (layer, pass fraction, material); their
// triangle ranges are disjoint and in the same order. Vertices are shared inside a sheet and, for the border between
// model and support of one iso-value, between sheets. Triangle normals point along +grad G. triangle_tet says in which
// tet of the domain a triangle lies, also after refinement and trimming: so its print direction is the unit gradient of that
// tet and its local thickness is 1 / (N m |grad G|).
struct LayerStack {
  int count = 0;  // N: layers per unit of G
  std::vector<Vec3> vertices;
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> triangle_tet;
  std::vector<Sheet> sheets;
};

}  // namespace curvesup
