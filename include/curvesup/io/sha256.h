#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace curvesup {

// SHA-256 (FIPS 180-4) as 64 lower-case hexadecimal digits; by libcrypto, at the speed of memory where the processor helps.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

// Throws Error{input} when the file cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace curvesup
