#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "curvesup/motion/machine.h"

// Appending numbers to program text: fixed point, no exponent, no "-0", no locale.
namespace curvesup::emit {

inline constexpr std::int64_t kPowersOfTen[] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000};

inline void append_integer(std::string& text, std::int64_t value) {
  char buffer[24];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  text.append(buffer, result.ptr);
}

// `units` in units of 10^-decimals.
inline void append_units(std::string& text, std::int64_t units, int decimals) {
  const std::int64_t power = kPowersOfTen[decimals];
  if (units < 0) text += '-';
  const std::int64_t magnitude = units < 0 ? -units : units;
  append_integer(text, magnitude / power);
  if (decimals == 0) return;
  char digits[10];
  digits[0] = '.';
  std::int64_t fraction = magnitude % power;
  for (int i = decimals; i > 0; --i, fraction /= 10) digits[i] = static_cast<char>('0' + fraction % 10);
  text.append(digits, static_cast<std::size_t>(decimals) + 1);
}

inline std::int64_t to_units(double value, int decimals) {
  return std::llround(value * static_cast<double>(kPowersOfTen[decimals]));
}

inline void append_fixed(std::string& text, double value, int decimals) {
  append_units(text, to_units(value, decimals), decimals);
}

inline std::string fixed(double value, int decimals) {
  std::string text;
  append_fixed(text, value, decimals);
  return text;
}

inline void append_pose(std::string& text, const Pose& pose) {
  text += "p[";
  for (int i = 0; i < 3; ++i) {
    append_fixed(text, pose.position_m[i], 7);
    text += ',';
  }
  for (int i = 0; i < 3; ++i) {
    append_fixed(text, pose.rotation_vector[i], 6);
    text += i < 2 ? ',' : ']';
  }
}

inline void append_joints(std::string& text, const Joints& joints) {
  text += '[';
  for (int i = 0; i < 6; ++i) {
    append_fixed(text, joints[i], 6);
    text += i < 5 ? ',' : ']';
  }
}

// Zero-padded.
inline std::string padded(int value, int digits) {
  std::string text = std::to_string(value);
  if (static_cast<int>(text.size()) < digits) text.insert(0, static_cast<std::size_t>(digits) - text.size(), '0');
  return text;
}

}  // namespace curvesup::emit
