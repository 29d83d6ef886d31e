#include "curvesup/io/value_file.h"

#include <algorithm>

#include "curvesup/io/text_file.h"
#include "io/line_scanner.h"

namespace curvesup {

namespace {

template <class T, class ReadLine>
std::vector<T> read_lines(const std::filesystem::path& path, std::size_t expected, std::string_view element,
                          const ReadLine& read_line) {
  const std::string text = read_file(path);
  io::LineScanner scan(path, text);
  std::vector<T> values;
  values.reserve(std::min(expected, text.size() / 2 + 1));
  std::size_t lines = 0;
  while (scan.next_line()) {
    ++lines;
    if (lines > expected) continue;  // count on, for the message
    values.push_back(read_line(scan));
    scan.expect_line_end();
  }
  if (lines != expected) {
    throw Error(ErrorKind::input, path.string(),
                "has " + std::to_string(lines) + " values, the mesh needs " + std::to_string(expected) + " (one per " +
                    std::string(element) + ")",
                "use the file that belongs to this mesh");
  }
  return values;
}

}  // namespace

std::vector<double> read_scalars(const std::filesystem::path& path, std::size_t expected_count,
                                 std::string_view element) {
  return read_lines<double>(path, expected_count, element, [](io::LineScanner& scan) { return scan.number("value"); });
}

std::vector<Vec3> read_vectors(const std::filesystem::path& path, std::size_t expected_count,
                               std::string_view element) {
  return read_lines<Vec3>(path, expected_count, element,
                          [](io::LineScanner& scan) { return scan.vector("component"); });
}

}  // namespace curvesup
