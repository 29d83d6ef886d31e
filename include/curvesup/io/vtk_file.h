#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// A named array of a VTK file: values.size() = components * number of points (or cells).
struct VtkArray {
  std::string name;
  int components = 1;
  std::variant<std::vector<float>, std::vector<double>, std::vector<std::int32_t>, std::vector<std::uint8_t>> values;
};

enum class VtkPrecision { float32, float64 };

// Polylines and triangles over shared points. Cell data counts the polylines first, then the triangles (VTK's own
// order).
struct VtkPolyData {
  std::vector<Vec3> points;
  std::vector<Index> line_points;  // the polylines' points, one polyline after the other
  std::vector<Index> line_ends;    // polyline i ends before line_points[line_ends[i]] (VTK's "offsets")
  std::vector<std::array<Index, 3>> triangles;
  std::vector<VtkArray> point_data, cell_data;
};

// Tetrahedra over shared points.
struct VtkGrid {
  std::vector<Vec3> points;
  std::vector<std::array<Index, 4>> tets;
  std::vector<VtkArray> point_data, cell_data;
};

// VTK XML version 1.0, little endian, raw appended data with UInt64 sizes: opens in ParaView. Throws Error{internal}
// when an array's length does not fit the number of points or cells, or an index is out of range. About 0.5 GB/s.
[[nodiscard]] std::string to_vtp(const VtkPolyData& data, VtkPrecision points = VtkPrecision::float32);
[[nodiscard]] std::string to_vtu(const VtkGrid& data, VtkPrecision points = VtkPrecision::float64);

// Reads what to_vtp and to_vtu write, nothing more. Throws Error{input} with the path and what is wrong: another
// dialect, a truncated file, sizes that do not agree, an index out of range.
[[nodiscard]] VtkPolyData read_vtp(const std::filesystem::path& path);
[[nodiscard]] VtkGrid read_vtu(const std::filesystem::path& path);

}  // namespace curvesup
