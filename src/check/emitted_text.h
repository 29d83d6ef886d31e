#pragma once

#include <cstdint>
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
  std::size_t i = at;
  const bool negative = i < text.size() && text[i] == '-';
  if (negative) ++i;
  std::uint64_t digits = 0;
  int count = 0, decimals = 0;
  const auto take = [&](int& counter) {
    for (; i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i, ++counter) {
      if (count + decimals < 18) digits = digits * 10 + static_cast<std::uint64_t>(text[i] - '0');
    }
  };
  take(count);
  if (count == 0) return false;
  if (i + 1 < text.size() && text[i] == '.' && text[i + 1] >= '0' && text[i + 1] <= '9') {
    ++i;
    take(decimals);
  }
  number.decimals = decimals;
  number.plain = count + decimals <= 18 && !(negative && digits == 0);
  number.value = static_cast<double>(digits) / kPowers[decimals < 18 ? decimals : 18];
  if (negative) number.value = -number.value;
  if (i < text.size() && text[i] == '.') number.plain = false;
  // An exponent belongs to the number, but makes it one that is not plain. (A capital E is a word of its own in a job.)
  if (i < text.size() && text[i] == 'e') {
    number.plain = false;
    ++i;
    if (i < text.size() && (text[i] == '-' || text[i] == '+')) ++i;
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
  }
  at = i;
  return true;
}

inline bool starts_with(std::string_view text, std::string_view start) { return text.substr(0, start.size()) == start; }

// Reads `literal` at `at`.
inline bool read_literal(std::string_view text, std::size_t& at, std::string_view literal) {
  if (text.substr(at, literal.size()) != literal) return false;
  at += literal.size();
  return true;
}

inline bool read_integer(std::string_view text, std::size_t& at, int& value) {
  Number number;
  if (!read_number(text, at, number) || number.decimals > 0) return false;
  value = static_cast<int>(number.value);
  return true;
}

}  // namespace curvesup::emitted
