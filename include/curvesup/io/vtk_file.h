#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "curvesup/core/types.h"
#include "curvesup/io/text_file.h"

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

// An array that need not exist in memory: values are made block by block while the file is written.
struct VtkColumn {
  enum class Type { float32, float64, int32, uint8 };
  std::string name;
  int components = 1;
  Type type = Type::float32;
  std::size_t count = 0;  // points or cells
  std::function<void(std::size_t begin, std::size_t end, char* to)> fill;  // elements begin .. end - 1, packed
};

// The column of `elements` by value(element), which gives a number or a Vec3. The elements must outlive the column.
template <class T, class Elements, class Value>
[[nodiscard]] VtkColumn vtk_column(std::string name, const Elements& elements, Value value);

// VtkPolyData and VtkGrid as columns; names and components of the first four are given by the format. Index columns are
// Int32.
struct VtkPolySource {
  VtkColumn points, line_points, line_ends, triangles;
  std::vector<VtkColumn> point_data, cell_data;
};

// What to_vtp gives, in pieces of at most 1 MB; errors come in the middle of it.
void write_vtp(const VtkPolySource& source, const ByteSink& sink);

// Reads what to_vtp and to_vtu write, nothing more. Throws Error{input} with the path and what is wrong: another
// dialect, a truncated file, sizes that do not agree, an index out of range.
[[nodiscard]] VtkPolyData read_vtp(const std::filesystem::path& path);
[[nodiscard]] VtkGrid read_vtu(const std::filesystem::path& path);

template <class T>
constexpr VtkColumn::Type vtk_column_type() {
  if constexpr (std::is_same_v<T, float>) return VtkColumn::Type::float32;
  if constexpr (std::is_same_v<T, double>) return VtkColumn::Type::float64;
  if constexpr (std::is_same_v<T, std::int32_t>) return VtkColumn::Type::int32;
  if constexpr (std::is_same_v<T, std::uint8_t>) return VtkColumn::Type::uint8;
}

template <class T, class Elements, class Value>
VtkColumn vtk_column(std::string name, const Elements& elements, Value value) {
  using Made = std::decay_t<decltype(value(elements[0]))>;
  constexpr bool kVector = std::is_same_v<Made, Vec3>;
  VtkColumn column{std::move(name), kVector ? 3 : 1, vtk_column_type<T>(), elements.size(), {}};
  column.fill = [&elements, value](std::size_t begin, std::size_t end, char* to) {
    for (std::size_t i = begin; i < end; ++i) {
      const Made made = value(elements[i]);
      for (int c = 0; c < (kVector ? 3 : 1); ++c, to += sizeof(T)) {
        T packed;
        if constexpr (kVector) packed = static_cast<T>(made[c]);
        else packed = static_cast<T>(made);
        std::memcpy(to, &packed, sizeof packed);
      }
    }
  };
  return column;
}

}  // namespace curvesup
