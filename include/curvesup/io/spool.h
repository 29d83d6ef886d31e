#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "curvesup/io/text_file.h"

namespace curvesup {

// Text that is put aside and read again. It lies in a file of `folder` that has no name, so that nothing stays behind
// whatever happens to the program; in memory when `folder` is empty. Throws Error{output} when there is no room.
class Spool {
 public:
  explicit Spool(const std::filesystem::path& folder = {});
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  void append(std::string_view text);
  [[nodiscard]] std::uint64_t size() const { return size_; }

  // Hands out the bytes begin .. end - 1 in pieces of at most 1 MB. Any number of threads may read.
  void read(std::uint64_t begin, std::uint64_t end, const ByteSink& sink) const;

 private:
  [[noreturn]] void fail(int code) const;

  std::filesystem::path folder_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::string memory_;
};

}  // namespace curvesup
