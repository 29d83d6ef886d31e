#include <gtest/gtest.h>

#include <algorithm>

#include "helpers/program.h"
#include "helpers/shapes.h"

// Whatever is wrong with the input: one clear line, the documented exit code, nothing left behind, never a crash.
namespace curvesup {
namespace {

using program::Folder;
using program::Outcome;

std::string tet_text(const TetMesh& mesh) {
  std::ostringstream out;
  out << mesh.vertices.size() << " vertices\n" << mesh.tets.size() << " tets\n";
  for (const Vec3& v : mesh.vertices) out << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const auto& t : mesh.tets) out << "4 " << t[0] << ' ' << t[1] << ' ' << t[2] << ' ' << t[3] << '\n';
  return out.str();
}

TetMesh cube() { return shapes::brick_mesh({0, 0, 0}, {4, 4, 4}, {2, 2, 2}); }

void expect_refused(const Folder& folder, const std::string& arguments, int exit_code, const std::string& kind, const std::string& word) {
  const auto before = folder.files(".");
  const Outcome run = folder.curvesup(arguments);
  EXPECT_EQ(run.exit_code, exit_code) << run.err;
  const std::string start = "curvesup: error [" + kind + "] ";
  const std::size_t line = run.err.find(start);
  ASSERT_NE(line, std::string::npos) << run.err;
  EXPECT_EQ(std::count(run.err.begin() + static_cast<long>(line), run.err.end(), '\n'), 1) << "one line: " << run.err;
  EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
  EXPECT_EQ(folder.files("."), before) << "nothing is left behind";
}

TEST(BadInput, MissingModel) {
  const Folder folder;
  folder.write("c.json", "{}");
  expect_refused(folder, "slice nowhere.tet c.json", 3, "input", "nowhere.tet");
}

TEST(BadInput, MissingConfig) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  expect_refused(folder, "slice m.tet nowhere.json", 2, "usage", "nowhere.json");
}

TEST(BadInput, TruncatedModel) {
  const Folder folder;
  const std::string text = tet_text(cube());
  folder.write("m.tet", text.substr(0, text.size() - 40));
  folder.write("c.json", "{}");
  expect_refused(folder, "slice m.tet c.json", 3, "input", "m.tet");
}

TEST(BadInput, IndexOutOfRange) {
  const Folder folder;
  TetMesh mesh = cube();
  mesh.tets[3][2] = 999;
  folder.write("m.tet", tet_text(mesh));
  folder.write("c.json", "{}");
  expect_refused(folder, "slice m.tet c.json", 3, "input", "999");
}

TEST(BadInput, NotANumber) {
  const Folder folder;
  std::string text = tet_text(cube());
  const std::size_t line = text.find("\n2 ");
  text.replace(line + 1, 1, "nan");
  folder.write("m.tet", text);
  folder.write("c.json", "{}");
  expect_refused(folder, "slice m.tet c.json", 3, "input", "m.tet:");
}

TEST(BadInput, MixedOrientationThatCannotBeMended) {
  const Folder folder;
  TetMesh mesh = cube();
  mesh.vertices[mesh.tets[0][0]] += Vec3(9, 9, 9);  // folds tets over their neighbours
  folder.write("m.tet", tet_text(mesh));
  folder.write("c.json", "{}");
  expect_refused(folder, "slice m.tet c.json", 3, "input", "tet");
}

TEST(BadInput, UnknownKeyAndValueOutOfRange) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("a.json", R"({"layers": {"cuont": 5}})");
  folder.write("b.json", R"({"layers": {"count": -5}})");
  folder.write("c.json", "{}");
  expect_refused(folder, "slice m.tet a.json", 2, "usage", "layers.count");
  expect_refused(folder, "slice m.tet b.json", 2, "usage", "-5");
  expect_refused(folder, "slice m.tet c.json -s support.leaf_radius_mm=x", 2, "usage", "support.leaf_radius_mm");
  expect_refused(folder, "slice m.tet", 2, "usage", "CONFIG");
  expect_refused(folder, "slice m.tet c.json --frobnicate", 2, "usage", "frobnicate");
}

TEST(BadInput, CommandThatIsNone) {
  const Folder folder;
  expect_refused(folder, "slise m.tet c.json", 2, "usage", "did you mean slice?");
  expect_refused(folder, "slise", 2, "usage", "slice, compare, inspect, check, config");
  expect_refused(folder, "frobnicate", 2, "usage", "slice, compare, inspect, check, config");
  EXPECT_EQ(folder.curvesup("frobnicate").err.find("did you mean"), std::string::npos);
}

TEST(BadInput, CheckOfAFolderThatSliceDidNotWrite) {
  const Folder folder;
  expect_refused(folder, "check nowhere", 2, "usage", "nowhere: is not there");
  folder.write("m.tet", "");
  expect_refused(folder, "check .", 2, "usage", "no output folder of slice");
  expect_refused(folder, "check m.tet", 2, "usage", "no output folder of slice");
}

TEST(BadInput, OtherCommandsSayTheSame) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("short.tet", "8 vertices\n");
  folder.write("a.json", R"({"layers": {"cuont": 5}})");
  folder.write("c.json", "{}");
  for (const std::string command : {"inspect nowhere.tet", "compare nowhere.tet c.json"}) {
    expect_refused(folder, command, 3, "input", "nowhere.tet");
  }
  for (const std::string command : {"inspect short.tet", "compare short.tet c.json"}) expect_refused(folder, command, 3, "input", "short.tet");
  expect_refused(folder, "compare m.tet a.json", 2, "usage", "layers.count");
  expect_refused(folder, "compare m.tet nowhere.json", 2, "usage", "nowhere.json");
}

// Two blocks, one through the other: it loads, and slices without support only.
TEST(BadInput, PartsThatPassThroughEachOtherHaveNoSupport) {
  const Folder folder;
  TetMesh mesh = cube();
  const TetMesh other = shapes::brick_mesh({2.3, 2.3, 3.1}, {9.3, 3.3, 5.2}, {1, 1, 1});
  const Index first = static_cast<Index>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto tet : other.tets) {
    for (Index& v : tet) v += first;
    mesh.tets.push_back(tet);
  }
  folder.write("m.tet", tet_text(mesh));
  folder.write("c.json", R"({"layers": {"count": 10}})");
  const Outcome inspected = folder.curvesup("inspect m.tet");
  EXPECT_EQ(inspected.exit_code, 3);
  EXPECT_NE(inspected.out.find("no support intersecting_faces"), std::string::npos) << inspected.out;
  EXPECT_NE(inspected.out.find("only with support.method none"), std::string::npos) << inspected.out;
  expect_refused(folder, "slice m.tet c.json", 4, "geometry", "inter");
  EXPECT_EQ(folder.curvesup("slice m.tet c.json -s support.method=none --stop-after layers").exit_code, 0);
}

TEST(BadInput, UnwritableOutput) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("c.json", "{}");
  folder.write("taken", "a file, no folder");
  expect_refused(folder, "slice m.tet c.json -o taken/out", 7, "output", "taken");
  expect_refused(folder, "slice m.tet c.json -o taken", 7, "output", "taken");
}

TEST(BadInput, AFolderThatIsNotAnEarlierOutputIsNotReplaced) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("c.json", "{}");
  std::filesystem::create_directory(folder.path() / "mine");
  folder.write("mine/thesis.txt", "precious");
  expect_refused(folder, "slice m.tet c.json -o mine", 7, "output", "mine");
}

TEST(BadInput, SurfacesThatCannotBeFilled) {
  const Folder folder;
  TriangleMesh surface = boundary_surface(shapes::as_model(cube()));
  folder.write("closed.stl", shapes::stl_text(surface));
  surface.triangles.pop_back();
  folder.write("open.stl", shapes::stl_text(surface));
  folder.write("c.json", "{}");
  folder.write("f.json", R"({"field": {"source": "scalar_file", "path": "f.txt"}})");
  expect_refused(folder, "slice open.stl c.json", 3, "input", "open.stl: the surface is open at");
  expect_refused(folder, "slice closed.stl f.json", 2, "usage", "field.source");
  const program::Outcome inspected = folder.curvesup("inspect open.stl -o page.html");
  EXPECT_EQ(inspected.exit_code, 3);
  EXPECT_NE(inspected.out.find("open_edges"), std::string::npos) << inspected.out;
  EXPECT_TRUE(folder.files(".").contains("page.html"));
  EXPECT_EQ(folder.curvesup("inspect closed.stl").exit_code, 0);
}

TEST(BadInput, FieldWithTooFewValuesAndConstantField) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("short.txt", "0\n1\n");
  std::string constant;
  for (std::size_t i = 0; i < cube().vertices.size(); ++i) constant += "0.5\n";
  folder.write("constant.txt", constant);
  folder.write("a.json", R"({"field": {"source": "scalar_file", "path": "short.txt"}})");
  folder.write("b.json", R"({"field": {"source": "scalar_file", "path": "constant.txt"}})");
  expect_refused(folder, "slice m.tet a.json", 3, "input", "short.txt");
  expect_refused(folder, "slice m.tet b.json", 3, "input", "constant");
}

}  // namespace
}  // namespace curvesup
