#include "curvesup/model/fill_surface.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/model/diagnose.h"
#include "mesh/tet_budget.h"
#include "mesh/tetgen_wrapper.h"
#include "model/mesh_checks.h"

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

void refuse_too_many_tets(const MeshDiagnosis& diagnosis, const std::string& where, const FillOptions& options) {
  const double volume = std::abs(diagnosis.volume_mm3) * std::pow(options.scale, 3);
  if (expected_tets(volume, options.max_tet_volume_mm3) <= kMostTets) return;
  const Vec3 size = options.scale * (diagnosis.high - diagnosis.low);
  const std::string scale = scale_that_helps(size.maxCoeff() / options.scale);
  throw Error(ErrorKind::usage, "config keys model.scale and model.max_tet_volume_mm3",
              format("%s is %.6g x %.6g x %.6g mm large: about %.2g tets of at most %g mm3 would fill it", where.c_str(), size.x(),
                     size.y(), size.z(), expected_tets(volume, options.max_tet_volume_mm3), options.max_tet_volume_mm3),
              format("if the file is not in millimetres set model.scale, to %s perhaps; else max_tet_volume_mm3 to %.2g or more",
                     scale.c_str(), 1.05 * expected_tets(volume, kMostTets)));
}

void refuse_unfit(const TriangleMesh& surface, const std::string& where, const FillOptions& options) {
  const MeshDiagnosis diagnosis = diagnose_surface(surface);
  refuse_too_many_tets(diagnosis, where, options);
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

TetMesh fill_surface(const TriangleMesh& surface, const std::string& where, const FillOptions& options,
                     const RunContext& run) {
  refuse_unfit(surface, where, options);
  PiecewiseComplex complex{surface.vertices, mesh_checks::true_triangles(surface).kept, {}};
  const double most = options.max_tet_volume_mm3 / std::pow(options.scale, 3);
  TetMesh mesh = tetrahedralize(complex, {.max_tet_volume_mm3 = most, .where = where}, run);
  empty_cavities(mesh, std::move(complex.facets), static_cast<Index>(surface.vertices.size()));
  return mesh;
}

}  // namespace curvesup
