#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "curvesup/io/file_reader.h"
#include "curvesup/io/sha256.h"

namespace curvesup::emitted {

// Lines of a large file, without their line feed: only a block of it is held. A line stays until the next one is asked for.
class FileLines {
 public:
  explicit FileLines(const std::filesystem::path& path) : file_(path) {}

  bool next(std::string_view& line) {
    at_ += taken_;
    taken_ = 0;
    std::size_t end = text_.find('\n', at_);
    while (end == std::string::npos && more()) end = text_.find('\n', at_);
    if (at_ == text_.size()) return false;
    ended_ = end != std::string::npos;
    line = std::string_view(text_).substr(at_, end - at_);
    taken_ = line.size() + ended_;
    ++number_;
    return true;
  }
  [[nodiscard]] int number() const { return number_; }
  // False when the last line has no line feed.
  [[nodiscard]] bool ended() const { return ended_; }
  // Of the line in the file.
  [[nodiscard]] std::uint64_t offset() const { return before_ + at_; }

  [[nodiscard]] std::uint64_t size() const { return file_.size(); }
  // After the last line.
  [[nodiscard]] std::uint64_t bytes() const { return read_; }
  [[nodiscard]] std::string sha256() { return hash_.hex(); }

 private:
  // Another block behind what is left of the one before.
  bool more() {
    text_.erase(0, at_);
    before_ += at_;
    at_ = 0;
    const std::size_t left = text_.size();
    text_.resize(left + kBlock);
    const std::size_t got = file_.read(read_, text_.data() + left, kBlock);
    text_.resize(left + got);
    hash_.add(std::string_view(text_).substr(left));
    read_ += got;
    return got > 0;
  }

  static constexpr std::size_t kBlock = 1 << 18;
  FileReader file_;
  Sha256 hash_;
  std::string text_;
  std::size_t at_ = 0, taken_ = 0;
  std::uint64_t before_ = 0, read_ = 0;  // of the file: before text_, and in all
  int number_ = 0;
  bool ended_ = true;
};

}  // namespace curvesup::emitted
