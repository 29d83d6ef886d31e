#include "curvesup/preview/plots.h"

#include <gtest/gtest.h>
#include <png.h>

#include "helpers/brick_domain.h"
#include "helpers/toolpath_shapes.h"
#include "preview/chart.h"

namespace curvesup {
namespace {

struct Picture {
  unsigned width = 0, height = 0;
  std::vector<unsigned char> rgb;
  // Pixels within 12 of the colour in each channel.
  [[nodiscard]] std::size_t count(const ChartColour& c) const {
    const double wanted[] = {255 * c.r, 255 * c.g, 255 * c.b};
    std::size_t found = 0;
    for (std::size_t i = 0; i < rgb.size(); i += 3) {
      bool same = true;
      for (int k = 0; k < 3; ++k) same = same && std::abs(rgb[i + k] - wanted[k]) < 12;
      found += same;
    }
    return found;
  }
};

Picture read(const std::string& png) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  Picture picture;
  EXPECT_TRUE(png_image_begin_read_from_memory(&image, png.data(), png.size()));
  image.format = PNG_FORMAT_RGB;
  picture.width = image.width;
  picture.height = image.height;
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr));
  return picture;
}

// Layers of a block of unit gradient (0, 0, 1/10): every layer 10 / N thick.
struct Layered {
  Domain domain = shapes::floating_block_domain();
  ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return p.z() / 10.0; });
  LayerStack stack;

  Layered() {
    stack.count = 20;  // 0.5 mm
    for (int k = 0; k < 4; ++k) {
      const double z = (k + 0.5) * 0.5;
      const auto base = static_cast<Index>(stack.vertices.size());
      for (const auto& [x, y] : {std::pair{0.0, 0.0}, {10.0, 0.0}, {0.0, 10.0}}) stack.vertices.emplace_back(x, y, z);
      Sheet sheet;
      sheet.layer = k;
      sheet.material = k % 2 ? Material::support : Material::model;
      sheet.first_triangle = static_cast<Index>(stack.triangles.size());
      sheet.triangle_count = 1;
      stack.triangles.push_back({base, base + 1, base + 2});
      stack.triangle_tet.push_back(0);
      stack.sheets.push_back(sheet);
    }
  }
};

TEST(RoundTicks, AreRoundInsideAndAboutAsManyAsWanted) {
  EXPECT_EQ(round_ticks(0.0, 10.0, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(-0.3, 0.31, 4), (std::vector<double>{-0.2, 0.0, 0.2}));
  for (const double high : {1e-6, 0.37, 3.0, 777.0, 4.2e7}) {
    const auto ticks = round_ticks(0.0, high, 6);
    EXPECT_GE(ticks.size(), 3u) << high;
    EXPECT_LE(ticks.size(), 8u) << high;
    EXPECT_LE(ticks.back(), high * (1 + 1e-9));
  }
}

TEST(Chart, BarsCoverTheirShareOfTheFrame) {
  const ChartColour red{1, 0, 0}, blue{0, 0, 1};
  Chart chart{"t", "x", {{"y", {{"", red, ChartSeries::Form::bars, {0}, {1}, {}, 1.0}, {"", blue, ChartSeries::Form::bars, {1}, {3}, {}, 1.0}}}}};
  const Picture picture = read(draw_chart(chart));
  EXPECT_EQ(picture.width, 900u);
  EXPECT_NEAR(static_cast<double>(picture.count(blue)) / static_cast<double>(picture.count(red)), 3.0, 0.05);
}

TEST(Chart, AnAxisThatEndsCutsOffWhatIsHigher) {
  const ChartColour red{1, 0, 0}, blue{0, 0, 1};
  Chart chart{"t", "x", {{"y", {{"", red, ChartSeries::Form::bars, {0}, {1}, {}, 1.0}, {"", blue, ChartSeries::Form::bars, {1}, {50}, {}, 1.0}}}}};
  chart.panels[0].y_most = 2.0;
  const Picture picture = read(draw_chart(chart));
  EXPECT_NEAR(static_cast<double>(picture.count(blue)) / static_cast<double>(picture.count(red)), 2.0 * 1.05, 0.05);
}

TEST(Chart, StandsNothingAndOneValue) {
  EXPECT_GT(read(draw_chart({"empty", "x", {{"y", {}}}})).width, 0u);
  EXPECT_GT(read(draw_chart({"one", "x", {{"y", {{"s", {0, 0, 0}, ChartSeries::Form::line, {2}, {7}}}}}})).width, 0u);
}

TEST(Plots, OneForEachThingThatRan) {
  const Layered layered;
  const Toolpaths toolpaths = shapes::flat_rings(10.0, 3);
  Motion motion;
  Waypoint start, end;
  start.point = 0;
  end.point = toolpaths.paths[0].point_count - 1;
  end.duration_s = 30.0;
  motion.waypoints.push_back(start);
  motion.waypoints.push_back(end);
  motion.paths.resize(1);
  motion.paths[0].waypoint_count = 2;
  EXPECT_TRUE(make_plots({}).empty());
  EXPECT_EQ(make_plots({.field = &layered.field, .layers = &layered.stack}).size(), 2u);
  EXPECT_EQ(make_plots({.toolpaths = &toolpaths}).size(), 2u);
  const auto plots = make_plots({.field = &layered.field, .layers = &layered.stack, .toolpaths = &toolpaths, .motion = &motion});
  ASSERT_EQ(plots.size(), 5u);
  for (const Plot& plot : plots) {
    EXPECT_GT(read(plot.png).height, 200u) << plot.name;
    EXPECT_FALSE(plot.caption.empty());
  }
}

TEST(Plots, ShowBothMaterialsAndTheSameBytesTwice) {
  const Layered layered;
  const PlotInput input{.field = &layered.field, .layers = &layered.stack};
  const auto plots = make_plots(input);
  const Picture thickness = read(plots[0].png);
  // The same area of both, in the same bar.
  const double part = static_cast<double>(thickness.count(kModelColour)), support = static_cast<double>(thickness.count(kSupportColour));
  EXPECT_GT(part, 500.0);
  EXPECT_NEAR(support / part, 1.0, 0.1);
  EXPECT_EQ(plots[0].png, make_plots(input)[0].png);
}

}  // namespace
}  // namespace curvesup
