#pragma once

#include <filesystem>

#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

// The text format of tetrahedral meshes:
//   <n> vertices
//   <m> tets
//   x y z            n lines
//   4 i j k l        m lines, indices from 0
// A missing final newline, Windows line ends and empty lines are accepted. Guarantees finite coordinates and indices in
// range; neither reorients tets nor looks at their geometry. Throws Error{input} with file:line. About 10 M numbers/s.
[[nodiscard]] TetMesh read_tet_file(const std::filesystem::path& path);

// Writes the shortest text that reads back to the same doubles. Throws Error{output}.
void write_tet_file(const std::filesystem::path& path, const TetMesh& mesh);

}  // namespace curvesup
