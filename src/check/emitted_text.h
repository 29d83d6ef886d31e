#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

// Reading numbers and lines of emitted text.
namespace curvesup::emitted {

// Lines of a text, without their line feed.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    ended_ = end != std::string_view::npos;
    line = rest_.substr(0, end);
    rest_.remove_prefix(ended_ ? end + 1 : rest_.size());
    ++number_;
    return true;
  }
  [[nodiscard]] int number() const { return number_; }
  // False when the last line has no line feed.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  std::string_view rest_;
  int number_ = 0;
  bool ended_ = true;
};

struct Number {
  double value = 0.0;
  int decimals = 0;
  bool plain = false;  // sign, digits, point, digits: no exponent, no nan, no negative zero
};

// A number at `at`; moves `at` behind it. False when there is none.
inline bool read_number(std::string_view text, std::size_t& at, Number& number) {
  static constexpr double kPowers[] = {1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};
  const char *const begin = text.data() + at, *const end = text.data() + text.size();
  const char* p = begin;
  const bool negative = p < end && *p == '-';
  p += negative;
  std::uint64_t digits = 0;
  int all = 0;
  const auto take = [&] {
    for (; p < end && static_cast<unsigned>(*p - '0') < 10u; ++p, ++all) {
      if (all < 18) digits = digits * 10 + static_cast<std::uint64_t>(*p - '0');
    }
  };
  take();
  if (all == 0) return false;
  const int before_point = all;
  if (end - p > 1 && *p == '.' && static_cast<unsigned>(p[1] - '0') < 10u) {
    ++p;
    take();
  }
  const int decimals = all - before_point;
  number.decimals = decimals;
  number.plain = all <= 18 && !(negative && digits == 0);
  number.value = static_cast<double>(digits) / kPowers[decimals < 18 ? decimals : 18];
  if (negative) number.value = -number.value;
  if (p < end && *p == '.') number.plain = false;
  // An exponent belongs to the number, but makes it one that is not plain. (A capital E is a word of its own in a job.)
  if (p < end && *p == 'e') {
    number.plain = false;
    ++p;
    if (p < end && (*p == '-' || *p == '+')) ++p;
    while (p < end && static_cast<unsigned>(*p - '0') < 10u) ++p;
  }
  at += static_cast<std::size_t>(p - begin);
  return true;
}

inline bool starts_with(std::string_view text, std::string_view start) { return text.substr(0, start.size()) == start; }

// Reads `literal` at `at`.
inline bool read_literal(std::string_view text, std::size_t& at, std::string_view literal) {
  if (text.size() - at < literal.size() || std::memcmp(text.data() + at, literal.data(), literal.size()) != 0) return false;
  at += literal.size();
  return true;
}
// The same with a length that is known beforehand.
template <std::size_t kSize>
inline bool read_literal(std::string_view text, std::size_t& at, const char (&literal)[kSize]) {
  if (text.size() - at < kSize - 1 || std::memcmp(text.data() + at, literal, kSize - 1) != 0) return false;
  at += kSize - 1;
  return true;
}

// All bytes are printable ASCII: eight at a time, none below a space, none from 127 on.
inline bool is_printable(std::string_view line) {
  constexpr std::uint64_t kOnes = 0x0101010101010101, kTops = 0x80 * kOnes;
  std::uint64_t bad = 0;
  std::size_t i = 0;
  for (; i + 8 <= line.size(); i += 8) {
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, line.data() + i, 8);
    bad |= (bytes | (bytes + kOnes) | ((bytes - 0x20 * kOnes) & ~bytes)) & kTops;
  }
  for (; i < line.size(); ++i) bad |= line[i] < 0x20 || line[i] > 0x7e;
  return bad == 0;
}

inline bool read_integer(std::string_view text, std::size_t& at, int& value) {
  Number number;
  if (!read_number(text, at, number) || number.decimals > 0) return false;
  value = static_cast<int>(number.value);
  return true;
}

}  // namespace curvesup::emitted
