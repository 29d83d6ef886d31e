#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace curvesup {

// The bytes of a file. Throws Error{input} naming the path when it is missing, a folder, or cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

// Writes a file as a whole. Throws Error{output} naming the path, and leaves no half-written file behind.
void write_file(const std::filesystem::path& path, std::string_view bytes);

// Takes the bytes of a file piece by piece.
using ByteSink = std::function<void(std::string_view)>;

// A file written in pieces, straight to the system: hand it blocks. Destroyed before finish(), it removes the file.
// Throws Error{output} as write_file does.
class FileWriter {
 public:
  explicit FileWriter(std::filesystem::path path);
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;

  void write(std::string_view bytes);
  void finish();

 private:
  [[noreturn]] void fail(int code) const;
  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace curvesup
