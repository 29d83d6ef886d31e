#include <algorithm>
#include <cmath>
#include <limits>

#include "core/disjoint_sets.h"
#include "curvesup/core/format.h"
#include "curvesup/model/diagnose.h"
#include "model/mesh_checks.h"
#include "model/problem_list.h"

namespace curvesup {

namespace {

using namespace mesh_checks;
using Severity = MeshProblem::Severity;

constexpr double kCloseGap = 1e-4;  // of the bounding-box diagonal

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

class SurfaceDiagnosis : private ProblemList {
 public:
  explicit SurfaceDiagnosis(const TriangleMesh& surface) : surface_(surface) {}

  MeshDiagnosis run() {
    result_.surface = true;
    result_.vertices = size_of(surface_.vertices);
    result_.boundary_faces = size_of(surface_.triangles);
    if (surface_.triangles.empty()) {
      add("no_triangles", Severity::refused, "mesh", 1, {0}, "the file has no triangles", "export a surface");
      return std::move(result_);
    }
    measure();
    keep_true_triangles();
    look_at_edges();
    if (result_.usable()) look_for_contacts();
    if (result_.usable()) measure_shells();
    return std::move(result_);
  }

 private:
  void measure() {
    result_.low = Vec3::Constant(std::numeric_limits<double>::max());
    result_.high = -result_.low;
    for (const Vec3& v : surface_.vertices) {
      result_.low = result_.low.cwiseMin(v);
      result_.high = result_.high.cwiseMax(v);
    }
    result_.min_edge_mm = std::numeric_limits<double>::max();
    for (const auto& t : surface_.triangles) {
      const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]], &c = surface_.vertices[t[2]];
      for (const double edge : {(b - a).norm(), (c - b).norm(), (a - c).norm()}) {
        if (edge > 0.0) result_.min_edge_mm = std::min(result_.min_edge_mm, edge);
        result_.max_edge_mm = std::max(result_.max_edge_mm, edge);
      }
    }
  }

  void keep_true_triangles() {
    TrueTriangles triangles = true_triangles(surface_);
    true_ = std::move(triangles.kept);
    add("collapsed_triangles", Severity::mended, "triangle", 1, triangles.collapsed, "two corners of the triangle are one vertex",
        "the triangle is left out");
    add("repeated_triangles", Severity::mended, "triangle", 1, triangles.repeated, "the triangle is there already, turned alike",
        "the triangle is left out");
    const Vec3& origin = surface_.vertices.front();
    for (const auto& t : true_) {
      result_.volume_mm3 += tet_volume(origin, surface_.vertices[t[0]], surface_.vertices[t[1]], surface_.vertices[t[2]]);
    }
  }

  void look_at_edges() {
    const Manifold manifold = check_manifold(true_, surface_.vertices.size());
    std::vector<std::array<Index, 2>> crowded;
    std::set_difference(manifold.bad_edges.begin(), manifold.bad_edges.end(), manifold.open_edges.begin(),
                        manifold.open_edges.end(), std::back_inserter(crowded));
    add("open_edges", Severity::refused, "edge", 2, flat(manifold.open_edges),
        "the surface is open at the edge, which has a triangle on one side only", "close the hole in the program that made the file");
    add("non_manifold_edges", Severity::refused, "edge", 2, flat(crowded), "more than two triangles meet in the edge",
        "remove triangles that lie in one place or inside the part; join parts by a Boolean union, or move them apart");
    add("non_manifold_vertices", Severity::refused, "vertex", 1, manifold.bad_vertices,
        "the surface touches itself in the vertex", "join the parts by a Boolean union, or move them apart");
  }

  void look_for_contacts() {
    const double gap = kCloseGap * (result_.high - result_.low).norm();
    const Contacts contacts = find_contacts({surface_.vertices, true_}, gap);
    add("intersecting_faces", Severity::refused, "face", 3, flat(contacts.crossed),
        "an edge of the triangle passes through another triangle", "join the parts by a Boolean union");
    add("close_faces", Severity::note, "vertex", 1, contacts.close,
        format("a triangle without this vertex lies nearer than %.3g", gap), "filling may fail: separate or join the parts");
  }

  void measure_shells() {
    DisjointSets shells(surface_.vertices.size());
    std::vector<char> used(surface_.vertices.size(), 0);
    for (const auto& t : true_) {
      shells.join(t[0], t[1]);
      shells.join(t[0], t[2]);
      for (const Index v : t) used[v] = 1;
    }
    int vertices = 0;
    for (Index v = 0; v < size_of(used); ++v) {
      vertices += used[v];
      result_.components += used[v] && shells.root(v) == v;
    }
    // Euler: V - E + F = 2 for each shell, less 2 for each handle; E = 3 F / 2.
    result_.genus = result_.components - (2 * vertices - size_of(true_)) / 4;
  }

  const TriangleMesh& surface_;
  std::vector<std::array<Index, 3>> true_;  // triangles with three vertices, each once
};

}  // namespace

MeshDiagnosis diagnose_surface(const TriangleMesh& file_surface) { return SurfaceDiagnosis(file_surface).run(); }

}  // namespace curvesup
