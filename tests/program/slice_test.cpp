#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "curvesup/io/sha256.h"
#include "helpers/program.h"
#include "helpers/shapes.h"

// The program as a user runs it, on the shipped models.
namespace curvesup {
namespace {

using nlohmann::ordered_json;
using program::Folder;
using program::Outcome;

std::string slice_of(const std::string& model, const std::string& more = "") {
  const std::string data = CURVESUP_DATA "/" + model;
  return "slice '" + data + "/model.tet' '" + data + "/config.json' -o out --progress none " + more;
}

// report.json without its times.
std::string untimed(const std::string& report) {
  ordered_json json = ordered_json::parse(report);
  json.erase("stages");
  return json.dump();
}

// Every number of `expected` stands in the report: exactly, or as [value, relative tolerance].
void expect_values(const ordered_json& report, const ordered_json& expected, const std::string& path) {
  for (const auto& [key, wanted] : expected.items()) {
    const std::string here = path + "/" + key;
    ASSERT_TRUE(report.contains(key)) << here;
    if (wanted.is_object()) {
      expect_values(report[key], wanted, here);
    } else if (wanted.is_array()) {
      const double value = wanted[0].get<double>();
      EXPECT_NEAR(report[key].get<double>(), value, wanted[1].get<double>() * std::abs(value)) << here;
    } else {
      EXPECT_EQ(report[key].get<double>(), wanted.get<double>()) << here;
    }
  }
}

ordered_json failed_checks(const ordered_json& report) {
  ordered_json names = ordered_json::array();
  for (const auto& check : report["checks"]) {
    if (!check["ok"].get<bool>()) names.push_back(check["name"]);
  }
  return names;
}

TEST(Slice, ASurfaceWithADirectionGoesThroughToTheRobot) {
  const Folder folder;
  // A slab of 16 mm on one leg.
  const Model table = shapes::as_model(shapes::brick_mesh(Vec3(0, 0, 0), Vec3(16, 16, 12), {4, 4, 3}, [](const Vec3& c) {
    return c.z() > 8.0 || (c - Vec3(8, 8, c.z())).cwiseAbs().maxCoeff() < 4.0;
  }));
  folder.write("table.stl", shapes::stl_text(boundary_surface(table)));
  folder.write("c.json", R"({"layers": {"thickness_mm": 0.8}})");
  const Outcome run = folder.curvesup("slice table.stl c.json --progress none");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto files = folder.files("table_out");
  const ordered_json report = ordered_json::parse(files.at("report.json"));
  EXPECT_EQ(report["input"]["model"], "table.stl");
  EXPECT_NEAR(report["model"]["volume_mm3"].get<double>(), 16 * 16 * 4 + 8 * 8 * 8, 1e-6);
  EXPECT_NEAR(report["overhang"]["area_mm2"].get<double>(), 16 * 16 - 8 * 8, 1e-6);
  EXPECT_EQ(report["layers"]["model"], 15);  // 12 mm in layers of 0.8
  EXPECT_EQ(report["support"]["floating_pieces"], 0);
  EXPECT_TRUE(files.contains("robot/part_0001.script"));
  EXPECT_TRUE(files.contains("duet/print.g"));
}

// A flat shape and its triangles, as a surface that rises from z = 0, turned about the vertical.
struct PlainPart {
  const char* name;
  std::vector<std::array<double, 2>> outline;  // counter-clockwise
  std::vector<std::array<Index, 3>> triangles;
  double height;
};

TriangleMesh prism(const PlainPart& part, double turn) {
  TriangleMesh mesh;
  const Index n = static_cast<Index>(part.outline.size());
  for (const double z : {0.0, part.height}) {
    for (const auto& [x, y] : part.outline) mesh.vertices.push_back(Eigen::AngleAxisd(turn, Vec3::UnitZ()) * Vec3(x, y, z));
  }
  for (const auto& [a, b, c] : part.triangles) {
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({n + a, n + b, n + c});
  }
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  return mesh;
}

// As few triangles as they can have, as they come out of a drawing program: every check holds.
TEST(Slice, PlainPartsArePrintedHoweverTheyLie) {
  const std::vector<PlainPart> parts = {
      {"box", {{0, 0}, {20, 0}, {20, 20}, {0, 20}}, {{0, 1, 2}, {0, 2, 3}}, 6},
      {"angle", {{0, 0}, {30, 0}, {30, 6}, {6, 6}, {6, 30}, {0, 30}}, {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}}, 6},
      {"wall", {{0, 0}, {40, 0}, {40, 1.5}, {0, 1.5}}, {{0, 1, 3}, {1, 2, 3}}, 6},
      {"triangle", {{0, 0}, {25, 0}, {0, 15}}, {{0, 1, 2}}, 6}};
  const Folder folder;
  folder.write("c.json", R"({"layers": {"thickness_mm": 0.6}, "model": {"drop_to_platform": true},
                             "field": {"source": "direction", "direction": [0.2, 0.1, 1]}})");
  for (const PlainPart& part : parts) {
    for (const double turn : {0.0, 0.3}) {
      folder.write("part.stl", shapes::stl_text(prism(part, turn)));
      const Outcome run = folder.curvesup("slice part.stl c.json --progress none");
      EXPECT_EQ(run.exit_code, 0) << part.name << " turned by " << turn << ": " << run.out << run.err;
    }
  }
}

class ShippedModel : public ::testing::TestWithParam<const char*> {};

// The page explains every number to somebody who has not read the paper.
void expect_sentences(const ordered_json& report) {
  const std::string script = program::read_all(CURVESUP_DATA "/../src/preview/page/report.js");
  const std::size_t sections = script.find("const kSections"), keys = script.find("const kKeys"), end = script.find("};", keys);
  ASSERT_LT(sections, keys);
  ASSERT_LT(keys, end);
  const std::string of_checks = script.substr(0, sections), of_keys = script.substr(keys, end - keys);
  const auto has = [&](const std::string& key) {
    return of_keys.find(" " + key + ": '") != std::string::npos || of_keys.find("'" + key + "': '") != std::string::npos;
  };
  for (const auto& check : report["checks"]) {
    EXPECT_NE(of_checks.find("'" + check["name"].get<std::string>() + "': '"), std::string::npos) << "no sentence for " << check["name"];
  }
  for (const auto& [name, section] : report.items()) {
    if (!section.is_object() || name == "program") continue;
    EXPECT_NE(script.find(" " + name + ": ['"), std::string::npos) << "no sentence for section " << name;
    for (const auto& [key, value] : section.items()) {
      EXPECT_TRUE(has(name + "." + key) || has(key)) << "no sentence for " << name << "." << key;
    }
  }
}

TEST_P(ShippedModel, GivesTheExpectedCountsAndChecks) {
  const Folder folder;
  const Outcome run = folder.curvesup(slice_of(GetParam()));
  const auto files = folder.files("out");
  ASSERT_TRUE(files.contains("report.json")) << run.err << run.out;
  const ordered_json report = ordered_json::parse(files.at("report.json"));
  EXPECT_GT(report["checks"].size(), 40u);
  expect_sentences(report);

  ordered_json expected = ordered_json::parse(program::read_all(CURVESUP_DATA "/" + std::string(GetParam()) + "/expected.json"));
  EXPECT_EQ(failed_checks(report), expected["failed_checks"]) << run.out;
  EXPECT_EQ(report["ok"], expected["failed_checks"].empty());
  EXPECT_EQ(run.exit_code, expected["exit_code"]) << run.err;
  expected.erase("failed_checks");
  expected.erase("exit_code");
  ASSERT_GE(expected.size(), 5u);
  expect_values(report, expected, "");

  const ordered_json manifest = ordered_json::parse(files.at("manifest.json"));
  for (const auto& entry : manifest["files"]) {
    const std::string path = entry["path"];
    ASSERT_TRUE(files.contains(path)) << path;
    EXPECT_EQ(sha256_hex(files.at(path)), entry["sha256"]) << path;
  }
  EXPECT_EQ(manifest["files"].size() + 2, files.size()) << "every file but manifest and report is listed";
}

INSTANTIATE_TEST_SUITE_P(All, ShippedModel, ::testing::Values("block", "dome", "arches", "frame"),
                         [](const auto& instance) { return std::string(instance.param); });

TEST(Slice, SameBytesForOneAndTwoThreadsAndAnyLocale) {
  const Folder one, two;
  EXPECT_EQ(one.curvesup(slice_of("block", "--threads 1")).exit_code,
            two.curvesup(slice_of("block", "--threads 2"), "LC_ALL=de_DE.UTF-8").exit_code);
  auto a = one.files("out"), b = two.files("out");
  EXPECT_EQ(untimed(a["report.json"]), untimed(b["report.json"]));
  a.erase("report.json");
  b.erase("report.json");
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, bytes] : a) EXPECT_TRUE(bytes == b[name]) << name << " differs";
}

TEST(Slice, StopsAfterAStageAndReplacesAnOlderOutput) {
  const Folder folder;
  const Outcome first = folder.curvesup(slice_of("block", "--stop-after layers"));
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto files = folder.files("out");
  EXPECT_TRUE(files.contains("layers.vtp"));
  EXPECT_FALSE(files.contains("toolpaths.vtp"));
  const Outcome second = folder.curvesup(slice_of("block", "--stop-after field"));
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_FALSE(folder.files("out").contains("layers.vtp")) << "the older output is gone as a whole";
}

TEST(Slice, AModelWithoutOverhangIsSlicedWithoutSupport) {
  const Folder folder;
  folder.write("m.tet", "8 vertices\n5 tets\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n0 0 9\n9 0 9\n9 9 9\n0 9 9\n"
                        "4 0 1 3 4\n4 1 2 3 6\n4 1 4 5 6\n4 3 4 6 7\n4 1 3 4 6\n");
  folder.write("c.json", R"({"layers": {"thickness_mm": 0.9}})");
  const Outcome run = folder.curvesup("slice m.tet c.json");
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  EXPECT_NE(run.err.find("no overhang"), std::string::npos) << run.err;
  const ordered_json report = ordered_json::parse(folder.files("m_out").at("report.json"));
  EXPECT_EQ(report["layers"]["model"], 10);
  EXPECT_EQ(report["layers"]["support_printed"], 0);
}

TEST(Slice, AnInterruptLeavesNothingBehind) {
  const Folder folder;
  const std::string command = "cd '" + folder.path().string() + "' && (timeout --signal=TERM 0.15 '" CURVESUP_BINARY_DIR "/curvesup' " +
                              slice_of("dome") + " > /dev/null 2> err.txt; echo $? > code.txt)";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_NE(program::read_all(folder.path() / "err.txt").find("[interrupted]"), std::string::npos);
  EXPECT_EQ(folder.files(".").size(), 2u) << "only err.txt and code.txt";
}

TEST(CommandLine, HelpVersionAndConfigCommands) {
  const Folder folder;
  EXPECT_EQ(folder.curvesup("--help").exit_code, 0);
  EXPECT_NE(folder.curvesup("--version").out.find("curvesup 0."), std::string::npos);
  EXPECT_NE(folder.curvesup("slice --help").out.find("Example"), std::string::npos);
  EXPECT_NE(folder.curvesup("config explain support.leaf_radius_mm").out.find("default 0.8"), std::string::npos);
  const Outcome init = folder.curvesup("config init");
  folder.write("c.json", init.out);
  EXPECT_EQ(folder.curvesup("config check c.json").exit_code, 0);
  EXPECT_TRUE(ordered_json::parse(folder.curvesup("config schema").out).contains("properties"));
  EXPECT_EQ(folder.curvesup("config explain support.leaf_radios_mm").exit_code, 2);
}

}  // namespace
}  // namespace curvesup
