#include "curvesup/io/sha256.h"

#include <gtest/gtest.h>

#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

// The examples of FIPS 180-4 and its published test vectors.
TEST(Sha256, PublishedVectors) {
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(
      sha256_hex("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrs"
                 "mnopqrstnopqrstu"),
      "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
  EXPECT_EQ(sha256_hex(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfAFile) {
  const TempFolder folder;
  EXPECT_EQ(sha256_of_file(folder.write("f", "abc")), sha256_hex("abc"));
  for (const std::size_t size : {std::size_t{0}, std::size_t{1} << 20, std::size_t{2500001}}) {
    const std::string large(size, 'x');
    EXPECT_EQ(sha256_of_file(folder.write("g", large)), sha256_hex(large)) << size;
  }
  expect_error(ErrorKind::input, {"nothing_here"}, [&] { (void)sha256_of_file(folder.path() / "nothing_here"); });
}

}  // namespace
}  // namespace curvesup
