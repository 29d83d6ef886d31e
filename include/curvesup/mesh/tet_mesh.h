#pragma once

#include <array>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Tetrahedra over shared vertices. Valid means: all indices in range, every tet positively oriented
// ((v1-v0) x (v2-v0) . (v3-v0) > 0).
struct TetMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<Index, 4>> tets;
};

// Local vertices of the face opposite local vertex f; the face's normal points out of a positively oriented tet.
inline constexpr std::array<std::array<int, 3>, 4> kTetFace = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
// Local end points of the six edges of a tet.
inline constexpr std::array<std::array<int, 2>, 6> kTetEdge = {{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

[[nodiscard]] inline std::array<Index, 3> face_vertices(const std::array<Index, 4>& tet, int face) {
  const auto& local = kTetFace[face];
  return {tet[local[0]], tet[local[1]], tet[local[2]]};
}

// Six times the signed volume of a tet is the determinant of its edge vectors; this is the volume itself.
[[nodiscard]] double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);
[[nodiscard]] double tet_volume(const TetMesh& mesh, Index tet);
[[nodiscard]] double total_volume(const TetMesh& mesh);

// Across face f of tet t lies tet neighbours[t][f], or kNone outside.
struct TetTopology {
  std::vector<std::array<Index, 4>> neighbours;
};

// O(tets) by sorting faces. Throws Error{input} when three or more tets share a face.
[[nodiscard]] TetTopology build_topology(const TetMesh& mesh);

// A triangle of the boundary, seen from outside counter-clockwise, with the tet behind it.
struct BoundaryFace {
  Index tet = kNone;
  int face = 0;
  std::array<Index, 3> vertices{};
};

// In ascending order of (tet, face).
[[nodiscard]] std::vector<BoundaryFace> boundary_faces(const TetMesh& mesh, const TetTopology& topology);

// A piecewise linear scalar field: one value a vertex, one constant gradient a tet.
struct ScalarField {
  std::vector<double> value;
  std::vector<Vec3> gradient;
};

// Gradient of the linear function that has the four given values at the tet's vertices.
[[nodiscard]] Vec3 tet_gradient(const TetMesh& mesh, Index tet, std::span<const double> vertex_value);
[[nodiscard]] ScalarField make_scalar_field(const TetMesh& mesh, std::vector<double> vertex_value);

// d_p: the gradient of a tet as a unit vector; (0,0,1) where the gradient vanishes.
[[nodiscard]] Vec3 print_direction(const ScalarField& field, Index tet);

}  // namespace curvesup
