#pragma once

#include <functional>

#include "curvesup/mesh/triangle_mesh.h"

namespace make_models {

// Negative inside, smooth near its zero set, roughly a distance in millimetres.
using Implicit = std::function<double(const curvesup::Vec3&)>;

// The zero set inside the box [low, high] as a closed 2-manifold that looks outward, with well-shaped triangles of
// about the given edge length: marching tetrahedra on a body-centred cubic lattice, short edges collapsed, then rounds
// of smoothing with projection onto the set. The set must not reach the box. Throws Error{geometry} when the surface is
// finer than the lattice can show.
[[nodiscard]] curvesup::TriangleMesh mesh_zero_set(const Implicit& f, const curvesup::Vec3& low,
                                                   const curvesup::Vec3& high, double edge_mm);

// Every edge in exactly two triangles with opposite directions, every vertex with one fan of triangles.
[[nodiscard]] bool is_closed_manifold(const curvesup::TriangleMesh& mesh);

struct SurfaceTopology {
  int components = 0;
  int genus = 0;  // sum over the components
};
[[nodiscard]] SurfaceTopology surface_topology(const curvesup::TriangleMesh& mesh);

}  // namespace make_models
