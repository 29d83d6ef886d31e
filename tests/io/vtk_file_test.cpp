#include "curvesup/io/vtk_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "curvesup/io/text_file.h"
#include "helpers/temp_folder.h"
#include "io/expect_error.h"

namespace curvesup {
namespace {

VtkPolyData small_poly_data() {
  VtkPolyData data;
  data.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.0 / 3.0}};
  data.line_points = {0, 1, 2, 0, 3};
  data.line_ends = {3, 5};
  data.triangles = {{0, 1, 2}, {1, 2, 3}};
  data.point_data = {{"normal", 3, std::vector<float>(12, 0.5f)}, {"G", 1, std::vector<double>{0.1, 0.2, 0.3, 0.4}}};
  data.cell_data = {{"layer", 1, std::vector<std::int32_t>{-1, 2, 3, 4}},
                    {"a<b & \"c\"", 1, std::vector<std::uint8_t>{0, 1, 0, 255}}};
  return data;
}

void expect_equal(const std::vector<VtkArray>& a, const std::vector<VtkArray>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_EQ(a[i].components, b[i].components);
    EXPECT_EQ(a[i].values, b[i].values);
  }
}

// Walks the file by the rules of the format alone: the DataArray tag with this name, its offset, the size word, the
// bytes.
std::string raw_block(const std::string& file, const std::string& name) {
  const std::size_t tag = file.find("Name=\"" + name + "\"");
  const std::size_t offset = std::stoull(file.substr(file.find("offset=\"", tag) + 8));
  const std::size_t data = file.find('_', file.find("<AppendedData encoding=\"raw\">")) + 1;
  std::uint64_t size = 0;
  std::memcpy(&size, file.data() + data + offset, 8);
  return file.substr(data + offset + 8, size);
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

TEST(VtkFile, PolyDataFollowsTheFormat) {
  const std::string file = to_vtp(small_poly_data());
  EXPECT_EQ(file.find("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
                      "header_type=\"UInt64\">"),
            0u);
  EXPECT_NE(file.find("<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"2\" NumberOfStrips=\"0\" "
                      "NumberOfPolys=\"2\">"),
            std::string::npos);
  EXPECT_NE(file.find("<DataArray type=\"Float32\" Name=\"Points\" NumberOfComponents=\"3\" format=\"appended\""),
            std::string::npos);
  EXPECT_EQ(raw_block(file, "Points"), bytes_of<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.0f / 3.0f}));
  EXPECT_EQ(raw_block(file, "G"), bytes_of<double>({0.1, 0.2, 0.3, 0.4}));
  EXPECT_EQ(raw_block(file, "layer"), bytes_of<std::int32_t>({-1, 2, 3, 4}));
  const std::string polys = file.substr(file.find("<Polys>"));
  EXPECT_EQ(raw_block(file, "connectivity"), bytes_of<std::int32_t>({0, 1, 2, 0, 3}));
  EXPECT_EQ(raw_block(file, "offsets"), bytes_of<std::int32_t>({3, 5}));
  EXPECT_EQ(raw_block(polys, "connectivity"), bytes_of<std::int32_t>({0, 1, 2, 1, 2, 3}));
  EXPECT_EQ(raw_block(polys, "offsets"), bytes_of<std::int32_t>({3, 6}));
}

TEST(VtkFile, PolyDataReadsBack) {
  const TempFolder folder;
  const VtkPolyData data = small_poly_data();
  write_file(folder.path() / "a.vtp", to_vtp(data, VtkPrecision::float64));
  const VtkPolyData again = read_vtp(folder.path() / "a.vtp");
  EXPECT_EQ(again.points, data.points);
  EXPECT_EQ(again.line_points, data.line_points);
  EXPECT_EQ(again.line_ends, data.line_ends);
  EXPECT_EQ(again.triangles, data.triangles);
  expect_equal(again.point_data, data.point_data);
  expect_equal(again.cell_data, data.cell_data);

  write_file(folder.path() / "empty.vtp", to_vtp({}));
  EXPECT_TRUE(read_vtp(folder.path() / "empty.vtp").points.empty());
}

TEST(VtkFile, GridReadsBack) {
  const TempFolder folder;
  VtkGrid grid;
  grid.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.0 / 3.0}, {0, 0, -1}};
  grid.tets = {{0, 1, 2, 3}, {0, 2, 1, 4}};
  grid.point_data = {{"G", 1, std::vector<double>{0, 1, 2, 3, 4}}};
  grid.cell_data = {{"region", 1, std::vector<std::uint8_t>{0, 1}}};
  const std::string file = to_vtu(grid);
  EXPECT_EQ(raw_block(file, "types"), std::string(2, '\x0a'));
  EXPECT_EQ(raw_block(file, "offsets"), bytes_of<std::int32_t>({4, 8}));
  write_file(folder.path() / "a.vtu", file);
  const VtkGrid again = read_vtu(folder.path() / "a.vtu");
  EXPECT_EQ(again.points, grid.points);
  EXPECT_EQ(again.tets, grid.tets);
  expect_equal(again.point_data, grid.point_data);
  expect_equal(again.cell_data, grid.cell_data);
  expect_error(ErrorKind::input, {"a.vtu", "PolyData"}, [&] { (void)read_vtp(folder.path() / "a.vtu"); });
}

// More points than one block holds, so that blocks meet inside every array.
TEST(VtkFile, ColumnsMakeTheSameFileAsArrays) {
  constexpr std::size_t kPoints = 100'001;
  VtkPolyData data;
  std::vector<float> height;
  for (std::size_t i = 0; i < kPoints; ++i) {
    data.points.emplace_back(0.1 * static_cast<double>(i), -1.0 / static_cast<double>(i + 1), 7.0);
    data.line_points.push_back(static_cast<Index>(i));
    height.push_back(static_cast<float>(0.3 * static_cast<double>(i)));
  }
  data.line_ends = {40'000, 100'001};
  data.triangles.assign(70'000, {5, 100'000, 0});
  data.point_data = {{"height", 1, height}};

  VtkPolySource source;
  source.points = vtk_column<float>("", data.points, [](const Vec3& p) { return p; });
  source.line_points = vtk_column<std::int32_t>("", data.line_points, [](Index i) { return i; });
  source.line_ends = vtk_column<std::int32_t>("", data.line_ends, [](Index i) { return i; });
  source.triangles = {"", 3, VtkColumn::Type::int32, data.triangles.size(), [&](std::size_t begin, std::size_t end, char* to) {
                        std::memcpy(to, data.triangles[begin].data(), (end - begin) * sizeof data.triangles[0]);
                      }};
  source.point_data.push_back(vtk_column<float>("height", height, [](float h) { return h; }));
  std::string bytes;
  std::size_t largest = 0;
  const auto collect = [&](std::string_view piece) {
    bytes += piece;
    largest = std::max(largest, piece.size());
  };
  write_vtp(source, collect);
  EXPECT_TRUE(bytes == to_vtp(data));
  EXPECT_LE(largest, std::size_t{1} << 20);

  data.line_points.back() = kPoints;
  expect_error(ErrorKind::internal, {"index 100001"}, [&] { write_vtp(source, collect); });
  source.point_data[0].count -= 1;
  expect_error(ErrorKind::internal, {"height"}, [&] { write_vtp(source, collect); });
}

TEST(VtkFile, WrongDataIsNotWritten) {
  VtkPolyData wrong = small_poly_data();
  wrong.cell_data[0].values = std::vector<std::int32_t>{1, 2};
  expect_error(ErrorKind::internal, {"layer"}, [&] { (void)to_vtp(wrong); });
  wrong = small_poly_data();
  wrong.triangles[1][2] = 4;
  expect_error(ErrorKind::internal, {"index 4"}, [&] { (void)to_vtp(wrong); });
  wrong = small_poly_data();
  wrong.line_ends.back() = 4;
  expect_error(ErrorKind::internal, {"polyline"}, [&] { (void)to_vtp(wrong); });
}

TEST(VtkFile, EveryTruncationIsAnError) {
  const TempFolder folder;
  const std::string whole = to_vtp(small_poly_data());
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    const auto path = folder.write("t.vtp", whole.substr(0, length));
    expect_error(ErrorKind::input, {"t.vtp"}, [&] { (void)read_vtp(path); });
  }
}

TEST(VtkFile, DamagedFilesNeverCrashTheReader) {
  const TempFolder folder;
  const std::string whole = to_vtp(small_poly_data());
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 5) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x15);
    try {
      (void)read_vtp(folder.write("d.vtp", damaged));
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::input);
      ++refused;
    }
  }
  EXPECT_GT(refused, whole.size() / 15);
}

}  // namespace
}  // namespace curvesup
