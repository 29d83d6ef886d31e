#include "curvesup/io/value_file.h"

#include <gtest/gtest.h>

#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

TEST(ValueFile, Scalars) {
  const TempFolder folder;
  EXPECT_EQ(read_scalars(folder.write("f", "0.25\n-1e-3\r\n\n  +7  "), 3), (std::vector<double>{0.25, -1e-3, 7.0}));
  EXPECT_TRUE(read_scalars(folder.write("f", ""), 0).empty());
}

TEST(ValueFile, Vectors) {
  const TempFolder folder;
  EXPECT_EQ(read_vectors(folder.write("f", "1 2 3\n\t4 5\t6\n"), 2), (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
}

TEST(ValueFile, ErrorsNameLineAndCounts) {
  const TempFolder folder;
  const auto scalars = [&](const char* text, std::size_t n) { (void)read_scalars(folder.write("f.txt", text), n); };
  expect_error(ErrorKind::input, {"f.txt:2", "nan"}, [&] { scalars("1\nnan\n", 2); });
  expect_error(ErrorKind::input, {"f.txt:3", "abc"}, [&] { scalars("1\n\nabc\n", 2); });
  expect_error(ErrorKind::input, {"f.txt:1", "'2'"}, [&] { scalars("1 2\n", 1); });
  expect_error(ErrorKind::input, {"f.txt", "has 2 values", "needs 3", "vertex"}, [&] { scalars("1\n2\n", 3); });
  expect_error(ErrorKind::input, {"f.txt", "has 2 values", "needs 1"}, [&] { scalars("1\n2\n", 1); });
  expect_error(ErrorKind::input, {"f.txt", "has 0 values", "needs 1"}, [&] { scalars("", 1); });
  const auto vectors = [&](const char* text, std::size_t n) { (void)read_vectors(folder.write("v.txt", text), n); };
  expect_error(ErrorKind::input, {"v.txt:1", "missing"}, [&] { vectors("1 2\n", 1); });
  expect_error(ErrorKind::input, {"v.txt:1"}, [&] { vectors("1 2 3 4\n", 1); });
  expect_error(ErrorKind::input, {"has 1 values", "needs 2", "tet"}, [&] { vectors("1 2 3\n", 2); });
}

}  // namespace
}  // namespace curvesup
