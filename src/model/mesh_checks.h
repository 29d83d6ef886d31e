#pragma once

#include <array>
#include <string>
#include <vector>

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

// What can be wrong with tets as they come from a file. All lists are in ascending order.
namespace curvesup::mesh_checks {

inline constexpr double kZeroVolume = 1e-12;  // of the bounding-box diagonal cubed

struct Box {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  [[nodiscard]] double diagonal() const { return (high - low).norm(); }
};
// Of the finite vertices that tets with valid indices use; of all finite vertices when there is none.
[[nodiscard]] Box bounding_box(const TetMesh& mesh);

[[nodiscard]] std::vector<Index> vertices_not_finite(const TetMesh& mesh);
[[nodiscard]] std::vector<Index> tets_out_of_range(const TetMesh& mesh);

// Per vertex the first vertex with exactly the same coordinates (itself for most).
[[nodiscard]] std::vector<Index> first_of_equal_vertices(const TetMesh& mesh);
// Vertices that no tet uses. Indices must be in range, here and below.
[[nodiscard]] std::vector<Index> unreferenced_vertices(const TetMesh& mesh);

struct Volumes {
  std::vector<Index> zero, negative;
};
[[nodiscard]] Volumes classify_volumes(const TetMesh& mesh, double diagonal);

struct Faces {
  std::vector<std::array<Index, 3>> overfull;     // vertices of faces with more than two tets
  std::vector<std::array<Index, 2>> overlapping;  // tets that lie on the same side of their common face
  std::vector<std::array<Index, 3>> boundary;     // oriented outwards, of faces with one tet
};
// Expects positive tets.
[[nodiscard]] Faces classify_faces(const TetMesh& mesh);

// The triangles of a surface less those with two corners in one vertex and those that repeat an earlier one, turned alike.
struct TrueTriangles {
  std::vector<std::array<Index, 3>> kept;
  std::vector<Index> collapsed, repeated;
};
[[nodiscard]] TrueTriangles true_triangles(const TriangleMesh& surface);

struct Manifold {
  std::vector<std::array<Index, 2>> bad_edges;   // of boundary edges that do not have exactly two faces
  std::vector<std::array<Index, 2>> open_edges;  // those of them with one face
  std::vector<Index> bad_vertices;              // off those edges: boundary faces around them form more than one fan
};
[[nodiscard]] Manifold check_manifold(const std::vector<std::array<Index, 3>>& faces, std::size_t vertices);

// Faces that have an edge through another face, by their vertices, and vertices nearer than `gap` to a face. Faces
// with a vertex in common are not compared.
struct Contacts {
  std::vector<std::array<Index, 3>> crossed;
  std::vector<Index> close;
};
[[nodiscard]] Contacts find_contacts(const TriangleMesh& surface, double gap);

struct Shape {
  int components = 0;  // face-connected volume components
  int genus = 0;       // sum over the boundary's components
  int cavities = 0;    // boundary components that enclose no material
  int shells = 0;      // boundary components
};
// Of valid tets with a manifold boundary.
[[nodiscard]] Shape measure_shape(const TetMesh& mesh, const TetTopology& topology,
                                  const std::vector<BoundaryFace>& boundary);

}  // namespace curvesup::mesh_checks
