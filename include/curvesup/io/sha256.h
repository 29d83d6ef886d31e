#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace curvesup {

// SHA-256 (FIPS 180-4), fed piece by piece:  Sha256 hash; hash.update(a); hash.update(b); hash.hex();
class Sha256 {
 public:
  void update(std::string_view bytes);
  // 64 lower-case hexadecimal digits of all bytes so far; the object may be fed further.
  [[nodiscard]] std::string hex() const;

 private:
  void compress(const unsigned char* block);

  std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, 64> pending_{};
  std::uint64_t length_ = 0;  // bytes so far; length_ % 64 of them wait in pending_
};

[[nodiscard]] std::string sha256_hex(std::string_view bytes);

// Throws Error{input} when the file cannot be read.
[[nodiscard]] std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace curvesup
