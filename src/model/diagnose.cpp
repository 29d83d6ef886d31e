#include "curvesup/model/diagnose.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "curvesup/core/format.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "core/angle_between.h"
#include "model/mesh_checks.h"
#include "model/problem_list.h"

namespace curvesup {

namespace {

using namespace mesh_checks;
using Severity = MeshProblem::Severity;

constexpr double kNeedleQuality = 0.02;
constexpr double kCloseGap = 1e-4;  // of the bounding-box diagonal

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

class Diagnosis : private ProblemList {
 public:
  explicit Diagnosis(const TetMesh& mesh) : mesh_(mesh) {}

  MeshDiagnosis run() {
    result_.vertices = size_of(mesh_.vertices);
    result_.tets = size_of(mesh_.tets);
    if (mesh_.tets.empty())
      add("no_tets", Severity::refused, "mesh", 1, {0}, "the mesh has no tets", "export a tetrahedral mesh");
    keep_usable_tets();
    look_at_vertices();
    orient();
    measure_tets();
    look_at_faces();
    return std::move(result_);
  }

 private:
  // Tets whose four corners exist and are finite go on, as tets of sound_; file_tet_ keeps their ids.
  void keep_usable_tets() {
    const auto out_of_range = tets_out_of_range(mesh_);
    add("index_out_of_range", Severity::refused, "tet", 1, out_of_range, "vertex index outside the file's vertices",
        "indices start at 0");
    add("not_finite", Severity::refused, "vertex", 1, vertices_not_finite(mesh_), "coordinate is no finite number",
        "mend the file");
    std::size_t next_bad = 0;
    for (Index t = 0; t < size_of(mesh_.tets); ++t) {
      if (next_bad < out_of_range.size() && out_of_range[next_bad] == t) {
        ++next_bad;
        continue;
      }
      const auto& tet = mesh_.tets[t];
      if (!std::all_of(tet.begin(), tet.end(), [&](Index v) { return mesh_.vertices[v].allFinite(); })) continue;
      sound_.tets.push_back(tet);
      file_tet_.push_back(t);
    }
    sound_.vertices = mesh_.vertices;
    const Box box = bounding_box(sound_);
    result_.low = box.low;
    result_.high = box.high;
    diagonal_ = box.diagonal();
  }

  void look_at_vertices() {
    add("unreferenced_vertices", Severity::note, "vertex", 1, unreferenced_vertices(sound_), "no tet uses the vertex",
        "harmless; its field value is ignored");
    const auto first = first_of_equal_vertices(sound_);
    std::vector<Index> duplicates;
    for (Index v = 0; v < size_of(first); ++v) {
      if (first[v] != v) duplicates.push_back(v);
    }
    add("duplicate_vertices", Severity::mended, "vertex", 1, duplicates, "another vertex lies at the same place",
        "its tets are moved to the first of them");
    for (auto& tet : sound_.tets) {
      for (Index& v : tet) v = first[v];
    }
  }

  std::vector<Index> file_tets(std::vector<Index> tets) const {
    for (Index& t : tets) t = file_tet_[t];
    return tets;
  }

  void orient() {
    const auto volumes = classify_volumes(sound_, diagonal_);
    add("zero_volume", Severity::refused, "tet", 1, file_tets(volumes.zero),
        "tet without volume (below 1e-12 of the bounding-box diagonal cubed)", "remesh, or collapse the tet");
    add("inverted_tets", Severity::mended, "tet", 1, file_tets(volumes.negative),
        size_of(volumes.negative) == size_of(sound_.tets) ? "all tets are inside out" : "tet is inside out",
        "two of its vertices are swapped");
    for (const Index t : volumes.negative) std::swap(sound_.tets[t][2], sound_.tets[t][3]);
    std::size_t next_zero = 0;
    Index kept = 0;
    for (Index t = 0; t < size_of(sound_.tets); ++t) {
      if (next_zero < volumes.zero.size() && volumes.zero[next_zero] == t) {
        ++next_zero;
        continue;
      }
      sound_.tets[kept] = sound_.tets[t];
      file_tet_[kept++] = file_tet_[t];
    }
    sound_.tets.resize(kept);
    file_tet_.resize(kept);
    result_.volume_mm3 = total_volume(sound_);
  }

  void measure_tets() {
    if (sound_.tets.empty()) return;
    double min_angle = std::numbers::pi, max_angle = 0.0;
    result_.min_quality = result_.min_edge_mm = std::numeric_limits<double>::max();
    std::vector<Index> needles;
    for (Index t = 0; t < size_of(sound_.tets); ++t) {
      const auto& tet = sound_.tets[t];
      double squares = 0.0;
      for (const auto& [i, j] : kTetEdge) {
        const double square = (sound_.vertices[tet[i]] - sound_.vertices[tet[j]]).squaredNorm();
        squares += square;
        result_.min_edge_mm = std::min(result_.min_edge_mm, std::sqrt(square));
        result_.max_edge_mm = std::max(result_.max_edge_mm, std::sqrt(square));
      }
      std::array<Vec3, 4> n;
      for (int f = 0; f < 4; ++f) {
        const auto v = face_vertices(tet, f);
        n[f] = area_normal(sound_.vertices[v[0]], sound_.vertices[v[1]], sound_.vertices[v[2]]);
      }
      for (const auto& [i, j] : kTetEdge) {
        const double angle = std::numbers::pi - angle_between(n[i], n[j]);
        min_angle = std::min(min_angle, angle);
        max_angle = std::max(max_angle, angle);
      }
      const double quality = 6.0 * std::numbers::sqrt2 * tet_volume(sound_, t) / std::pow(squares / 6.0, 1.5);
      if (quality < kNeedleQuality) needles.push_back(file_tet_[t]);
      if (quality < result_.min_quality) {
        result_.min_quality = quality;
        result_.worst_tet = file_tet_[t];
      }
    }
    result_.min_dihedral_deg = min_angle * 180.0 / std::numbers::pi;
    result_.max_dihedral_deg = max_angle * 180.0 / std::numbers::pi;
    add("needle_tets", Severity::note, "tet", 1, needles,
        "tet is nearly flat (quality below " + shortest(kNeedleQuality) + "): gradients in it are unreliable",
        "remesh if layers look torn there");
  }

  void look_at_faces() {
    const Faces faces = classify_faces(sound_);
    result_.boundary_faces = size_of(faces.boundary);
    add("overfull_faces", Severity::refused, "face", 3, flat(faces.overfull), "more than two tets on a face",
        "remove the overlapping tets");
    std::vector<std::array<Index, 2>> pairs = faces.overlapping;
    for (auto& pair : pairs) pair = {file_tet_[pair[0]], file_tet_[pair[1]]};
    add("overlapping_tets", Severity::refused, "tet pair", 2, flat(pairs),
        "both tets lie on the same side of their common face", "remesh the model");
    const Manifold manifold = check_manifold(faces.boundary, sound_.vertices.size());
    add("non_manifold_edges", Severity::refused, "edge", 2, flat(manifold.bad_edges),
        "the boundary touches itself along the edge", "join the parts by volume there, or move them apart");
    add("non_manifold_vertices", Severity::refused, "vertex", 1, manifold.bad_vertices,
        "the boundary touches itself in the vertex", "join the parts by volume there, or move them apart");
    look_for_contacts(faces.boundary);
    if (!result_.usable()) return;
    const TetTopology topology = build_topology(sound_);
    const Shape shape = measure_shape(sound_, topology, boundary_faces(sound_, topology));
    result_.components = shape.components;
    result_.cavities = shape.cavities;
    result_.genus = shape.genus;
  }

  void look_for_contacts(const std::vector<std::array<Index, 3>>& boundary) {
    const double gap = kCloseGap * diagonal_;
    const Contacts contacts = find_contacts({sound_.vertices, boundary}, gap);
    add("intersecting_faces", Severity::no_support, "face", 3, flat(contacts.crossed),
        "an edge of the face passes through another boundary face, so the space around the model cannot be meshed",
        "join the parts by volume or move them apart; as it is, only support.method none can be sliced");
    add("close_faces", Severity::note, "vertex", 1, contacts.close,
        format("a boundary face without this vertex lies nearer than %.3g", gap),
        "meshing the support domain may fail: separate or join the parts");
  }

  const TetMesh& mesh_;
  TetMesh sound_;
  std::vector<Index> file_tet_;
  double diagonal_ = 0.0;
};

}  // namespace

const char* severity_word(MeshProblem::Severity severity) {
  switch (severity) {
    case Severity::note: return "note";
    case Severity::mended: return "mended";
    case Severity::refused: return "refused";
    case Severity::no_support: return "no support";
  }
  return "";
}

bool MeshDiagnosis::usable() const {
  return std::none_of(problems.begin(), problems.end(),
                      [](const MeshProblem& p) { return p.severity == Severity::refused; });
}

bool MeshDiagnosis::supportable() const {
  return usable() && std::none_of(problems.begin(), problems.end(),
                                  [](const MeshProblem& p) { return p.severity == Severity::no_support; });
}

MeshDiagnosis diagnose_mesh(const TetMesh& file_mesh) { return Diagnosis(file_mesh).run(); }

}  // namespace curvesup
