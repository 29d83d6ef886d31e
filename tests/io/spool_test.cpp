#include "curvesup/io/spool.h"

#include <gtest/gtest.h>

#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

namespace fs = std::filesystem;

std::string between(const Spool& spool, std::uint64_t begin, std::uint64_t end) {
  std::string text;
  spool.read(begin, end, [&text](std::string_view piece) {
    EXPECT_LE(piece.size(), std::size_t{1} << 20);
    text += piece;
  });
  return text;
}

TEST(Spool, GivesBackAnyRangeAndLeavesNoName) {
  const TempFolder folder;
  Spool spool(folder.path());
  std::string all;
  for (int i = 0; i < 300; ++i) {
    const std::string line = "line " + std::to_string(i) + "\n";
    spool.append(line);
    all += line;
  }
  spool.append(std::string(3 << 20, 'x'));
  all.append(3 << 20, 'x');
  EXPECT_EQ(spool.size(), all.size());
  EXPECT_TRUE(fs::is_empty(folder.path()));
  EXPECT_EQ(between(spool, 0, all.size()), all);
  EXPECT_EQ(between(spool, 17, 2000017), all.substr(17, 2000000));
  EXPECT_EQ(between(spool, 5, 5), "");
  spool.append("more");
  EXPECT_EQ(between(spool, all.size(), all.size() + 4), "more");
}

TEST(Spool, WithoutAFolderItHoldsTheTextItself) {
  Spool spool;
  spool.append("one");
  spool.append("two");
  EXPECT_EQ(between(spool, 1, 5), "netw");
}

TEST(Spool, RefusesBytesThatItDoesNotHaveAndFoldersThatAreNotThere) {
  const TempFolder folder;
  Spool spool(folder.path());
  spool.append("abc");
  expect_error(ErrorKind::internal, {"spool"}, [&] { spool.read(1, 4, [](std::string_view) {}); });
  expect_error(ErrorKind::output, {"missing"}, [&] { Spool nowhere(folder.path() / "missing"); });
}

}  // namespace
}  // namespace curvesup
