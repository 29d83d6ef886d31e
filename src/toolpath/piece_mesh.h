#pragma once

#include <array>
#include <span>
#include <vector>

#include "curvesup/layers/layer_stack.h"

namespace curvesup::toolpath {

// A face-connected part of one sheet as a manifold triangle mesh of its own: a vertex where two fans touch is doubled.
// Edge i of a triangle runs from its corner i to corner i + 1.
struct PieceMesh {
  std::vector<Vec3> vertices;
  std::vector<Vec3> normals;         // unit, smooth, along +grad G
  std::vector<double> tip_offset;    // at the vertices: half the thickness, smooth, so that the nozzle moves smoothly
  std::vector<std::array<Index, 3>> triangles;
  std::vector<std::array<Index, 3>> neighbours;  // across edge i; kNone on the border
  std::vector<double> thickness;                 // of the layer at each triangle
  std::vector<double> rise;                      // z of the unit gradient of G there
  double area = 0.0;
};

// All corners and ends: nowhere in a piece this small do beads run undisturbed.
[[nodiscard]] inline bool is_small(const PieceMesh& mesh, double bead_width) { return mesh.area < 16.0 * bead_width * bead_width; }

struct Edge {
  Index from = kNone, to = kNone;
  Index left = kNone, right = kNone;  // triangles; right is kNone on the border
};

struct EdgeTable {
  std::vector<Edge> edges;
  std::vector<std::array<Index, 3>> of_triangle;
};

[[nodiscard]] EdgeTable make_edges(const PieceMesh& mesh);

// The pieces of a sheet, in the order of their lowest triangle.
[[nodiscard]] std::vector<PieceMesh> split_into_pieces(const LayerStack& stack, const Sheet& sheet,
                                                       std::span<const Vec3> triangle_gradient);

[[nodiscard]] inline int next3(int i) { return i == 2 ? 0 : i + 1; }
[[nodiscard]] inline int prev3(int i) { return i == 0 ? 2 : i - 1; }

// The corner of triangle `other` where its edge to `triangle` starts, being the edge that ends at vertex `end`.
[[nodiscard]] int edge_with_end(const PieceMesh& mesh, Index triangle, Index from, Index to);

}  // namespace curvesup::toolpath
