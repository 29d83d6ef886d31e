#pragma once

#include <span>
#include <vector>

#include "curvesup/mesh/triangle_mesh.h"

// What the hull stage takes from CGAL, in one translation unit.
namespace curvesup {

// Convex hull of points that do not lie in one plane: closed, outward oriented.
[[nodiscard]] TriangleMesh convex_hull(std::span<const Vec3> points);

// The same closed surface with edges near the given length; edges sharper than 60 degrees stay where they are.
[[nodiscard]] TriangleMesh remesh_isotropic(const TriangleMesh& surface, double edge_length);

// Exact: whether triangle i of a and triangle j of b have a point in common.
[[nodiscard]] bool triangles_meet(const TriangleMesh& a, Index i, const TriangleMesh& b, Index j);

}  // namespace curvesup
