#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

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

TEST(BadInput, ConfigsThatAreOdd) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("overflow.json", R"({"model": {"scale": 1e400}})");
  folder.write("nopath.json", R"({"field": {"source": "scalar_file", "path": ""}})");
  for (const std::string command : {"slice m.tet ", "compare m.tet ", "config check "}) {
    expect_refused(folder, command + "overflow.json", 2, "usage", "overflow.json: holds a number that is too large");
    expect_refused(folder, command + "nopath.json", 2, "usage", "set field.path");
  }
}

TEST(BadInput, EmptyModel) {
  const Folder folder;
  folder.write("c.json", "{}");
  for (const std::string name : {"m.tet", "m.stl", "m.obj"}) {
    folder.write(name, "");
    expect_refused(folder, "slice " + name + " c.json", 3, "input", name + ": the file is empty");
  }
}

TEST(BadInput, FieldsThatNoPrintFollows) {
  const Folder folder;
  const TetMesh mesh = shapes::brick_mesh({0, 0, 0}, {8, 8, 8}, {4, 4, 4});
  folder.write("m.tet", tet_text(mesh));
  std::string zero, dip;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) zero += "0 0 0\n";
  for (const Vec3& p : mesh.vertices) dip += std::to_string((p - Vec3(4, 4, 4)).norm()) + "\n";
  folder.write("zero.txt", zero);
  folder.write("dip.txt", dip);
  folder.write("a.json", R"({"field": {"source": "vector_file", "path": "zero.txt"}})");
  folder.write("b.json", R"({"field": {"source": "scalar_file", "path": "dip.txt"}, "layers": {"count": 10}})");
  expect_refused(folder, "slice m.tet a.json", 3, "input", "zero.txt: every vector is zero");
  expect_refused(folder, "slice m.tet b.json", 3, "input", "dip.txt, vertex 62: the field has a minimum inside the part, at (4.000, 4.000");
}

// Each file of an output in turn is a folder.
TEST(BadInput, CheckOfAnOutputThatWasTamperedWith) {
  const Folder folder;
  folder.write("m.tet", tet_text(cube()));
  folder.write("c.json", R"({"support": {"method": "none"}})");
  ASSERT_LE(folder.curvesup("slice m.tet c.json -o out").exit_code, 1);
  for (const std::string file : {"manifest.json", "toolpaths.vtp", "duet/print.g", "robot/part_0001.script"}) {
    const auto path = folder.path() / "out" / file;
    const std::string bytes = program::read_all(path);
    std::filesystem::remove(path);
    std::filesystem::create_directory(path);
    expect_refused(folder, "check out", 3, "input", "out/" + file + ": is a folder");
    std::filesystem::remove(path);
    folder.write("out/" + file, bytes);
  }
  EXPECT_EQ(folder.curvesup("check out").exit_code, 0);
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

std::string box_stl(double width, const Vec3& at = Vec3::Zero()) {
  return shapes::stl_text(shapes::box_surface(at, at + Vec3(width, width, 0.5 * width), 5));
}

TEST(BadInput, OtherUnitsThanMillimetres) {
  const Folder folder;
  folder.write("metres.stl", box_stl(0.02));
  folder.write("inches.stl", box_stl(1));
  folder.write("huge.stl", box_stl(26000));
  const auto keep = [](const Vec3& c) { return c.z() > 12000 || (c.x() > 10000 && c.x() < 20000); };
  folder.write("huge.tet", tet_text(shapes::brick_mesh({0, 0, 0}, {30000, 10000, 18000}, {3, 1, 3}, keep)));
  folder.write("c.json", "{}");
  expect_refused(folder, "slice metres.stl c.json", 2, "usage", "model.scale: 25.4 for inches, 1000 for metres");
  expect_refused(folder, "slice huge.stl c.json", 2, "usage", "set model.scale, to 0.01 perhaps");
  expect_refused(folder, "slice huge.tet c.json", 2, "usage", "set model.scale, to 0.01 perhaps");
  const Outcome inspected = folder.curvesup("inspect huge.stl");
  EXPECT_EQ(inspected.exit_code, 3);
  EXPECT_NE(inspected.out.find("model.scale"), std::string::npos) << inspected.out;
  const Outcome inches = folder.curvesup("slice inches.stl c.json -o out --stop-after load");
  EXPECT_EQ(inches.exit_code, 0);
  EXPECT_NE(inches.err.find("model.scale"), std::string::npos) << inches.err;
  EXPECT_EQ(folder.curvesup("slice inches.stl c.json -o out -s model.scale=25.4 --stop-after load").err.find("model.scale"), std::string::npos);
}

TEST(BadInput, PartFarFromThePlatformIsToldWhereToMove) {
  const Folder folder;
  folder.write("far.stl", box_stl(20, Vec3(70000, 0, 0)));
  folder.write("c.json", "{}");
  const Outcome run = folder.curvesup("slice far.stl c.json -o out --stop-after load");
  EXPECT_NE(run.err.find("model.translate_mm to [-70010, -10, 0]"), std::string::npos) << run.err;
  EXPECT_EQ(folder.curvesup("slice far.stl c.json -o out --stop-after load -s 'model.translate_mm=[-70010,-10,0]'").err.find("translate"),
            std::string::npos);
}

// Millions of tets would take TetGen half a minute, which it cannot be told to cut short.
TEST(BadInput, StopWhileTetsAreMadeEndsTheProgramAtOnce) {
  const Folder folder;
  folder.write("m.stl", box_stl(60));
  folder.write("c.json", "{}");
  const auto start = std::chrono::steady_clock::now();
  const Outcome run = folder.curvesup("slice m.stl c.json -o out -s model.max_tet_volume_mm3=0.05", "timeout --preserve-status -s TERM 1");
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(4));
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_EQ(folder.files(".").size(), 2u) << "nothing is left behind";
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
