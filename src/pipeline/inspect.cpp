#include "curvesup/pipeline/inspect.h"

#include <algorithm>

#include "curvesup/core/format.h"

namespace curvesup {

namespace {

constexpr std::size_t kIdsShown = 8;

std::string first_ids(const MeshProblem& problem) {
  std::string text;
  const std::size_t shown = std::min(problem.count(), kIdsShown);
  for (std::size_t i = 0; i < shown; ++i) {
    text += i == 0 ? " " : ", ";
    for (int k = 0; k < problem.ids_per_element; ++k) {
      text += (k == 0 ? "" : "-") + std::to_string(problem.ids[i * static_cast<std::size_t>(problem.ids_per_element) + static_cast<std::size_t>(k)]);
    }
  }
  if (problem.count() > shown) text += format(", ... (%zu in all)", problem.count());
  return text;
}

std::string tet_quality(const MeshDiagnosis& d) {
  std::string text = format("quality    dihedral angles %.2f to %.2f deg, worst tet %d (quality %.4f), edges %.4f to %.4f\n", d.min_dihedral_deg,
                            d.max_dihedral_deg, d.worst_tet, d.min_quality, d.min_edge_mm, d.max_edge_mm);
  if (d.usable()) text += format("topology   %d components, %d closed cavities, genus %d\n", d.components, d.cavities, d.genus);
  return text;
}

}  // namespace

std::string diagnosis_text(const std::string& name, const MeshDiagnosis& d) {
  std::string text = d.surface ? format("surface    %s: %d vertices, %d triangles\n", name.c_str(), d.vertices, d.boundary_faces)
                               : format("model      %s: %d vertices, %d tets, %d boundary faces\n", name.c_str(), d.vertices, d.tets, d.boundary_faces);
  text += format("size       (%.3f, %.3f, %.3f) to (%.3f, %.3f, %.3f), volume %.3f\n", d.low.x(), d.low.y(), d.low.z(), d.high.x(),
                 d.high.y(), d.high.z(), d.volume_mm3);
  if (d.surface) {
    text += format("quality    edges %.4f to %.4f\n", d.min_edge_mm, d.max_edge_mm);
    if (d.usable()) text += format("topology   %d closed shells, genus %d\n", d.components, d.genus);
  } else {
    text += tet_quality(d);
  }
  for (const MeshProblem& problem : d.problems) {
    text += format("%-10s %s: %s\n", severity_word(problem.severity), problem.name.c_str(), problem.text.c_str());
    if (problem.count() > 0) text += format("           %s%s\n", problem.element.c_str(), first_ids(problem).c_str());
    if (!problem.remedy.empty()) text += format("           remedy: %s\n", problem.remedy.c_str());
  }
  text += d.supportable() ? "usable     yes\n" : d.usable() ? "usable     only with support.method none\n" : "usable     no\n";
  return text;
}

}  // namespace curvesup
