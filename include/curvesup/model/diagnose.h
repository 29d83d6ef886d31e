#pragma once

#include <string>
#include <vector>

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

// One kind of trouble with a mesh, and every element that has it.
struct MeshProblem {
  enum class Severity {
    note,        // slicing works; worth knowing
    mended,      // load_model mends it and says so
    refused,     // load_model refuses the mesh
    no_support,  // it loads, but the space around it cannot be meshed: it slices without support only
  };
  std::string name;  // "inverted_tets", ...
  Severity severity = Severity::note;
  // What an id is: "vertex", "tet", "triangle", "edge" (two vertices), "face" (three vertices), "tet pair".
  std::string element;
  int ids_per_element = 1;
  std::vector<Index> ids;  // flat, in ascending order of the elements
  std::string text;        // one sentence
  std::string remedy;

  [[nodiscard]] std::size_t count() const { return ids.size() / static_cast<std::size_t>(ids_per_element); }
};

// "note", "mended", "refused", "no support".
[[nodiscard]] const char* severity_word(MeshProblem::Severity severity);

struct MeshDiagnosis {
  Index vertices = 0, tets = 0, boundary_faces = 0;
  bool surface = false;  // of a surface file: boundary_faces are its triangles, and there are no tets
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  double volume_mm3 = 0.0;  // of positive tets, in file units
  // Of the tets that have volume. Quality is 6 sqrt(2) V / (root mean square edge)^3: 1 for a regular tet, 0 for a flat
  // one.
  double min_dihedral_deg = 0.0, max_dihedral_deg = 0.0, min_quality = 0.0;
  Index worst_tet = kNone;
  double min_edge_mm = 0.0, max_edge_mm = 0.0;
  // Known only when nothing is refused.
  int components = 0, cavities = 0, genus = 0;
  std::vector<MeshProblem> problems;

  // Nothing that load_model would refuse.
  [[nodiscard]] bool usable() const;
  // And nothing that makes a slice with support fail.
  [[nodiscard]] bool supportable() const;
};

// Everything that is wrong, or doubtful, with a mesh as it comes from a file; later tests go on with the elements that
// passed the earlier ones. Does not throw on any mesh. O(n log n).
[[nodiscard]] MeshDiagnosis diagnose_mesh(const TetMesh& file_mesh);

// The same for a surface that fill_surface is to fill. A surface is refused when it is not closed, when more than two
// triangles meet in an edge, when it touches itself in a vertex, or when it passes through itself.
[[nodiscard]] MeshDiagnosis diagnose_surface(const TriangleMesh& file_surface);

}  // namespace curvesup
