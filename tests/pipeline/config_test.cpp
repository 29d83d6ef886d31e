#include "curvesup/pipeline/config.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "curvesup/core/error.h"
#include "pipeline/options.h"

namespace curvesup {
namespace {

namespace fs = std::filesystem;

class ConfigFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("config_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::create_directories(folder_ / "profiles");
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  fs::path folder_;
};

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage);
    return error.what();
  }
  return "no error";
}

TEST(Config, EveryDefaultIsValidAndDocumented) {
  for (const ConfigKey& key : config_keys()) {
    EXPECT_FALSE(key.doc.empty()) << key.path;
    EXPECT_NE(key.path.find('.'), std::string::npos) << key.path;
    EXPECT_TRUE(!key.default_value.is_null() || key.nullable) << key.path;
  }
  EXPECT_NO_THROW(default_config());
}

TEST(Config, TheDefaultConfigReadsBackToItself) {
  ConfigSource source;
  source.values = default_config();
  EXPECT_EQ(resolve_config(source), default_config());
}

TEST_F(ConfigFiles, ExtendsMergesKeyByKeyAndInsideObjects) {
  write("base.json", R"({"support": {"leaf_radius_mm": 1.0, "merge_radius_mm": 4.0}, "layers": {"count": 10}})");
  write("profiles/cell.json", R"({"name": "cell"})");
  const fs::path file = write("config.json", R"({"extends": "base.json", "support": {"leaf_radius_mm": 1.5}, "machine": {"extends": "cell.json"}})");
  const ConfigSource source = read_config(file, {{folder_ / "profiles"}});
  EXPECT_EQ(source.values["support"]["leaf_radius_mm"], 1.5);
  EXPECT_EQ(source.values["support"]["merge_radius_mm"], 4.0);
  EXPECT_EQ(source.values["layers"]["count"], 10);
  EXPECT_EQ(source.values["machine"]["name"], "cell");
  EXPECT_FALSE(source.values["machine"].contains("extends"));
}

TEST_F(ConfigFiles, RelativePathsBelongToTheFileThatSetThem) {
  fs::create_directories(folder_ / "sub");
  write("sub/base.json", R"({"field": {"source": "scalar_file", "path": "field.txt"}})");
  const ConfigSource source = read_config(write("config.json", R"({"extends": "sub/base.json"})"));
  EXPECT_EQ(config_file_path(source, "field.path", "field.txt"), folder_ / "sub" / "field.txt");
}

TEST_F(ConfigFiles, AnUnknownKeyNamesTheNearest) {
  const ConfigSource source = read_config(write("config.json", R"({"support": {"leaf_radios_mm": 1}})"));
  const std::string message = message_of([&] { (void)resolve_config(source); });
  EXPECT_NE(message.find("support.leaf_radios_mm"), std::string::npos) << message;
  EXPECT_NE(message.find("support.leaf_radius_mm"), std::string::npos) << message;
}

TEST_F(ConfigFiles, WrongTypeAndRangeNameKeyValueAndLimit) {
  for (const auto& [text, value, limit] : {std::tuple{R"({"layers": {"count": 0}})", "0", "from 1"},
                                           std::tuple{R"({"layers": {"count": 1.5}})", "1.5", "a whole number"},
                                           std::tuple{R"({"support": {"method": "forest"}})", "forest", "envelope"},
                                           std::tuple{R"({"model": {"rotate_deg": [1, 2]}})", "[1,2]", "3 numbers"}}) {
    const ConfigSource source = read_config(write("config.json", text));
    const std::string message = message_of([&] { (void)resolve_config(source); });
    EXPECT_NE(message.find(value), std::string::npos) << message;
    EXPECT_NE(message.find(limit), std::string::npos) << message;
  }
}

TEST_F(ConfigFiles, BadJsonNamesTheLine) {
  const fs::path file = write("config.json", "{\n  \"layers\": {\n    \"count\": 5,,\n  }\n}\n");
  EXPECT_NE(message_of([&] { (void)read_config(file); }).find("config.json:3"), std::string::npos);
}

TEST_F(ConfigFiles, ACircleOfExtendsIsRefused) {
  write("a.json", R"({"extends": "b.json"})");
  write("b.json", R"({"extends": "a.json"})");
  EXPECT_NE(message_of([&] { (void)read_config(folder_ / "a.json"); }).find("extends itself"), std::string::npos);
  write("c.json", R"({"extends": "nowhere.json"})");
  EXPECT_NE(message_of([&] { (void)read_config(folder_ / "c.json"); }).find("nowhere.json"), std::string::npos);
}

TEST_F(ConfigFiles, ContradictionsNameBothKeys) {
  for (const auto& [text, first, second] :
       {std::tuple{R"({"layers": {"count": 5, "thickness_mm": 1}})", "layers.count", "layers.thickness_mm"},
        std::tuple{R"({"support": {"leaf_radius_mm": 0.3}})", "support.leaf_radius_mm", "toolpath.bead_width_mm"},
        std::tuple{R"({"toolpath": {"support_line_spacing_mm": 2.4}})", "support_line_spacing_mm", "support_fill"},
        std::tuple{R"({"toolpath": {"support_fill": "contour+zigzag", "support_line_spacing_mm": 0.5}})", "support_line_spacing_mm", "bead_width_mm"},
        std::tuple{R"({"toolpath": {"bead_width_mm": 0.5, "max_bead_mm": 1.2}})", "toolpath.max_bead_mm", "toolpath.bead_width_mm"},
        std::tuple{R"({"toolpath": {"bead_width_mm": 0.5, "max_bead_mm": 0.4}})", "toolpath.max_bead_mm", "toolpath.bead_width_mm"},
        std::tuple{R"({"toolpath": {"min_bead_mm": 0.9}})", "toolpath.min_bead_mm", "toolpath.bead_width_mm"},
        std::tuple{R"({"support": {"foot_radius_mm": 4, "foot_layers": 0}})", "support.foot_radius_mm", "support.foot_layers"},
        std::tuple{R"({"support": {"method": "none", "enforce": [{"sphere": [0, 0, 0, 1]}]}})", "support.enforce", "support.method"},
        std::tuple{R"({"field": {"source": "scalar_file"}})", "field.source", "field.path"}}) {
    const ConfigSource source = read_config(write("config.json", text));
    const std::string message = message_of([&] { (void)resolve_config(source); });
    EXPECT_NE(message.find(first), std::string::npos) << message;
    EXPECT_NE(message.find(second), std::string::npos) << message;
  }
}

TEST_F(ConfigFiles, BeadsAreAsNarrowAndWideAsTheBeadWidthAsks) {
  for (const double width : {0.4, 0.8, 1.2}) {
    const std::string text = R"({"toolpath": {"bead_width_mm": )" + std::to_string(width) + "}}";
    const ToolpathOptions options = toolpath_options(resolve_config(read_config(write("config.json", text))));
    EXPECT_NEAR(options.min_bead_mm, 0.25 * width, 1e-12);
    EXPECT_NEAR(options.max_bead_mm, 1.5 * width, 1e-12);
  }
  const ToolpathOptions set = toolpath_options(resolve_config(read_config(write("config.json", R"({"toolpath": {"min_bead_mm": 0.3, "max_bead_mm": 0.9}})"))));
  EXPECT_EQ(set.min_bead_mm, 0.3);
  EXPECT_EQ(set.max_bead_mm, 0.9);
}

TEST(Config, OverridesTakeJsonOrPlainText) {
  ConfigSource source;
  apply_override(source, "layers.count=12");
  apply_override(source, "support.method=none");
  apply_override(source, "model.rotate_deg=[1,2,3]");
  const Json resolved = resolve_config(source);
  EXPECT_EQ(config_value(resolved, "layers.count"), 12);
  EXPECT_TRUE(config_value(resolved, "layers.thickness_mm").is_null());
  EXPECT_EQ(config_value(resolved, "support.method"), "none");
  EXPECT_NE(message_of([&] { apply_override(source, "layers.cuont=1"); }).find("layers.count"), std::string::npos);
  EXPECT_NE(message_of([&] { apply_override(source, "layers"); }).find("key.path=value"), std::string::npos);
}

TEST(Config, SchemaHasEveryKeyWithDefaultAndSentence) {
  const Json schema = config_schema();
  for (const ConfigKey& key : config_keys()) {
    const Json* at = &schema;
    std::string rest = key.path;
    for (;;) {
      const auto dot = rest.find('.');
      ASSERT_TRUE(at->contains("properties")) << key.path;
      ASSERT_TRUE((*at)["properties"].contains(rest.substr(0, dot))) << key.path;
      at = &(*at)["properties"][rest.substr(0, dot)];
      if (dot == std::string::npos) break;
      rest = rest.substr(dot + 1);
    }
    EXPECT_EQ((*at)["default"], key.default_value) << key.path;
    EXPECT_EQ((*at)["description"], key.doc) << key.path;
  }
}

}  // namespace
}  // namespace curvesup
