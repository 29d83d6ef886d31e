#pragma once

#include <charconv>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/types.h"

namespace curvesup::io {

// Walks a text line by line and word by word; every failure names file:line.
class LineScanner {
 public:
  LineScanner(const std::filesystem::path& path, std::string_view text)
      : path_(path.string()), at_(text.data()), end_(text.data() + text.size()), line_end_(at_) {
    if (text.starts_with("\xef\xbb\xbf")) at_ += 3;  // byte order mark of some editors
    line_end_ = at_;
  }

  // Moves to the next line that is not blank; false at the end of the text.
  bool next_line() {
    while (next_ != nullptr || line_ == 0) {
      if (line_ > 0) at_ = next_;
      if (at_ == end_) return false;
      ++line_;
      const auto* newline = static_cast<const char*>(std::memchr(at_, '\n', static_cast<std::size_t>(end_ - at_)));
      line_end_ = newline ? newline : end_;
      next_ = newline ? newline + 1 : nullptr;
      skip_blanks();
      if (at_ != line_end_) return true;
    }
    return false;
  }

  [[nodiscard]] bool at_line_end() {
    skip_blanks();
    return at_ == line_end_;
  }

  // The next word of the line; empty at its end.
  std::string_view word() {
    skip_blanks();
    const char* begin = at_;
    while (at_ != line_end_ && !is_blank(*at_)) ++at_;
    return {begin, static_cast<std::size_t>(at_ - begin)};
  }

  double number(const char* what) {
    const std::string_view text = word();
    if (text.empty()) fail(std::string(what) + " is missing");
    double value = 0.0;
    if (!parse_number(text.data(), text.data() + text.size(), value)) {
      fail(std::string(what) + " is not a finite number: '" + clipped(text) + "'");
    }
    return value;
  }

  Vec3 vector(const char* what) {
    const double x = number(what), y = number(what), z = number(what);
    return {x, y, z};
  }

  std::int64_t integer(const char* what) {
    const std::string_view text = word();
    if (text.empty()) fail(std::string(what) + " is missing");
    std::int64_t value = 0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (result.ec != std::errc() || result.ptr != text.data() + text.size()) {
      fail(std::string(what) + " is not a whole number: '" + clipped(text) + "'");
    }
    return value;
  }

  void expect_line_end() {
    if (!at_line_end()) fail("unexpected text at the end of the line: '" + clipped(word()) + "'");
  }

  [[noreturn]] void fail(const std::string& what, const std::string& remedy = {}) const {
    throw Error(ErrorKind::input, path_ + ":" + std::to_string(line_), what, remedy);
  }

  [[nodiscard]] static std::string clipped(std::string_view text) {
    std::string shown;
    for (const char c : text.substr(0, 24)) shown += (c >= ' ' && c <= '~') ? c : '?';
    return text.size() > 24 ? shown + "..." : shown;
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
  void skip_blanks() {
    while (at_ != line_end_ && is_blank(*at_)) ++at_;
  }

  std::string path_;
  const char* at_;
  const char* end_;
  const char* line_end_;
  const char* next_ = nullptr;  // start of the following line, null on the last one
  std::size_t line_ = 0;
};

}  // namespace curvesup::io
