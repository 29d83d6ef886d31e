#include "curvesup/io/sha256.h"

#include <openssl/evp.h>

#include <array>

#include "curvesup/core/error.h"
#include "curvesup/io/text_file.h"

namespace curvesup {

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, 32> digest{};
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1 || size != digest.size()) {
    throw Error(ErrorKind::internal, "sha256", "libcrypto gives no digest");
  }
  std::string text;
  for (const unsigned char byte : digest) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 0xf];
  }
  return text;
}

std::string sha256_of_file(const std::filesystem::path& path) { return sha256_hex(read_file(path)); }

}  // namespace curvesup
