#include "curvesup/io/tet_file.h"

#include <gtest/gtest.h>

#include "curvesup/io/text_file.h"
#include "helpers/shapes.h"
#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

const std::string kOneTet = "4 vertices\n1 tets\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n4 0 1 2 3\n";

void expect_refused(const std::string& text, std::initializer_list<std::string> words) {
  const TempFolder folder;
  const auto path = folder.write("bad.tet", text);
  expect_error(ErrorKind::input, words, [&] { (void)read_tet_file(path); });
}

TEST(TetFile, WhatIsWrittenReadsBackExactly) {
  const TempFolder folder;
  TetMesh mesh = shapes::brick_mesh({-1.0 / 3.0, 1e-17, 1e9}, {0.1, 2, 1.1e9}, {2, 3, 1});
  mesh.vertices[0].x() = -0.0;
  write_tet_file(folder.path() / "m.tet", mesh);
  const TetMesh again = read_tet_file(folder.path() / "m.tet");
  EXPECT_EQ(again.vertices, mesh.vertices);
  EXPECT_EQ(again.tets, mesh.tets);
}

TEST(TetFile, AcceptsWhatOtherProgramsWrite) {
  const TempFolder folder;
  std::string windows = "\xef\xbb\xbf";
  for (const char c : kOneTet) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const std::string texts[] = {kOneTet, kOneTet.substr(0, kOneTet.size() - 1), "\n" + kOneTet + "\n\n", windows};
  for (const std::string& text : texts) {
    const TetMesh mesh = read_tet_file(folder.write("a.tet", text));
    ASSERT_EQ(mesh.vertices.size(), 4u);
    EXPECT_EQ(mesh.vertices[3], Vec3(0, 0, 1));
    ASSERT_EQ(mesh.tets.size(), 1u);
    EXPECT_EQ(mesh.tets[0], (std::array<Index, 4>{0, 1, 2, 3}));
  }
}

TEST(TetFile, KeepsTheOrientationOfTheFile) {
  const TempFolder folder;
  const auto path = folder.write("a.tet", "4 vertices\n1 tets\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n4 0 2 1 3\n");
  EXPECT_LT(tet_volume(read_tet_file(path), 0), 0.0);
}

TEST(TetFile, ErrorsNameFileAndLine) {
  expect_refused("", {"bad.tet", "the file is empty"});
  expect_refused("\n", {"bad.tet", "vertices"});
  expect_refused("hello\n", {"bad.tet:1", "vertices"});
  expect_refused("4 vertices\n1 tets and more\n", {"bad.tet:2"});
  expect_refused("-4 vertices\n1 tets\n", {"bad.tet:1", "-4"});
  expect_refused("0 vertices\n0 tets\n", {"bad.tet:1"});
  expect_refused("99999999999 vertices\n1 tets\n", {"bad.tet:1"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 0\n", {"bad.tet:4", "missing"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 0 0 7\n", {"bad.tet:4", "7"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 nan 0\n", {"bad.tet:4", "not a finite number", "nan"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 -inf 0\n", {"bad.tet:4", "not a finite number"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 1e999 0\n", {"bad.tet:4", "not a finite number"});
  expect_refused("4 vertices\n1 tets\n0 0 0\n1 0,5 0\n", {"bad.tet:4", "0,5"});
  const std::string head = kOneTet.substr(0, kOneTet.find("4 0 1"));
  expect_refused(head + "4 0 1 2 4\n", {"bad.tet:7", "index 4", "0 to 3"});
  expect_refused(head + "4 0 1 2 -1\n", {"bad.tet:7", "index -1"});
  expect_refused(head + "8 0 1 2 3\n", {"bad.tet:7", "tetrahedra"});
  expect_refused(head + "4 0 1 2\n", {"bad.tet:7", "missing"});
  expect_refused(head + "4 0 1 2 3.5\n", {"bad.tet:7", "3.5"});
  expect_refused(kOneTet + "4 0 1 2 3\n", {"bad.tet:8", "more lines"});
}

TEST(TetFile, EveryTruncationIsAnError) {
  // The last two characters are the last index and the newline: without the newline alone the file is whole.
  for (std::size_t length = 0; length + 1 < kOneTet.size(); ++length) {
    SCOPED_TRACE(length);
    expect_refused(kOneTet.substr(0, length), {"bad.tet"});
  }
  expect_refused("2000000000 vertices\n2000000000 tets\n0 0 0\n", {"bad.tet:3", "1 of 2000000000"});
}

TEST(TextFile, MissingFolderAndUnreadable) {
  const TempFolder folder;
  expect_error(ErrorKind::input, {"no_such", "no such file"}, [&] { (void)read_file(folder.path() / "no_such"); });
  expect_error(ErrorKind::input, {"folder"}, [&] { (void)read_file(folder.path()); });
  const auto file = folder.write("plain", "x");
  expect_error(ErrorKind::input, {"cannot be opened"}, [&] { (void)read_file(file / "below"); });
  expect_error(ErrorKind::output, {"cannot be written"}, [&] { write_file(folder.path() / "no" / "file", "x"); });
}

TEST(TextFile, AnyBytesSurvive) {
  const TempFolder folder;
  for (const std::size_t size : {0u, 1u, (1u << 20) - 1, 1u << 20, (1u << 20) + 1}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 131 >> 3);
    write_file(folder.path() / "b", bytes);
    EXPECT_EQ(read_file(folder.path() / "b"), bytes);
  }
}

}  // namespace
}  // namespace curvesup
