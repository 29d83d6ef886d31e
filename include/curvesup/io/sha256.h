#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace curvesup {

// SHA-256 (FIPS 180-4) as 64 lower-case hexadecimal digits; by libcrypto, at the speed of memory where the processor helps.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);

// The same over bytes that come in pieces.
class Sha256 {
 public:
  Sha256();
  void add(std::string_view bytes);
  // Of everything so far; nothing may be added afterwards.
  [[nodiscard]] std::string hex();

 private:
  std::shared_ptr<void> context_;
};

// Throws Error{input} when the file cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace curvesup
