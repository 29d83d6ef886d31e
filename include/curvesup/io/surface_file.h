#pragma once

#include <filesystem>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

// Whether the name ends in .stl or .obj, in any case.
[[nodiscard]] bool is_surface_file(const std::filesystem::path& path);

// A triangle surface from STL (binary or text, told apart by the content) or OBJ (by the extension .obj; polygons are
// cut into fans, materials and normals ignored). Vertices with exactly equal coordinates become one, numbered by first
// use; unused ones vanish; triangles stay in file order, degenerate ones included. Nothing else is mended. Throws
// Error{input} with file:line, or with the triangle in a binary file.
[[nodiscard]] TriangleMesh read_surface_file(const std::filesystem::path& path);

}  // namespace curvesup
