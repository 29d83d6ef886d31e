#include "curvesup/model/fill_surface.h"

#include <algorithm>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/model/diagnose.h"
#include "mesh/tetgen_wrapper.h"

namespace curvesup {

namespace {

std::array<Index, 3> sorted(std::array<Index, 3> face) {
  std::sort(face.begin(), face.end());
  return face;
}

Vec3 place_of(const TriangleMesh& surface, const MeshProblem& problem) {
  const Index id = problem.ids.front();
  const Vec3& place = problem.element == "triangle" ? surface.vertices[surface.triangles[id][0]] : surface.vertices[id];
  return place;
}

void refuse_unfit(const TriangleMesh& surface, const std::string& where) {
  const MeshDiagnosis diagnosis = diagnose_surface(surface);
  for (const MeshProblem& problem : diagnosis.problems) {
    if (problem.severity != MeshProblem::Severity::refused) continue;
    if (surface.triangles.empty()) throw Error(ErrorKind::input, where, problem.text, problem.remedy);
    const Vec3 at = place_of(surface, problem);
    throw Error(ErrorKind::input, where,
                format("%s; %zu such, the first at (%.3f, %.3f, %.3f)", problem.text.c_str(), problem.count(), at.x(), at.y(), at.z()),
                problem.remedy + "; curvesup inspect marks them all");
  }
}

// How many triangles of the surface lie between each tet and the outside, at least.
std::vector<Index> depths(const TetMesh& mesh, const std::vector<std::array<Index, 3>>& walls) {
  const TetTopology topology = build_topology(mesh);
  std::vector<Index> depth(mesh.tets.size(), kNone), wave, next;
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    const auto& around = topology.neighbours[t];
    if (std::find(around.begin(), around.end(), kNone) != around.end()) wave.push_back(t);
  }
  // Every face that has no tet behind it is a wall: the outermost tets are behind one.
  for (Index level = 1; !wave.empty(); ++level, wave.swap(next), next.clear()) {
    while (!wave.empty()) {
      const Index t = wave.back();
      wave.pop_back();
      if (depth[t] != kNone) continue;
      depth[t] = level;
      for (int f = 0; f < 4; ++f) {
        const Index other = topology.neighbours[t][f];
        if (other == kNone || depth[other] != kNone) continue;
        const bool wall = std::binary_search(walls.begin(), walls.end(), sorted(face_vertices(mesh.tets[t], f)));
        (wall ? next : wave).push_back(other);
      }
    }
  }
  return depth;
}

void empty_cavities(TetMesh& mesh, std::vector<std::array<Index, 3>> walls, Index surface_vertices) {
  for (auto& wall : walls) wall = sorted(wall);
  std::sort(walls.begin(), walls.end());
  const std::vector<Index> depth = depths(mesh, walls);
  Index kept = 0;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (depth[t] % 2 == 1) mesh.tets[kept++] = mesh.tets[t];
  }
  mesh.tets.resize(kept);
  drop_unused_vertices(mesh, surface_vertices);
}

}  // namespace

TetMesh fill_surface(const TriangleMesh& surface, const std::string& where, const FillOptions& options) {
  refuse_unfit(surface, where);
  PiecewiseComplex complex{surface.vertices, {}, {}};
  for (const auto& t : surface.triangles) {
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) complex.facets.push_back(t);
  }
  TetMesh mesh = tetrahedralize(complex, {.max_tet_volume_mm3 = options.max_tet_volume_mm3, .where = where});
  empty_cavities(mesh, std::move(complex.facets), static_cast<Index>(surface.vertices.size()));
  return mesh;
}

}  // namespace curvesup
