#include "hull/convex_surface.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "curvesup/core/error.h"

namespace curvesup {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
namespace Pmp = CGAL::Polygon_mesh_processing;

constexpr double kFeatureAngleDeg = 60.0;
constexpr unsigned kRemeshRounds = 3;
constexpr double kHullNoise = 1e-6;  // mm

Point to_cgal(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

TriangleMesh from_cgal(const Surface& surface) {
  TriangleMesh mesh;
  std::vector<Index> id(surface.num_vertices() + surface.number_of_removed_vertices(), kNone);
  for (const auto v : surface.vertices()) {
    id[v] = static_cast<Index>(mesh.vertices.size());
    const Point& p = surface.point(v);
    mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : surface.faces()) {
    std::array<Index, 3> triangle{};
    int corner = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f))) triangle[corner++] = id[v];
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

// CGAL numbers the hull's vertices by their addresses: number them, and the triangles, by their coordinates instead.
TriangleMesh in_canonical_order(const TriangleMesh& mesh) {
  const auto before = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::vector<Index> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return before(mesh.vertices[a], mesh.vertices[b]); });
  TriangleMesh result;
  std::vector<Index> rank(order.size());
  for (const Index v : order) {
    rank[v] = static_cast<Index>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
  }
  for (const auto& t : mesh.triangles) {
    std::array<Index, 3> triangle = {rank[t[0]], rank[t[1]], rank[t[2]]};
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    result.triangles.push_back(triangle);
  }
  std::sort(result.triangles.begin(), result.triangles.end());
  return result;
}

// A number in [-1, 1) that depends on `index` alone.
double noise(std::uint64_t index) {
  index = (index + 1) * 0x9e3779b97f4a7c15ULL;
  index = (index ^ (index >> 30)) * 0xbf58476d1ce4e5b9ULL;
  index = (index ^ (index >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<double>((index ^ (index >> 31)) >> 11) * 0x1p-52 - 1.0;
}

Surface to_surface(const TriangleMesh& mesh) {
  Surface surface;
  std::vector<Surface::Vertex_index> id;
  for (const Vec3& p : mesh.vertices) id.push_back(surface.add_vertex(to_cgal(p)));
  for (const auto& t : mesh.triangles) surface.add_face(id[t[0]], id[t[1]], id[t[2]]);
  return surface;
}

Kernel::Triangle_3 corner_triangle(const TriangleMesh& mesh, Index t) {
  const auto& v = mesh.triangles[t];
  return {to_cgal(mesh.vertices[v[0]]), to_cgal(mesh.vertices[v[1]]), to_cgal(mesh.vertices[v[2]])};
}

}  // namespace

namespace {
Surface hull_of(const std::vector<Point>& points) {
  Surface surface;
  CGAL::convex_hull_3(points.begin(), points.end(), surface);
  if (surface.number_of_faces() < 4) {
    throw Error(ErrorKind::geometry, "hull", "the model and its trajectories lie in one plane", "check the model's scale");
  }
  return surface;
}
}  // namespace

// Flat facets are triangulated by addresses too. A nanometre of noise leaves one way only; it is given to the hull's own
// vertices alone, since points inside a flat facet would become vertices of needles.
TriangleMesh convex_hull(std::span<const Vec3> points) {
  std::vector<Point> input;
  input.reserve(points.size());
  for (const Vec3& p : points) input.push_back(to_cgal(p));
  const std::vector<Vec3> extreme = in_canonical_order(from_cgal(hull_of(input))).vertices;
  input.clear();
  for (std::size_t i = 0; i < extreme.size(); ++i) {
    input.push_back(to_cgal(extreme[i] + kHullNoise * Vec3(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2))));
  }
  return in_canonical_order(from_cgal(hull_of(input)));
}

TriangleMesh remesh_isotropic(const TriangleMesh& mesh, double edge_length) {
  Surface surface = to_surface(mesh);
  auto feature = surface.add_property_map<Surface::Edge_index, bool>("e:feature", false).first;
  Pmp::detect_sharp_edges(surface, kFeatureAngleDeg, feature);
  // Long features must be divided first: remeshing keeps their edges as they are otherwise.
  std::vector<Surface::Edge_index> sharp;
  for (const auto e : surface.edges()) {
    if (feature[e]) sharp.push_back(e);
  }
  Pmp::split_long_edges(sharp, 4.0 / 3.0 * edge_length, surface, CGAL::parameters::edge_is_constrained_map(feature));
  Pmp::isotropic_remeshing(surface.faces(), edge_length, surface,
                           CGAL::parameters::number_of_iterations(kRemeshRounds)
                               .protect_constraints(false)
                               .edge_is_constrained_map(feature));
  surface.collect_garbage();
  return from_cgal(surface);
}

bool triangles_meet(const TriangleMesh& a, Index i, const TriangleMesh& b, Index j) {
  return CGAL::do_intersect(corner_triangle(a, i), corner_triangle(b, j));
}

}  // namespace curvesup
