#include "curvesup/io/sha256.h"

#include <openssl/evp.h>

#include <array>

#include "curvesup/core/error.h"
#include "curvesup/io/file_reader.h"

namespace curvesup {

namespace {

void expect(bool done) {
  if (!done) throw Error(ErrorKind::internal, "sha256", "libcrypto gives no digest");
}

}  // namespace

Sha256::Sha256() : context_(EVP_MD_CTX_new(), [](void* c) { EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(c)); }) {
  expect(context_ && EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_.get()), EVP_sha256(), nullptr) == 1);
}

void Sha256::add(std::string_view bytes) {
  expect(EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(context_.get()), bytes.data(), bytes.size()) == 1);
}

std::string Sha256::hex() {
  std::array<unsigned char, 32> digest{};
  unsigned int size = 0;
  expect(EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(context_.get()), digest.data(), &size) == 1 && size == digest.size());
  std::string text;
  for (const unsigned char byte : digest) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 0xf];
  }
  return text;
}

std::string sha256_hex(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.hex();
}

std::string sha256_of_file(const std::filesystem::path& path) {
  const FileReader file(path);
  Sha256 hash;
  std::string block(1 << 20, '\0');
  std::uint64_t at = 0;
  for (std::size_t got = block.size(); got == block.size(); at += got) {
    got = file.read(at, block.data(), block.size());
    hash.add(std::string_view(block).substr(0, got));
  }
  return hash.hex();
}

}  // namespace curvesup
