#pragma once

#include <string>

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/model/diagnose.h"

namespace curvesup {

// The page of preview_html for a mesh as it came from its file: its surface, the elements of every problem marked, a list
// whose entries fly there, and the diagnosis as a table. Stands every mesh that diagnose_mesh stands.
[[nodiscard]] std::string inspect_html(const MeshDiagnosis& diagnosis, const TetMesh& file_mesh,
                                       const std::string& title);

// The same for a surface and what diagnose_surface says of it.
[[nodiscard]] std::string inspect_html(const MeshDiagnosis& diagnosis, const TriangleMesh& file_surface,
                                       const std::string& title);

}  // namespace curvesup
