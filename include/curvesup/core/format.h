#pragma once

#include <cstdarg>
#include <string>

namespace curvesup {

// printf into a string, always with the decimal point of the "C" locale whatever the process locale is.
[[nodiscard]] std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

// Shortest text that reads back to the same double; independent of the locale.
[[nodiscard]] std::string shortest(double value);

// Parses a whole string as a finite number in the "C" locale; false when anything is left over.
[[nodiscard]] bool parse_number(const char* begin, const char* end, double& value);

}  // namespace curvesup
