#include "curvesup/io/vtk_file.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <functional>
#include <map>
#include <span>
#include <string_view>

#include "curvesup/core/error.h"
#include "curvesup/io/text_file.h"

namespace curvesup {

namespace {

static_assert(std::endian::native == std::endian::little, "appended arrays are written as they lie in memory");

constexpr std::uint8_t kVtkTetra = 10;
constexpr std::string_view kTail = "\n  </AppendedData>\n</VTKFile>\n";

template <class T>
constexpr const char* vtk_type() {
  if constexpr (std::is_same_v<T, float>) return "Float32";
  if constexpr (std::is_same_v<T, double>) return "Float64";
  if constexpr (std::is_same_v<T, std::int32_t>) return "Int32";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "UInt8";
}

// ---------------------------------------------------------------------------------------------------- writing

// Collects the XML head and, in the same order, what fills the appended blocks.
class Writer {
 public:
  explicit Writer(const char* type) {
    xml_ = "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + std::string(type) +
           "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <" + type + ">\n";
    type_ = type;
  }

  void open(const std::string& element) { xml_ += "      <" + element + ">\n"; }
  void close(const std::string& element) { xml_ += "      </" + element + ">\n"; }
  void open_piece(const std::string& attributes) { xml_ += "    <Piece " + attributes + ">\n"; }

  // `fill` writes count values of T, one after the other, to the address it is given.
  template <class T>
  void array(const std::string& name, int components, std::size_t count, std::function<void(char*)> fill) {
    xml_ += std::string("        <DataArray type=\"") + vtk_type<T>() + "\" Name=\"" + escaped(name) +
            "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"appended\" offset=\"" +
            std::to_string(offset_) + "\"/>\n";
    blocks_.push_back({count * sizeof(T), std::move(fill)});
    offset_ += 8 + count * sizeof(T);
  }

  template <class T>
  void plain_array(const std::string& name, int components, std::span<const T> values) {
    array<T>(name, components, values.size(), [values](char* to) {
      if (!values.empty()) std::memcpy(to, values.data(), values.size_bytes());
    });
  }

  void data(const std::string& section, const std::vector<VtkArray>& arrays, std::size_t count) {
    open(section);
    for (const VtkArray& a : arrays) {
      std::visit(
          [&](const auto& values) {
            if (a.components < 1 || values.size() != count * static_cast<std::size_t>(a.components)) {
              throw Error(ErrorKind::internal, "vtk array " + a.name,
                          "has " + std::to_string(values.size()) + " values instead of " + std::to_string(count) +
                              " x " + std::to_string(a.components));
            }
            plain_array(a.name, a.components, std::span(values));
          },
          a.values);
    }
    close(section);
  }

  void points(const std::vector<Vec3>& points, VtkPrecision precision) {
    open("Points");
    if (precision == VtkPrecision::float64) {
      array<double>("Points", 3, 3 * points.size(), [&points](char* to) {
        if (!points.empty()) std::memcpy(to, points.data(), points.size() * sizeof(Vec3));
      });
    } else {
      array<float>("Points", 3, 3 * points.size(), [&points](char* to) {
        for (const Vec3& p : points) {
          const float xyz[3] = {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
          std::memcpy(to, xyz, sizeof xyz);
          to += sizeof xyz;
        }
      });
    }
    close("Points");
  }

  // Cells of N points each.
  template <std::size_t N>
  void simplices(const std::vector<std::array<Index, N>>& cells) {
    plain_array("connectivity", 1,
                std::span<const Index>(cells.empty() ? nullptr : cells.front().data(), N * cells.size()));
    const std::size_t count = cells.size();
    array<Index>("offsets", 1, count, [count](char* to) {
      for (std::size_t c = 0; c < count; ++c) {
        const Index end = static_cast<Index>(N * (c + 1));
        std::memcpy(to + c * sizeof end, &end, sizeof end);
      }
    });
  }

  std::string finish() {
    xml_ += "    </Piece>\n  </" + type_ + ">\n  <AppendedData encoding=\"raw\">\n   _";
    std::string bytes;
    bytes.reserve(xml_.size() + offset_ + kTail.size());
    bytes = xml_;
    for (const auto& [size, fill] : blocks_) {
      const std::size_t begin = bytes.size();
      bytes.resize(begin + 8 + size);
      std::memcpy(bytes.data() + begin, &size, 8);
      fill(bytes.data() + begin + 8);
    }
    bytes += kTail;
    return bytes;
  }

 private:
  static std::string escaped(const std::string& name) {
    std::string text;
    for (const char c : name) {
      if (c == '&')
        text += "&amp;";
      else if (c == '<')
        text += "&lt;";
      else if (c == '>')
        text += "&gt;";
      else if (c == '"')
        text += "&quot;";
      else
        text += c;
    }
    return text;
  }

  struct Block {
    std::uint64_t size;
    std::function<void(char*)> fill;
  };
  std::string xml_, type_;
  std::uint64_t offset_ = 0;
  std::vector<Block> blocks_;
};

std::string attribute(const char* name, std::size_t value) {
  return std::string(name) + "=\"" + std::to_string(value) + "\"";
}

// Text in `where` names the file on reading and the function on writing.
void check_indices(ErrorKind kind, const std::string& where, std::span<const Index> indices, std::size_t points) {
  for (const Index i : indices) {
    if (i < 0 || static_cast<std::size_t>(i) >= points) {
      throw Error(kind, where,
                  "point index " + std::to_string(i) + " is out of range 0 to " + std::to_string(points) + " - 1");
    }
  }
}

void check_line_ends(ErrorKind kind, const std::string& where, std::span<const Index> ends, std::size_t line_points) {
  Index previous = 0;
  for (const Index end : ends) {
    if (end < previous) throw Error(kind, where, "ends of polylines must ascend");
    previous = end;
  }
  if (static_cast<std::size_t>(previous) != line_points) {
    throw Error(kind, where, "the last polyline does not end with the last point of the list");
  }
}

template <std::size_t N>
std::span<const Index> flat(const std::vector<std::array<Index, N>>& cells) {
  return {cells.empty() ? nullptr : cells.front().data(), N * cells.size()};
}

}  // namespace

std::string to_vtp(const VtkPolyData& data, VtkPrecision precision) {
  const std::size_t lines = data.line_ends.size();
  check_indices(ErrorKind::internal, "to_vtp", data.line_points, data.points.size());
  check_indices(ErrorKind::internal, "to_vtp", flat(data.triangles), data.points.size());
  check_line_ends(ErrorKind::internal, "to_vtp", data.line_ends, data.line_points.size());
  Writer writer("PolyData");
  writer.open_piece(attribute("NumberOfPoints", data.points.size()) + " NumberOfVerts=\"0\" " +
                    attribute("NumberOfLines", lines) + " NumberOfStrips=\"0\" " +
                    attribute("NumberOfPolys", data.triangles.size()));
  writer.data("PointData", data.point_data, data.points.size());
  writer.data("CellData", data.cell_data, lines + data.triangles.size());
  writer.points(data.points, precision);
  writer.open("Lines");
  writer.plain_array("connectivity", 1, std::span(data.line_points));
  writer.plain_array("offsets", 1, std::span(data.line_ends));
  writer.close("Lines");
  writer.open("Polys");
  writer.simplices(data.triangles);
  writer.close("Polys");
  return writer.finish();
}

std::string to_vtu(const VtkGrid& data, VtkPrecision precision) {
  check_indices(ErrorKind::internal, "to_vtu", flat(data.tets), data.points.size());
  Writer writer("UnstructuredGrid");
  writer.open_piece(attribute("NumberOfPoints", data.points.size()) + " " +
                    attribute("NumberOfCells", data.tets.size()));
  writer.data("PointData", data.point_data, data.points.size());
  writer.data("CellData", data.cell_data, data.tets.size());
  writer.points(data.points, precision);
  writer.open("Cells");
  writer.simplices(data.tets);
  const std::size_t count = data.tets.size();
  writer.array<std::uint8_t>("types", 1, count, [count](char* to) { std::memset(to, kVtkTetra, count); });
  writer.close("Cells");
  return writer.finish();
}

// ---------------------------------------------------------------------------------------------------- reading

namespace {

using Attributes = std::map<std::string, std::string, std::less<>>;

// The DataArrays of one file by section ("Points", "Lines", ...), and the counts of its one piece.
class Reader {
 public:
  Reader(const std::filesystem::path& path, const std::string& type) : path_(path.string()), bytes_(read_file(path)) {
    constexpr std::string_view kAppended = "<AppendedData encoding=\"raw\">";
    const std::size_t head_end = bytes_.find(kAppended);
    if (head_end == std::string::npos) fail("has no raw appended data");
    const std::size_t mark = bytes_.find_first_not_of(" \n", head_end + kAppended.size());
    if (mark == std::string::npos || bytes_[mark] != '_') fail("appended data does not begin with '_'");
    data_begin_ = mark + 1;
    parse_head(std::string_view(bytes_).substr(0, head_end), type);
    if (std::string_view(bytes_).substr(data_end_) != kTail)
      fail("does not end after its last array; is it truncated?");
  }

  [[nodiscard]] std::size_t count(const char* name) const {
    const auto found = piece_.find(name);
    std::size_t value = 0;
    if (found == piece_.end() || !whole_number(found->second, value)) fail(std::string("Piece has no ") + name);
    return value;
  }

  [[nodiscard]] const VtkArray& array(const char* section, const char* name) const {
    const auto found = sections_.find(section);
    if (found != sections_.end()) {
      for (const VtkArray& a : found->second) {
        if (a.name == name) return a;
      }
    }
    fail(std::string(section) + " has no array " + name);
  }

  template <class T>
  [[nodiscard]] const std::vector<T>& values(const char* section, const char* name, std::size_t expected) const {
    const auto* values = std::get_if<std::vector<T>>(&array(section, name).values);
    if (!values) fail(std::string(section) + " " + name + " is not " + vtk_type<T>());
    if (values->size() != expected) fail(std::string(section) + " " + name + " has the wrong length");
    return *values;
  }

  [[nodiscard]] std::vector<Vec3> points() const {
    const VtkArray& a = array("Points", "Points");
    const std::size_t n = count("NumberOfPoints");
    if (a.components != 3) fail("points must have three components");
    std::vector<Vec3> points(n);
    std::visit(
        [&](const auto& xyz) {
          if (xyz.size() != 3 * n) fail("Points has the wrong length");
          for (std::size_t i = 0; i < n; ++i) points[i] = Vec3(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        },
        a.values);
    return points;
  }

  template <std::size_t N>
  [[nodiscard]] std::vector<std::array<Index, N>> simplices(const char* section, std::size_t n,
                                                            std::size_t points) const {
    const auto& connectivity = values<Index>(section, "connectivity", N * n);
    const auto& offsets = values<Index>(section, "offsets", n);
    for (std::size_t c = 0; c < n; ++c) {
      if (static_cast<std::size_t>(offsets[c]) != N * (c + 1))
        fail(std::string(section) + " holds cells of another kind");
    }
    check_indices(ErrorKind::input, path_, connectivity, points);
    std::vector<std::array<Index, N>> cells(n);
    if (n > 0) std::memcpy(cells.data(), connectivity.data(), connectivity.size() * sizeof(Index));
    return cells;
  }

  [[nodiscard]] std::vector<VtkArray> data(const char* section, std::size_t n) const {
    const auto found = sections_.find(section);
    if (found == sections_.end()) return {};
    for (const VtkArray& a : found->second) {
      const std::size_t size = std::visit([](const auto& v) { return v.size(); }, a.values);
      if (size != n * static_cast<std::size_t>(a.components))
        fail(std::string(section) + " " + a.name + " has the wrong length");
    }
    return found->second;
  }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::input, path_, what, "only files written by this program can be read");
  }

 private:
  static bool whole_number(std::string_view text, std::size_t& value) {
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    return result.ec == std::errc() && result.ptr == text.data() + text.size();
  }

  [[nodiscard]] const std::string& at(const Attributes& attributes, std::string_view name) const {
    const auto found = attributes.find(name);
    if (found == attributes.end()) fail("attribute " + std::string(name) + " is missing");
    return found->second;
  }

  static std::string unescaped(std::string_view text) {
    constexpr std::pair<std::string_view, char> kEntities[] = {
        {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}};
    std::string plain;
    while (!text.empty()) {
      std::size_t used = 1;
      char c = text.front();
      for (const auto& [entity, meaning] : kEntities) {
        if (text.starts_with(entity)) c = meaning, used = entity.size();
      }
      plain += c;
      text.remove_prefix(used);
    }
    return plain;
  }

  // name="value" pairs of one tag.
  [[nodiscard]] Attributes attributes(std::string_view tag) const {
    Attributes result;
    for (std::size_t equals = tag.find("=\""); equals != std::string_view::npos; equals = tag.find("=\"")) {
      const std::size_t name_begin = tag.find_last_of(" ", equals);
      const std::size_t value_end = tag.find('"', equals + 2);
      if (name_begin == std::string_view::npos || value_end == std::string_view::npos) fail("a tag is damaged");
      result[std::string(tag.substr(name_begin + 1, equals - name_begin - 1))] =
          unescaped(tag.substr(equals + 2, value_end - equals - 2));
      tag.remove_prefix(value_end + 1);
    }
    return result;
  }

  void parse_head(std::string_view head, const std::string& type) {
    std::string section;
    bool seen_file = false;
    for (std::size_t open = head.find('<'); open != std::string_view::npos; open = head.find('<')) {
      const std::size_t close = head.find('>', open);
      if (close == std::string_view::npos) fail("a tag is damaged");
      const std::string_view tag = head.substr(open + 1, close - open - 1);
      const std::string name(tag.substr(0, tag.find_first_of(" /", 1)));
      head.remove_prefix(close + 1);
      if (name == "VTKFile") {
        const Attributes file = attributes(tag);
        if (at(file, "type") != type || at(file, "version") != "1.0" || at(file, "byte_order") != "LittleEndian" ||
            at(file, "header_type") != "UInt64") {
          fail("is not little-endian VTK XML 1.0 of type " + type);
        }
        seen_file = true;
      } else if (name == "Piece") {
        if (!piece_.empty()) fail("has more than one piece");
        piece_ = attributes(tag);
      } else if (name == "DataArray") {
        sections_[section].push_back(read_array(attributes(tag)));
      } else if (!name.starts_with('/') && !name.starts_with('?')) {
        section = name;
      }
    }
    if (!seen_file || piece_.empty()) fail("is not a VTK XML file");
  }

  [[nodiscard]] VtkArray read_array(const Attributes& attributes) {
    VtkArray result;
    result.name = at(attributes, "Name");
    std::size_t components = 0, offset = 0;
    if (at(attributes, "format") != "appended" || !whole_number(at(attributes, "offset"), offset) ||
        !whole_number(at(attributes, "NumberOfComponents"), components) || components < 1 || components > 1000) {
      fail("array " + result.name + " is not appended");
    }
    result.components = static_cast<int>(components);
    const std::size_t available = bytes_.size() - data_begin_;
    std::uint64_t size = 0;
    if (available < 8 || offset > available - 8) fail("ends before array " + result.name);
    std::memcpy(&size, bytes_.data() + data_begin_ + offset, 8);
    if (size > available - 8 - offset) fail("ends inside array " + result.name);
    const std::size_t begin = data_begin_ + offset + 8;
    data_end_ = std::max(data_end_, begin + size);

    const std::string& type = at(attributes, "type");
    if (type == vtk_type<float>())
      result.values = copy<float>(begin, size);
    else if (type == vtk_type<double>())
      result.values = copy<double>(begin, size);
    else if (type == vtk_type<std::int32_t>())
      result.values = copy<std::int32_t>(begin, size);
    else if (type == vtk_type<std::uint8_t>())
      result.values = copy<std::uint8_t>(begin, size);
    else
      fail("array " + result.name + " has type " + type);
    return result;
  }

  template <class T>
  [[nodiscard]] std::vector<T> copy(std::size_t begin, std::size_t size) const {
    if (size % sizeof(T) != 0) fail("an array ends inside a value");
    std::vector<T> values(size / sizeof(T));
    if (size > 0) std::memcpy(values.data(), bytes_.data() + begin, size);
    return values;
  }

  std::string path_, bytes_;
  std::size_t data_begin_ = 0, data_end_ = 0;
  Attributes piece_;
  std::map<std::string, std::vector<VtkArray>, std::less<>> sections_;
};

}  // namespace

VtkPolyData read_vtp(const std::filesystem::path& path) {
  const Reader reader(path, "PolyData");
  const std::size_t lines = reader.count("NumberOfLines"), triangles = reader.count("NumberOfPolys");
  if (reader.count("NumberOfVerts") != 0 || reader.count("NumberOfStrips") != 0) reader.fail("holds verts or strips");
  VtkPolyData data;
  data.points = reader.points();
  data.line_ends = reader.values<Index>("Lines", "offsets", lines);
  data.line_points = reader.values<Index>("Lines", "connectivity", lines > 0 ? std::max(data.line_ends.back(), 0) : 0);
  check_line_ends(ErrorKind::input, reader.path(), data.line_ends, data.line_points.size());
  check_indices(ErrorKind::input, reader.path(), data.line_points, data.points.size());
  data.triangles = reader.simplices<3>("Polys", triangles, data.points.size());
  data.point_data = reader.data("PointData", data.points.size());
  data.cell_data = reader.data("CellData", lines + triangles);
  return data;
}

VtkGrid read_vtu(const std::filesystem::path& path) {
  const Reader reader(path, "UnstructuredGrid");
  const std::size_t cells = reader.count("NumberOfCells");
  VtkGrid data;
  data.points = reader.points();
  data.tets = reader.simplices<4>("Cells", cells, data.points.size());
  for (const std::uint8_t type : reader.values<std::uint8_t>("Cells", "types", cells)) {
    if (type != kVtkTetra) reader.fail("holds cells that are no tetrahedra");
  }
  data.point_data = reader.data("PointData", data.points.size());
  data.cell_data = reader.data("CellData", cells);
  return data;
}

}  // namespace curvesup
