#include "pipeline/artifacts.h"

#include <gtest/gtest.h>

#include "curvesup/io/vtk_file.h"
#include "helpers/temp_folder.h"

namespace curvesup {
namespace {

template <class T>
std::vector<T> values(const std::vector<VtkArray>& arrays, const std::string& name) {
  for (const VtkArray& a : arrays) {
    if (a.name == name) return std::get<std::vector<T>>(a.values);
  }
  ADD_FAILURE() << "no array " << name;
  return {};
}

// Triangles of three sheets, one of them empty, above the platform by 0, 0.2 and 5 mm.
LayerStack three_sheets() {
  LayerStack stack;
  stack.count = 10;
  for (const double z : {0.0, 0.2, 5.0}) {
    for (const Vec3& p : {Vec3(0, 0, z), Vec3(1, 0, z), Vec3(0, 1, z)}) stack.vertices.push_back(p);
  }
  stack.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {6, 8, 7}};
  stack.triangle_tet = {0, 0, 0, 0};
  const auto sheet = [](Index layer, int pass, int passes, Material material, double iso, Index first, Index count) {
    Sheet s;
    s.layer = layer, s.pass = pass, s.passes = passes, s.material = material, s.iso_value = iso;
    s.first_triangle = first, s.triangle_count = count;
    return s;
  };
  stack.sheets = {sheet(-1, 0, 1, Material::support, -0.05, 0, 1), sheet(0, 0, 2, Material::support, 0.025, 1, 0),
                  sheet(0, 1, 2, Material::support, 0.075, 1, 1), sheet(5, 0, 1, Material::model, 0.55, 2, 2)};
  return stack;
}

TEST(Artifacts, EveryTriangleHasTheNumbersOfItsSheet) {
  const TempFolder folder;
  ScalarField field;
  field.gradient = {Vec3(0, 0, 0.25)};  // 0.4 mm layers
  std::string bytes;
  write_layers_vtp(three_sheets(), field, [&](std::string_view piece) { bytes += piece; });
  const VtkPolyData data = read_vtp(folder.write("layers.vtp", bytes));
  ASSERT_EQ(data.points.size(), 9u);
  EXPECT_EQ(data.points[7], Vec3(1, 0, 5));
  EXPECT_EQ(data.triangles, three_sheets().triangles);
  EXPECT_EQ(values<std::int32_t>(data.cell_data, "layer"), (std::vector<std::int32_t>{-1, 0, 5, 5}));
  EXPECT_EQ(values<std::uint8_t>(data.cell_data, "pass"), (std::vector<std::uint8_t>{0, 1, 0, 0}));
  EXPECT_EQ(values<std::uint8_t>(data.cell_data, "material"), (std::vector<std::uint8_t>{1, 1, 0, 0}));
  // Half a bead above the platform; one of two passes; whole layers.
  EXPECT_EQ(values<float>(data.cell_data, "thickness_mm"), (std::vector<float>{0.2f, 0.2f, 0.4f, 0.4f}));
  EXPECT_EQ(values<float>(data.point_data, "G"),
            (std::vector<float>{-0.05f, -0.05f, -0.05f, 0.075f, 0.075f, 0.075f, 0.55f, 0.55f, 0.55f}));
}

TEST(Artifacts, ToolpathsKeepTheirPointsInFloat32) {
  const TempFolder folder;
  Toolpaths toolpaths;
  const double far = 199.99, step = 1.0 / 3.0;
  for (int i = 0; i < 5; ++i) {
    toolpaths.points.push_back({Vec3(far - step * i, -far, step), Vec3(0.6, 0.0, 0.8), 0.4, 0.8, step * i, 0.2, 20.0});
  }
  toolpaths.paths.resize(2);
  toolpaths.paths[0].point_count = 2;
  toolpaths.paths[1].first_point = 2;
  toolpaths.paths[1].point_count = 3;
  toolpaths.paths[1].layer = 7;
  toolpaths.paths[1].material = Material::support;
  toolpaths.paths[1].closed = true;
  std::string bytes;
  write_toolpaths_vtp(toolpaths, [&](std::string_view piece) { bytes += piece; });
  const VtkPolyData data = read_vtp(folder.write("toolpaths.vtp", bytes));
  ASSERT_EQ(data.points.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_LT((data.points[i] - toolpaths.points[i].position).norm(), 2e-5);
  EXPECT_EQ(data.line_points, (std::vector<Index>{0, 1, 2, 3, 4}));
  EXPECT_EQ(data.line_ends, (std::vector<Index>{2, 5}));
  EXPECT_EQ(values<std::int32_t>(data.cell_data, "path"), (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(values<std::int32_t>(data.cell_data, "layer"), (std::vector<std::int32_t>{0, 7}));
  EXPECT_EQ(values<std::uint8_t>(data.cell_data, "material"), (std::vector<std::uint8_t>{0, 1}));
  EXPECT_EQ(values<std::uint8_t>(data.cell_data, "closed"), (std::vector<std::uint8_t>{0, 1}));
  const std::vector<float> volume = values<float>(data.point_data, "volume_mm3"), normal = values<float>(data.point_data, "normal");
  ASSERT_EQ(normal.size(), 15u);
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(volume[i], step * i, 1e-6 * step * i);
  EXPECT_FLOAT_EQ(normal[3], 0.6f);
  EXPECT_FLOAT_EQ(normal[5], 0.8f);
}

}  // namespace
}  // namespace curvesup
