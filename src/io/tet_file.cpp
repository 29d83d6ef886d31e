#include "curvesup/io/tet_file.h"

#include <algorithm>
#include <limits>

#include "curvesup/io/text_file.h"
#include "io/line_scanner.h"

namespace curvesup {

namespace {

constexpr const char* kFormatHint = "a .tet file starts with '<n> vertices' and '<m> tets'";

std::size_t read_count(io::LineScanner& scan, std::string_view unit) {
  if (!scan.next_line()) scan.fail("the file ends before the number of " + std::string(unit), kFormatHint);
  std::string_view text = scan.word();
  std::int64_t count = -1;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), count);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size() || scan.word() != unit) {
    scan.fail("expected '<count> " + std::string(unit) + "'", kFormatHint);
  }
  scan.expect_line_end();
  if (count < 1 || count > std::numeric_limits<Index>::max()) {
    scan.fail("number of " + std::string(unit) + " must be from 1 to 2147483647, is " + std::to_string(count));
  }
  return static_cast<std::size_t>(count);
}

[[noreturn]] void fail_truncated(const io::LineScanner& scan, std::size_t got, std::size_t expected, const char* unit) {
  scan.fail("the file ends after " + std::to_string(got) + " of " + std::to_string(expected) + " " + unit,
            "the file is truncated: export it again");
}

std::array<Index, 4> read_tet(io::LineScanner& scan, std::size_t vertex_count) {
  const std::int64_t corners = scan.integer("number of corners");
  if (corners != 4) scan.fail("a tet starts with 4, not " + std::to_string(corners), "only tetrahedra are accepted");
  std::array<Index, 4> tet{};
  for (Index& corner : tet) {
    const std::int64_t index = scan.integer("vertex index");
    if (index < 0 || index >= static_cast<std::int64_t>(vertex_count)) {
      scan.fail("vertex index " + std::to_string(index) + " is out of range 0 to " + std::to_string(vertex_count - 1),
                "indices count from 0");
    }
    corner = static_cast<Index>(index);
  }
  return tet;
}

}  // namespace

TetMesh read_tet_file(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  if (text.empty()) throw Error(ErrorKind::input, path.string(), "the file is empty", "export it again");
  io::LineScanner scan(path, text);
  const std::size_t vertex_count = read_count(scan, "vertices");
  const std::size_t tet_count = read_count(scan, "tets");

  TetMesh mesh;
  // A line has at least six bytes, so a false count cannot ask for more memory than the file is worth.
  mesh.vertices.reserve(std::min(vertex_count, text.size() / 6 + 1));
  mesh.tets.reserve(std::min(tet_count, text.size() / 6 + 1));
  for (std::size_t v = 0; v < vertex_count; ++v) {
    if (!scan.next_line()) fail_truncated(scan, v, vertex_count, "vertices");
    mesh.vertices.push_back(scan.vector("coordinate"));
    scan.expect_line_end();
  }
  for (std::size_t t = 0; t < tet_count; ++t) {
    if (!scan.next_line()) fail_truncated(scan, t, tet_count, "tets");
    mesh.tets.push_back(read_tet(scan, vertex_count));
    scan.expect_line_end();
  }
  if (scan.next_line()) scan.fail("more lines than the header says", "check the counts in the first two lines");
  return mesh;
}

void write_tet_file(const std::filesystem::path& path, const TetMesh& mesh) {
  std::string text =
      std::to_string(mesh.vertices.size()) + " vertices\n" + std::to_string(mesh.tets.size()) + " tets\n";
  for (const Vec3& v : mesh.vertices) text += shortest(v.x()) + ' ' + shortest(v.y()) + ' ' + shortest(v.z()) + '\n';
  for (const auto& tet : mesh.tets) {
    text += '4';
    for (const Index corner : tet) text += ' ' + std::to_string(corner);
    text += '\n';
  }
  write_file(path, text);
}

}  // namespace curvesup
