#pragma once

#include "curvesup/model/model.h"

namespace curvesup {

// The linear part of `options` without scale: up axis, then rotations about x, y, z. Exact for multiples of 90 degrees.
[[nodiscard]] Mat3 placement_rotation(const PlaceOptions& options);

// Checks, mends and places a mesh in file coordinates (pipeline: scale, up axis, rotate, move, drop).
//   mended    inverted tets (two vertices swapped), duplicate vertices (tets are moved to the first of them);
//             both counted in the report
//   kept      every vertex keeps its index, also unreferenced ones: field files hold one value a vertex
//   refused   by Error{input} naming the elements: no tets, a coordinate that is no finite number, an index out of
//   range,
//             a tet without volume (below 1e-12 of the bounding-box diagonal cubed), tets that overlap across a face,
//             more than two tets on a face, a boundary that is no closed 2-manifold
// Guarantees what Model promises. O(n log n) time, about 250 bytes a tet while it runs.
[[nodiscard]] ModelResult load_model(std::string name, TetMesh file_mesh, const PlaceOptions& options = {},
                                     const RunContext& run = {});

}  // namespace curvesup
