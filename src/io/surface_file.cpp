#include "curvesup/io/surface_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "curvesup/io/text_file.h"
#include "io/line_scanner.h"

namespace curvesup {

namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read as it lies in memory");

// Corner points, three a triangle.
using Corners = std::vector<Vec3>;

bool lexicographic(const Vec3& a, const Vec3& b) {
  if (a.x() != b.x()) return a.x() < b.x();
  if (a.y() != b.y()) return a.y() < b.y();
  return a.z() < b.z();
}

TriangleMesh weld(const std::filesystem::path& path, const Corners& corners) {
  if (corners.empty()) throw Error(ErrorKind::input, path.string(), "holds no triangles", "export the surface of a solid");
  if (corners.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    throw Error(ErrorKind::input, path.string(), "holds too many triangles", "simplify the surface");
  }
  const Index count = static_cast<Index>(corners.size());
  std::vector<Index> order(corners.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    if (lexicographic(corners[a], corners[b])) return true;
    return !lexicographic(corners[b], corners[a]) && a < b;
  });
  std::vector<Index> first(corners.size());  // lowest corner at the same place
  for (std::size_t i = 0; i < order.size(); ++i) {
    first[order[i]] = i > 0 && corners[order[i]] == corners[order[i - 1]] ? first[order[i - 1]] : order[i];
  }
  TriangleMesh mesh;
  mesh.triangles.resize(corners.size() / 3);
  std::vector<Index> vertex(corners.size());
  for (Index c = 0; c < count; ++c) {
    if (first[c] == c) {
      vertex[c] = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back(corners[c]);
    }
    mesh.triangles[c / 3][c % 3] = vertex[first[c]];
  }
  return mesh;
}

constexpr std::size_t kStlHeader = 84, kStlTriangle = 50;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), [](char c) { return lower(c); });
  return result;
}

// The number of triangles that a binary STL states.
std::size_t stated_triangles(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  return count;
}

// Bytes may follow the last triangle: some programs append notes of their own. In a text the four bytes of the number are
// letters, which make it larger than any file.
bool holds_stated_triangles(std::string_view bytes) {
  return bytes.size() >= kStlHeader && bytes.size() >= kStlHeader + stated_triangles(bytes) * kStlTriangle;
}

// Some binary headers begin with "solid", too; no text has a zero byte among its first lines.
bool is_text_stl(std::string_view bytes) {
  constexpr std::string_view kBlank = " \t\r\n", kMark = "\xef\xbb\xbf";
  std::string_view start = bytes.substr(0, 1024);
  if (start.find('\0') != std::string_view::npos) return false;
  if (start.starts_with(kMark)) start.remove_prefix(kMark.size());
  start.remove_prefix(std::min(start.find_first_not_of(kBlank), start.size()));
  return lower(start.substr(0, start.find_first_of(kBlank))) == "solid";
}

Corners read_binary_stl(const std::filesystem::path& path, std::string_view bytes) {
  Corners corners;
  const std::size_t count = stated_triangles(bytes);
  corners.reserve(3 * count);
  for (std::size_t t = 0; t < count; ++t) {
    float xyz[9];
    std::memcpy(xyz, bytes.data() + kStlHeader + t * kStlTriangle + 12, sizeof xyz);
    for (const float c : xyz) {
      if (!std::isfinite(c)) {
        throw Error(ErrorKind::input, path.string() + ": triangle " + std::to_string(t), "coordinate is not finite");
      }
    }
    for (int c = 0; c < 9; c += 3) corners.emplace_back(xyz[c], xyz[c + 1], xyz[c + 2]);
  }
  return corners;
}

Corners read_text_stl(const std::filesystem::path& path, std::string_view bytes) {
  Corners corners;
  io::LineScanner scan(path, bytes);
  bool closed = false;
  while (scan.next_line()) {
    const std::string_view written = scan.word();
    const std::string word = lower(written);
    if (word == "vertex") {
      corners.push_back(scan.vector("coordinate"));
      scan.expect_line_end();
    } else if (word == "endfacet") {
      if (corners.size() % 3 != 0) scan.fail("a facet must have three vertices");
    } else if (word == "facet") {
      if (corners.size() % 3 != 0) scan.fail("a facet must have three vertices");
      closed = false;
    } else if (word == "endsolid") {
      closed = true;
    } else if (word == "solid") {
      closed = false;
    } else if (word != "outer" && word != "endloop") {
      scan.fail("unexpected '" + io::LineScanner::clipped(written) + "'", "is this an STL file?");
    }
  }
  if (!closed || corners.size() % 3 != 0) {
    scan.fail("the file ends inside a solid", "the file is truncated: export it again");
  }
  return corners;
}

Corners read_stl(const std::filesystem::path& path, std::string_view bytes) {
  if (holds_stated_triangles(bytes)) {
    if (stated_triangles(bytes) == 0 && bytes.size() >= kStlHeader + kStlTriangle) {
      throw Error(ErrorKind::input, path.string(), "binary STL that states 0 triangles, though more bytes follow",
                  "its program did not finish it: export it again");
    }
    return read_binary_stl(path, bytes);
  }
  if (is_text_stl(bytes)) return read_text_stl(path, bytes);
  if (bytes.size() < kStlHeader) {
    throw Error(ErrorKind::input, path.string(), "is neither text STL nor long enough for binary STL",
                "the file is truncated or of another format: export it again");
  }
  throw Error(ErrorKind::input, path.string(),
              "is no text STL, and as binary STL its " + std::to_string(stated_triangles(bytes)) + " triangles would take " +
                  std::to_string(kStlHeader + stated_triangles(bytes) * kStlTriangle) + " bytes of which there are " +
                  std::to_string(bytes.size()),
              "the file is truncated or of another format: export it again");
}

Index obj_vertex(io::LineScanner& scan, std::string_view word, std::size_t vertex_count) {
  const std::string_view text = word.substr(0, word.find('/'));
  std::int64_t index = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), index);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) {
    scan.fail("vertex index is not a whole number: '" + io::LineScanner::clipped(text) + "'");
  }
  const std::int64_t count = static_cast<std::int64_t>(vertex_count);
  const std::int64_t resolved = index < 0 ? count + index : index - 1;  // negative ones count from the last vertex
  if (index == 0 || resolved < 0 || resolved >= count) {
    scan.fail("vertex index " + std::to_string(index) + " is out of range 1 to " + std::to_string(count),
              "indices count from 1");
  }
  return static_cast<Index>(resolved);
}

Corners read_obj(const std::filesystem::path& path, std::string_view bytes) {
  Corners corners, vertices;
  std::vector<Index> polygon;
  io::LineScanner scan(path, bytes);
  while (scan.next_line()) {
    const std::string_view word = scan.word();
    if (word == "v") {
      vertices.push_back(scan.vector("coordinate"));  // a weight or a colour may follow
    } else if (word == "f") {
      polygon.clear();
      while (!scan.at_line_end()) polygon.push_back(obj_vertex(scan, scan.word(), vertices.size()));
      if (polygon.size() < 3) scan.fail("a face needs at least three vertices");
      for (std::size_t i = 2; i < polygon.size(); ++i) {
        for (const Index v : {polygon[0], polygon[i - 1], polygon[i]}) corners.push_back(vertices[v]);
      }
    }
  }
  return corners;
}

std::string lower_extension(const std::filesystem::path& path) { return lower(path.extension().string()); }

}  // namespace

bool is_surface_file(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".stl" || extension == ".obj";
}

TriangleMesh read_surface_file(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  const std::string extension = lower_extension(path);
  if (bytes.empty()) throw Error(ErrorKind::input, path.string(), "the file is empty", "export it again");
  if (extension == ".obj") return weld(path, read_obj(path, bytes));
  if (extension == ".stl") return weld(path, read_stl(path, bytes));
  throw Error(ErrorKind::input, path.string(), "unknown kind of surface file '" + extension + "'",
              "name a .stl or .obj file");
}

}  // namespace curvesup
