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
#include "curvesup/io/file_reader.h"

namespace curvesup {

namespace {

static_assert(std::endian::native == std::endian::little, "appended arrays are written as they lie in memory");

constexpr std::uint8_t kVtkTetra = 10;
constexpr std::string_view kTail = "\n  </AppendedData>\n</VTKFile>\n";

std::size_t value_size(VtkColumn::Type type) {
  constexpr std::size_t kSizes[] = {4, 8, 4, 1};
  return kSizes[static_cast<int>(type)];
}

const char* type_name(VtkColumn::Type type) {
  constexpr const char* kNames[] = {"Float32", "Float64", "Int32", "UInt8"};
  return kNames[static_cast<int>(type)];
}

template <class T>
const char* vtk_type() {
  return type_name(vtk_column_type<T>());
}

// ------------------------------------------------------------------------------------------- indices, both directions

// Text in `where` names the file on reading and the function on writing.
void check_indices(ErrorKind kind, const std::string& where, std::span<const Index> indices, std::size_t points) {
  for (const Index i : indices) {
    if (i < 0 || static_cast<std::size_t>(i) >= points) {
      throw Error(kind, where,
                  "point index " + std::to_string(i) + " is out of range 0 to " + std::to_string(points) + " - 1");
    }
  }
}

void check_ascending(ErrorKind kind, const std::string& where, std::span<const Index> ends, Index& previous) {
  for (const Index end : ends) {
    if (end < previous) throw Error(kind, where, "ends of polylines must ascend");
    previous = end;
  }
}

void check_last_end(ErrorKind kind, const std::string& where, Index last, std::size_t line_points) {
  if (static_cast<std::size_t>(last) != line_points) {
    throw Error(kind, where, "the last polyline does not end with the last point of the list");
  }
}

// ---------------------------------------------------------------------------------------------------- writing

constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

// What lies in memory as the file wants it.
template <class T>
VtkColumn view(std::string name, int components, const T* values, std::size_t count) {
  return {std::move(name), components, vtk_column_type<T>(), count,
          [values, components](std::size_t begin, std::size_t end, char* to) {
            const std::size_t n = static_cast<std::size_t>(components);
            if (end > begin) std::memcpy(to, values + n * begin, n * (end - begin) * sizeof(T));
          }};
}

template <std::size_t N>
VtkColumn view(const std::vector<std::array<Index, N>>& cells) {
  return view("connectivity", static_cast<int>(N), cells.empty() ? nullptr : cells.front().data(), cells.size());
}

std::vector<VtkColumn> views(const std::vector<VtkArray>& arrays) {
  std::vector<VtkColumn> columns;
  for (const VtkArray& a : arrays) {
    std::visit(
        [&](const auto& values) {
          const std::size_t components = static_cast<std::size_t>(std::max(a.components, 1));
          if (a.components < 1 || values.size() % components != 0) {
            throw Error(ErrorKind::internal, "vtk array " + a.name,
                        "has " + std::to_string(values.size()) + " values in groups of " + std::to_string(a.components));
          }
          columns.push_back(view(a.name, a.components, values.data(), values.size() / components));
        },
        a.values);
  }
  return columns;
}

VtkColumn point_column(const std::vector<Vec3>& points, VtkPrecision precision) {
  const auto itself = [](const Vec3& p) { return p; };
  return precision == VtkPrecision::float64 ? vtk_column<double>("Points", points, itself)
                                            : vtk_column<float>("Points", points, itself);
}

// Ends of cells of n points each.
VtkColumn even_ends(std::size_t cells, int n) {
  return {"offsets", 1, VtkColumn::Type::int32, cells, [n](std::size_t begin, std::size_t end, char* to) {
            for (std::size_t c = begin; c < end; ++c, to += sizeof(Index)) {
              const Index cell_end = static_cast<Index>(n * (c + 1));
              std::memcpy(to, &cell_end, sizeof cell_end);
            }
          }};
}

// Collects the XML head and, in the same order, the columns that fill the appended blocks.
class Writer {
 public:
  Writer(const char* type, std::size_t points) : type_(type), points_(points) {
    xml_ = "<?xml version=\"1.0\"?>\n<VTKFile type=\"" + type_ +
           "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <" + type_ + ">\n";
  }

  enum class Meaning { values, point_indices, ascending_ends };

  void open(const std::string& element) { xml_ += "      <" + element + ">\n"; }
  void close(const std::string& element) { xml_ += "      </" + element + ">\n"; }
  void open_piece(const std::string& attributes) { xml_ += "    <Piece " + attributes + ">\n"; }

  // The numbers of a connectivity stand alone in the file, whatever they are grouped by in memory.
  void array(const VtkColumn& column, const std::string& name, Meaning meaning = Meaning::values, std::size_t last_end = 0) {
    const int shown = meaning == Meaning::values ? column.components : 1;
    xml_ += std::string("        <DataArray type=\"") + type_name(column.type) + "\" Name=\"" + escaped(name) +
            "\" NumberOfComponents=\"" + std::to_string(shown) + "\" format=\"appended\" offset=\"" +
            std::to_string(offset_) + "\"/>\n";
    blocks_.push_back({column, meaning, last_end});
    offset_ += 8 + bytes_of(column);
  }

  void data(const std::string& section, const std::vector<VtkColumn>& columns, std::size_t count) {
    open(section);
    for (const VtkColumn& column : columns) {
      if (column.count != count) {
        throw Error(ErrorKind::internal, "vtk array " + column.name,
                    "has " + std::to_string(column.count) + " elements instead of " + std::to_string(count));
      }
      array(column, column.name);
    }
    close(section);
  }

  void points(const VtkColumn& column) {
    open("Points");
    array(column, "Points");
    close("Points");
  }

  void finish(const ByteSink& sink) {
    xml_ += "    </Piece>\n  </" + type_ + ">\n  <AppendedData encoding=\"raw\">\n   _";
    sink(xml_);
    std::vector<char> buffer;
    for (const Block& block : blocks_) write(block, buffer, sink);
    sink(kTail);
  }

 private:
  struct Block {
    VtkColumn column;
    Meaning meaning;
    std::size_t last_end;
  };

  static std::size_t element_bytes(const VtkColumn& c) { return static_cast<std::size_t>(c.components) * value_size(c.type); }
  static std::uint64_t bytes_of(const VtkColumn& c) { return c.count * element_bytes(c); }

  void write(const Block& block, std::vector<char>& buffer, const ByteSink& sink) const {
    const VtkColumn& column = block.column;
    const std::uint64_t bytes = bytes_of(column);
    sink({reinterpret_cast<const char*>(&bytes), sizeof bytes});
    const std::size_t step = std::max<std::size_t>(kBlockBytes / element_bytes(column), 1);
    buffer.resize(step * element_bytes(column));
    Index previous = 0;
    for (std::size_t begin = 0; begin < column.count; begin += step) {
      const std::size_t end = std::min(begin + step, column.count);
      column.fill(begin, end, buffer.data());
      const std::string_view made(buffer.data(), (end - begin) * element_bytes(column));
      check(block, made, previous);
      sink(made);
    }
    if (block.meaning == Meaning::ascending_ends) check_last_end(ErrorKind::internal, "vtk file", previous, block.last_end);
  }

  void check(const Block& block, std::string_view made, Index& previous) const {
    if (block.meaning == Meaning::values) return;
    // The buffer is allocated: aligned for any number.
    const std::span<const Index> indices(reinterpret_cast<const Index*>(made.data()), made.size() / sizeof(Index));
    if (block.meaning == Meaning::point_indices) check_indices(ErrorKind::internal, "vtk file", indices, points_);
    if (block.meaning == Meaning::ascending_ends) check_ascending(ErrorKind::internal, "vtk file", indices, previous);
  }

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

  std::string xml_, type_;
  std::size_t points_;
  std::uint64_t offset_ = 0;
  std::vector<Block> blocks_;
};

std::string attribute(const char* name, std::size_t value) {
  return std::string(name) + "=\"" + std::to_string(value) + "\"";
}

void expect_indices(const VtkColumn& column, int components) {
  if (column.type != VtkColumn::Type::int32 || column.components != components) {
    throw Error(ErrorKind::internal, "vtk file", "an index column is not Int32, or not in groups of " + std::to_string(components));
  }
}

void write_vtu(const VtkGrid& data, VtkPrecision precision, const ByteSink& sink) {
  using Meaning = Writer::Meaning;
  Writer writer("UnstructuredGrid", data.points.size());
  writer.open_piece(attribute("NumberOfPoints", data.points.size()) + " " +
                    attribute("NumberOfCells", data.tets.size()));
  writer.data("PointData", views(data.point_data), data.points.size());
  writer.data("CellData", views(data.cell_data), data.tets.size());
  writer.points(point_column(data.points, precision));
  writer.open("Cells");
  writer.array(view(data.tets), "connectivity", Meaning::point_indices);
  writer.array(even_ends(data.tets.size(), 4), "offsets");
  const auto tetra = [](std::size_t begin, std::size_t end, char* to) { std::memset(to, kVtkTetra, end - begin); };
  writer.array({"types", 1, VtkColumn::Type::uint8, data.tets.size(), tetra}, "types");
  writer.close("Cells");
  writer.finish(sink);
}

}  // namespace

void write_vtp(const VtkPolySource& source, const ByteSink& sink) {
  using Meaning = Writer::Meaning;
  for (const VtkColumn* indices : {&source.line_points, &source.line_ends}) expect_indices(*indices, 1);
  expect_indices(source.triangles, 3);
  const std::size_t lines = source.line_ends.count;
  Writer writer("PolyData", source.points.count);
  writer.open_piece(attribute("NumberOfPoints", source.points.count) + " NumberOfVerts=\"0\" " +
                    attribute("NumberOfLines", lines) + " NumberOfStrips=\"0\" " +
                    attribute("NumberOfPolys", source.triangles.count));
  writer.data("PointData", source.point_data, source.points.count);
  writer.data("CellData", source.cell_data, lines + source.triangles.count);
  writer.points(source.points);
  writer.open("Lines");
  writer.array(source.line_points, "connectivity", Meaning::point_indices);
  writer.array(source.line_ends, "offsets", Meaning::ascending_ends, source.line_points.count);
  writer.close("Lines");
  writer.open("Polys");
  writer.array(source.triangles, "connectivity", Meaning::point_indices);
  writer.array(even_ends(source.triangles.count, 3), "offsets");
  writer.close("Polys");
  writer.finish(sink);
}

std::string to_vtp(const VtkPolyData& data, VtkPrecision precision) {
  std::string bytes;
  write_vtp({point_column(data.points, precision), view("connectivity", 1, data.line_points.data(), data.line_points.size()),
             view("offsets", 1, data.line_ends.data(), data.line_ends.size()), view(data.triangles),
             views(data.point_data), views(data.cell_data)},
            [&bytes](std::string_view piece) { bytes += piece; });
  return bytes;
}

std::string to_vtu(const VtkGrid& data, VtkPrecision precision) {
  std::string bytes;
  write_vtu(data, precision, [&bytes](std::string_view piece) { bytes += piece; });
  return bytes;
}

// ---------------------------------------------------------------------------------------------------- reading

namespace {

using Attributes = std::map<std::string, std::string, std::less<>>;

// Where the DataArrays of one file lie, by section ("Points", "Lines", ...), and the counts of its one piece. Values are
// read when they are asked for.
class Reader {
 public:
  Reader(const std::filesystem::path& path, const std::string& type) : path_(path.string()), file_(path) {
    parse_head(read_head(), type);
    char tail[kTail.size() + 1];
    const std::size_t rest = file_.read(data_end_, tail, sizeof tail);
    if (std::string_view(tail, rest) != kTail) fail("does not end after its last array; is it truncated?");
  }

  [[nodiscard]] std::size_t count(const char* name) const {
    const auto found = piece_.find(name);
    std::size_t value = 0;
    if (found == piece_.end() || !whole_number(found->second, value)) fail(std::string("Piece has no ") + name);
    return value;
  }

  [[nodiscard]] VtkArray array(const char* section, const char* name) const {
    const auto found = sections_.find(section);
    if (found != sections_.end()) {
      for (const Placed& placed : found->second) {
        if (placed.name == name) return read_array(placed);
      }
    }
    fail(std::string(section) + " has no array " + name);
  }

  template <class T>
  [[nodiscard]] std::vector<T> values(const char* section, const char* name, std::size_t expected) const {
    VtkArray found = array(section, name);
    auto* values = std::get_if<std::vector<T>>(&found.values);
    if (!values) fail(std::string(section) + " " + name + " is not " + vtk_type<T>());
    if (values->size() != expected) fail(std::string(section) + " " + name + " has the wrong length");
    return std::move(*values);
  }

  [[nodiscard]] std::vector<Vec3> points() const {
    const VtkArray a = array("Points", "Points");
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
    const auto connectivity = values<Index>(section, "connectivity", N * n);
    const auto offsets = values<Index>(section, "offsets", n);
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
    std::vector<VtkArray> arrays;
    const auto found = sections_.find(section);
    if (found == sections_.end()) return arrays;
    for (const Placed& placed : found->second) {
      VtkArray& a = arrays.emplace_back(read_array(placed));
      const std::size_t size = std::visit([](const auto& v) { return v.size(); }, a.values);
      if (size != n * static_cast<std::size_t>(a.components))
        fail(std::string(section) + " " + a.name + " has the wrong length");
    }
    return arrays;
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

  // All before the arrays; data_begin_ is behind it.
  [[nodiscard]] std::string read_head() {
    constexpr std::string_view kAppended = "<AppendedData encoding=\"raw\">";
    constexpr std::size_t kBlock = 1 << 14;
    std::string head;
    std::size_t head_end = std::string::npos, mark = std::string::npos;
    for (std::size_t got = kBlock; got == kBlock && mark == std::string::npos;) {
      const std::size_t before = head.size();
      head.resize(before + kBlock);
      got = file_.read(before, head.data() + before, kBlock);
      head.resize(before + got);
      if (head_end == std::string::npos) head_end = head.find(kAppended);
      if (head_end != std::string::npos) mark = head.find_first_not_of(" \n", head_end + kAppended.size());
    }
    if (head_end == std::string::npos) fail("has no raw appended data");
    if (mark == std::string::npos || head[mark] != '_') fail("appended data does not begin with '_'");
    data_begin_ = data_end_ = mark + 1;
    head.resize(head_end);
    return head;
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
        sections_[section].push_back(place_array(attributes(tag)));
      } else if (!name.starts_with('/') && !name.starts_with('?')) {
        section = name;
      }
    }
    if (!seen_file || piece_.empty()) fail("is not a VTK XML file");
  }

  // An array and where its bytes are.
  struct Placed {
    std::string name, type;
    int components = 1;
    std::uint64_t begin = 0, size = 0;
  };

  [[nodiscard]] Placed place_array(const Attributes& attributes) {
    Placed result;
    result.name = at(attributes, "Name");
    result.type = at(attributes, "type");
    std::size_t components = 0, offset = 0;
    if (at(attributes, "format") != "appended" || !whole_number(at(attributes, "offset"), offset) ||
        !whole_number(at(attributes, "NumberOfComponents"), components) || components < 1 || components > 1000) {
      fail("array " + result.name + " is not appended");
    }
    result.components = static_cast<int>(components);
    const std::uint64_t available = file_.size() - data_begin_;
    if (available < 8 || offset > available - 8) fail("ends before array " + result.name);
    if (file_.read(data_begin_ + offset, reinterpret_cast<char*>(&result.size), 8) != 8 || result.size > available - 8 - offset) {
      fail("ends inside array " + result.name);
    }
    result.begin = data_begin_ + offset + 8;
    data_end_ = std::max(data_end_, result.begin + result.size);
    return result;
  }

  [[nodiscard]] VtkArray read_array(const Placed& placed) const {
    if (placed.type == vtk_type<float>()) return {placed.name, placed.components, read<float>(placed)};
    if (placed.type == vtk_type<double>()) return {placed.name, placed.components, read<double>(placed)};
    if (placed.type == vtk_type<std::int32_t>()) return {placed.name, placed.components, read<std::int32_t>(placed)};
    if (placed.type == vtk_type<std::uint8_t>()) return {placed.name, placed.components, read<std::uint8_t>(placed)};
    fail("array " + placed.name + " has type " + placed.type);
  }

  template <class T>
  [[nodiscard]] std::vector<T> read(const Placed& placed) const {
    if (placed.size % sizeof(T) != 0) fail("an array ends inside a value");
    std::vector<T> values(placed.size / sizeof(T));
    if (file_.read(placed.begin, reinterpret_cast<char*>(values.data()), placed.size) != placed.size) fail("ends inside array " + placed.name);
    return values;
  }

  std::string path_;
  FileReader file_;
  std::uint64_t data_begin_ = 0, data_end_ = 0;
  Attributes piece_;
  std::map<std::string, std::vector<Placed>, std::less<>> sections_;
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
  Index last_end = 0;
  check_ascending(ErrorKind::input, reader.path(), data.line_ends, last_end);
  check_last_end(ErrorKind::input, reader.path(), last_end, data.line_points.size());
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
  const auto types = reader.values<std::uint8_t>("Cells", "types", cells);
  for (const std::uint8_t type : types) {
    if (type != kVtkTetra) reader.fail("holds cells that are no tetrahedra");
  }
  data.point_data = reader.data("PointData", data.points.size());
  data.cell_data = reader.data("CellData", cells);
  return data;
}

}  // namespace curvesup
