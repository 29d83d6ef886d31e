#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace curvesup {

// A file read in pieces, from any place and by any number of threads. Throws Error{input} naming the path when it is
// missing, a folder, or cannot be read.
class FileReader {
 public:
  explicit FileReader(const std::filesystem::path& path);
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  [[nodiscard]] std::uint64_t size() const { return size_; }
  // The bytes from `at` on, `count` of them unless the file ends before; how many there were.
  std::size_t read(std::uint64_t at, char* to, std::size_t count) const;

 private:
  std::string path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace curvesup
