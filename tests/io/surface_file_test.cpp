#include "curvesup/io/surface_file.h"

#include <gtest/gtest.h>

#include <cctype>
#include <cstring>

#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

// A tetrahedron's four faces, seen from outside counter-clockwise.
const std::vector<Vec3> kCorner = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0.5}};
const std::vector<std::array<Index, 3>> kFace = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

std::string text_stl() {
  std::string text = "solid a name with words\n";
  for (const auto& f : kFace) {
    text += "  facet normal 0 0 0\n    outer loop\n";
    for (const Index v : f) {
      text += "      vertex " + std::to_string(kCorner[v].x()) + " " + std::to_string(kCorner[v].y()) + " " +
              std::to_string(kCorner[v].z()) + "\n";
    }
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid a name with words\n";
}

std::string binary_stl() {
  std::string bytes = "solid: some programs start their binary header like this";
  bytes.resize(80);
  const auto append = [&](const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); };
  const std::uint32_t count = 4;
  append(&count, 4);
  for (const auto& f : kFace) {
    const float normal[3] = {0, 0, 0};
    append(normal, sizeof normal);
    for (const Index v : f) {
      const float xyz[3] = {float(kCorner[v].x()), float(kCorner[v].y()), float(kCorner[v].z())};
      append(xyz, sizeof xyz);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

void expect_tetrahedron(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.vertices.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  for (std::size_t t = 0; t < 4; ++t) {
    for (int c = 0; c < 3; ++c) EXPECT_EQ(mesh.vertices[mesh.triangles[t][c]], kCorner[kFace[t][c]]);
  }
}

TEST(SurfaceFile, TextAndBinaryStlAreWelded) {
  const TempFolder folder;
  expect_tetrahedron(read_surface_file(folder.write("a.stl", text_stl())));
  expect_tetrahedron(read_surface_file(folder.write("b.STL", binary_stl())));
}

TEST(SurfaceFile, StlAsProgramsReallyWriteIt) {
  const TempFolder folder;
  std::string upper = text_stl();
  for (char& c : upper) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  expect_tetrahedron(read_surface_file(folder.write("upper.stl", upper)));
  expect_tetrahedron(read_surface_file(folder.write("mark.stl", "\xef\xbb\xbf" + text_stl())));
  expect_tetrahedron(read_surface_file(folder.write("blank.stl", "\r\n \n" + text_stl())));
  expect_tetrahedron(read_surface_file(folder.write("note.stl", binary_stl() + "\nmade by some program")));
  expect_tetrahedron(read_surface_file(folder.write("long.stl", binary_stl() + std::string(200, '\0'))));
}

TEST(SurfaceFile, ObjWithNormalsPolygonsAndNegativeIndices) {
  const TempFolder folder;
  const std::string square =
      "# a comment\nmtllib x.mtl\nv 0 0 0\nv 2 0 0 1.0\nv 2 2 0\nv 0 2 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\n";
  const TriangleMesh mesh = read_surface_file(folder.write("s.obj", square));
  EXPECT_EQ(mesh.vertices.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_DOUBLE_EQ(total_area(mesh), 4.0);
  const TriangleMesh last =
      read_surface_file(folder.write("n.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"));
  EXPECT_EQ(last.vertices, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(SurfaceFile, Errors) {
  const TempFolder folder;
  const auto refused = [&](const char* name, const std::string& bytes, std::initializer_list<std::string> words) {
    const auto path = folder.write(name, bytes);
    expect_error(ErrorKind::input, words, [&] { (void)read_surface_file(path); });
  };
  refused("a.stl", "", {"a.stl", "is empty"});
  refused("a.obj", "", {"a.obj", "is empty"});
  refused("a.stl", " \n", {"a.stl", "neither"});
  refused("a.stl", "solid x\nendsolid x\n", {"no triangles"});
  refused("a.stl", std::string(84, '\0'), {"a.stl", "no triangles"});
  refused("a.stl", binary_stl().replace(80, 4, 4, '\0'), {"a.stl", "states 0 triangles"});
  refused("a.stl", binary_stl().substr(0, 200), {"a.stl", "4 triangles", "284 bytes", "200"});
  refused("a.stl", text_stl() + "solid b\n", {"a.stl:", "truncated"});
  refused("a.stl", text_stl().substr(0, text_stl().find("endsolid")), {"a.stl:", "truncated"});
  refused("a.stl", "solid\nfacet\nouter loop\nvertex 0 0 nan\n", {"a.stl:4", "nan"});
  refused("a.stl", "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nendfacet\nendsolid\n", {"a.stl:5", "three"});
  std::string infinite = binary_stl();
  const float bad = std::numeric_limits<float>::infinity();
  std::memcpy(infinite.data() + 84 + 50 + 12, &bad, 4);
  refused("a.stl", infinite, {"triangle 1", "finite"});
  refused("a.obj", "v 0 0 0\nf 1 1 2\n", {"a.obj:2", "index 2"});
  refused("a.obj", "v 0 0 0\nf 0 1 1\n", {"a.obj:2", "index 0"});
  refused("a.obj", "v 0 0 0\nf 1 1\n", {"a.obj:2"});
  refused("a.ply", "ply\n", {".ply", ".stl"});
}

}  // namespace
}  // namespace curvesup
