#include "curvesup/preview/inspect.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "scene.h"

namespace curvesup {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxPlaces = 500;         // listed and marked, of each problem
constexpr std::size_t kMaxMarkedTets = 20000;  // drawn, of each problem

class InspectPage {
 public:
  // Of a surface: `mesh` has its vertices and no tets, and `triangles` are drawn as they are.
  InspectPage(const MeshDiagnosis& diagnosis, const TetMesh& mesh, std::span<const std::array<Index, 3>> triangles = {})
      : diagnosis_(diagnosis), mesh_(mesh), triangles_(triangles) {}

  std::string make(const std::string& title) {
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (drawable(static_cast<Index>(v))) box_.include(mesh_.vertices[v]);
    }
    scene_.info["title"] = title;
    scene_.info["inspect"] = true;
    scene_.add_box("box", box_);
    draw(diagnosis_.surface ? std::vector(triangles_.begin(), triangles_.end()) : odd_faces());
    add_problems();
    scene_.info["report"] = {{"mesh", numbers()}};
    return scene_.page(title);
  }

 private:
  [[nodiscard]] bool drawable(Index v) const {
    return v >= 0 && static_cast<std::size_t>(v) < mesh_.vertices.size() && mesh_.vertices[v].allFinite();
  }
  template <class Ids>
  [[nodiscard]] bool all_drawable(const Ids& ids) const {
    return std::all_of(ids.begin(), ids.end(), [&](Index v) { return drawable(v); });
  }

  // Faces that an odd number of tets has: the surface of a sound mesh, and something to look at for any other.
  [[nodiscard]] std::vector<std::array<Index, 3>> odd_faces() const {
    struct Face {
      std::array<Index, 3> sorted, seen;
    };
    std::vector<Face> faces;
    for (const auto& tet : mesh_.tets) {
      if (!all_drawable(tet)) continue;
      for (int f = 0; f < 4; ++f) {
        Face face{face_vertices(tet, f), face_vertices(tet, f)};
        std::sort(face.sorted.begin(), face.sorted.end());
        faces.push_back(face);
      }
    }
    std::sort(faces.begin(), faces.end(),
              [](const Face& a, const Face& b) { return a.sorted != b.sorted ? a.sorted < b.sorted : a.seen < b.seen; });
    std::vector<std::array<Index, 3>> odd;
    for (std::size_t i = 0; i < faces.size();) {
      std::size_t end = i;
      while (end < faces.size() && faces[end].sorted == faces[i].sorted) ++end;
      if ((end - i) % 2 == 1) odd.push_back(faces[i].seen);
      i = end;
    }
    return odd;
  }

  void draw(const std::vector<std::array<Index, 3>>& faces) {
    std::vector<std::uint16_t> vertices;
    std::vector<std::uint32_t> triangles;
    std::vector<Index> local(mesh_.vertices.size(), kNone);
    for (const auto& face : faces) {
      for (const Index v : face) {
        if (local[v] == kNone) {
          local[v] = static_cast<Index>(vertices.size() / 3);
          box_.add(mesh_.vertices[v], vertices);
        }
        triangles.push_back(static_cast<std::uint32_t>(local[v]));
      }
    }
    scene_.add("model_vertices", vertices);
    scene_.add("model_faces", triangles);
    scene_.add("overhang_faces", std::vector<std::uint32_t>{});
  }

  // Vertices of one element of a problem; empty when it cannot be drawn.
  [[nodiscard]] std::vector<Index> corners(const MeshProblem& problem, std::size_t element) const {
    std::vector<Index> out;
    for (int i = 0; i < problem.ids_per_element; ++i) {
      const Index id = problem.ids[element * problem.ids_per_element + i];
      if (problem.element.starts_with("tet")) {
        if (id < 0 || static_cast<std::size_t>(id) >= mesh_.tets.size()) return {};
        out.insert(out.end(), mesh_.tets[id].begin(), mesh_.tets[id].end());
      } else if (problem.element == "triangle") {
        if (id < 0 || static_cast<std::size_t>(id) >= triangles_.size()) return {};
        out.insert(out.end(), triangles_[id].begin(), triangles_[id].end());
      } else {
        out.push_back(id);
      }
    }
    return all_drawable(out) ? out : std::vector<Index>{};
  }

  void mark(const MeshProblem& problem, const std::vector<Index>& corner) {
    const auto triangle = [&](Index a, Index b, Index c) {
      for (const Index v : {a, b, c}) box_.add(mesh_.vertices[v], bad_triangles_);
    };
    if (problem.element.starts_with("tet")) {
      for (std::size_t t = 0; t + 3 < corner.size(); t += 4) {
        for (const auto& face : kTetFace) triangle(corner[t + face[0]], corner[t + face[1]], corner[t + face[2]]);
      }
    } else if (corner.size() == 3) {
      triangle(corner[0], corner[1], corner[2]);
    } else if (corner.size() == 2) {
      for (const Index v : corner) box_.add(mesh_.vertices[v], bad_lines_);
    }
  }

  void add_problems() {
    Json checks = Json::array();
    for (const MeshProblem& problem : diagnosis_.problems) {
      Json places = Json::array();
      const std::size_t count = problem.count();
      for (std::size_t e = 0; e < std::min(count, kMaxMarkedTets); ++e) {
        const std::vector<Index> corner = corners(problem, e);
        if (corner.empty()) continue;
        mark(problem, corner);
        if (places.size() >= kMaxPlaces) continue;
        Vec3 centre = Vec3::Zero();
        for (const Index v : corner) centre += mesh_.vertices[v] / static_cast<double>(corner.size());
        std::string ids;
        for (int i = 0; i < problem.ids_per_element; ++i) {
          ids += " " + std::to_string(problem.ids[e * problem.ids_per_element + i]);
        }
        places.push_back({{"at", {centre.x(), centre.y(), centre.z()}}, {"text", problem.element + ids}});
      }
      checks.push_back({{"name", problem.name}, {"ok", problem.severity == MeshProblem::Severity::note},
                        {"severity", severity_word(problem.severity)}, {"value", count}, {"limit", 0},
                        {"detail", problem.text + (problem.remedy.empty() ? "." : ": " + problem.remedy + ".")}, {"places", places}});
    }
    scene_.info["checks"] = checks;
    scene_.add("bad_triangles", bad_triangles_);
    scene_.add("bad_lines", bad_lines_);
  }

  [[nodiscard]] Json numbers() const {
    const MeshDiagnosis& d = diagnosis_;
    const Vec3 size = d.high - d.low;
    if (d.surface) {
      Json out = {{"usable", d.usable()}, {"vertices", d.vertices}, {"triangles", d.boundary_faces}, {"size_mm", {size.x(), size.y(), size.z()}},
                  {"min_edge_mm", d.min_edge_mm}, {"max_edge_mm", d.max_edge_mm}};
      if (d.usable()) out.update({{"volume_mm3", d.volume_mm3}, {"shells", d.components}, {"genus", d.genus}});
      return out;
    }
    Json out = {{"usable", d.usable()}, {"supportable", d.supportable()}, {"vertices", d.vertices}, {"tets", d.tets}, {"boundary_faces", d.boundary_faces},
                {"size_mm", {size.x(), size.y(), size.z()}}, {"volume_mm3", d.volume_mm3},
                {"min_dihedral_deg", d.min_dihedral_deg}, {"max_dihedral_deg", d.max_dihedral_deg},
                {"min_quality", d.min_quality}, {"worst_tet", d.worst_tet},
                {"min_edge_mm", d.min_edge_mm}, {"max_edge_mm", d.max_edge_mm}};
    if (d.usable()) {
      out["components"] = d.components;
      out["cavities"] = d.cavities;
      out["genus"] = d.genus;
    }
    return out;
  }

  const MeshDiagnosis& diagnosis_;
  const TetMesh& mesh_;
  std::span<const std::array<Index, 3>> triangles_;
  Scene scene_;
  QuantisedBox box_;
  std::vector<std::uint16_t> bad_triangles_, bad_lines_;
};

}  // namespace

std::string inspect_html(const MeshDiagnosis& diagnosis, const TriangleMesh& file_surface, const std::string& title) {
  const TetMesh vertices{file_surface.vertices, {}};
  return InspectPage(diagnosis, vertices, file_surface.triangles).make(title);
}

std::string inspect_html(const MeshDiagnosis& diagnosis, const TetMesh& file_mesh, const std::string& title) {
  return InspectPage(diagnosis, file_mesh).make(title);
}

}  // namespace curvesup
