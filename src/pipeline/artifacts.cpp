#include "artifacts.h"

#include <algorithm>
#include <cstring>

#include "curvesup/io/vtk_file.h"

namespace curvesup {

namespace {

// The sheet that a triangle belongs to.
const Sheet& sheet_of(const LayerStack& stack, std::size_t triangle) {
  const auto after = std::upper_bound(stack.sheets.begin(), stack.sheets.end(), static_cast<Index>(triangle),
                                      [](Index t, const Sheet& sheet) { return t < sheet.first_triangle; });
  return *std::prev(after);
}

// value(sheet, triangle) of every triangle.
template <class T, class Value>
VtkColumn by_triangle(const char* name, const LayerStack& stack, Value value) {
  VtkColumn column{name, 1, vtk_column_type<T>(), stack.triangles.size(), {}};
  column.fill = [&stack, value](std::size_t begin, std::size_t end, char* to) {
    const Sheet* sheet = begin < end ? &sheet_of(stack, begin) : nullptr;
    for (std::size_t t = begin; t < end; ++t, to += sizeof(T)) {
      if (t >= static_cast<std::size_t>(sheet->first_triangle + sheet->triangle_count)) sheet = &sheet_of(stack, t);
      const T packed = static_cast<T>(value(*sheet, static_cast<Index>(t)));
      std::memcpy(to, &packed, sizeof packed);
    }
  };
  return column;
}

VtkColumn counted(std::size_t count) {
  return {"", 1, VtkColumn::Type::int32, count, [](std::size_t begin, std::size_t end, char* to) {
            for (std::size_t i = begin; i < end; ++i, to += sizeof(Index)) {
              const Index number = static_cast<Index>(i);
              std::memcpy(to, &number, sizeof number);
            }
          }};
}

VtkColumn corners(const std::vector<std::array<Index, 3>>& triangles) {
  return {"", 3, VtkColumn::Type::int32, triangles.size(), [&triangles](std::size_t begin, std::size_t end, char* to) {
            if (end > begin) std::memcpy(to, triangles[begin].data(), (end - begin) * sizeof triangles[0]);
          }};
}

VtkColumn no_triangles() { return {"", 3, VtkColumn::Type::int32, 0, {}}; }

const auto kItself = [](const auto& element) { return element; };

// G of every vertex: that of a sheet it is on.
std::vector<float> iso_values(const LayerStack& stack) {
  std::vector<float> value(stack.vertices.size());
  for (const Sheet& sheet : stack.sheets) {
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      for (const Index v : stack.triangles[t]) value[v] = static_cast<float>(sheet.iso_value);
    }
  }
  return value;
}

}  // namespace

double printed_height(const LayerStack& stack, const Sheet& sheet, const ScalarField& field, Index triangle) {
  const Vec3& gradient = field.gradient[stack.triangle_tet[triangle]];
  const double slope = gradient.norm();
  const double thickness = 1.0 / (stack.count * sheet.passes * slope);
  const auto& t = stack.triangles[triangle];
  const double z = (stack.vertices[t[0]].z() + stack.vertices[t[1]].z() + stack.vertices[t[2]].z()) / 3.0;
  return std::min(thickness, z + 0.5 * thickness * gradient.z() / slope);
}

std::string domain_vtu(const Domain& domain, const ScalarField& field) {
  VtkGrid grid;
  grid.points = domain.mesh.vertices;
  grid.tets = domain.mesh.tets;
  grid.point_data.push_back({"G", 1, field.value});
  std::vector<std::uint8_t> region(domain.mesh.tets.size());
  for (std::size_t t = 0; t < region.size(); ++t) region[t] = static_cast<std::uint8_t>(domain.region(static_cast<Index>(t)));
  grid.cell_data.push_back({"region", 1, std::move(region)});
  return to_vtu(grid);
}

void write_layers_vtp(const LayerStack& stack, const ScalarField& field, const ByteSink& sink) {
  const std::vector<float> value = iso_values(stack);
  VtkPolySource source;
  source.points = vtk_column<float>("", stack.vertices, kItself);
  source.line_points = source.line_ends = counted(0);
  source.triangles = corners(stack.triangles);
  source.point_data.push_back(vtk_column<float>("G", value, kItself));
  source.cell_data.push_back(by_triangle<std::int32_t>("layer", stack, [](const Sheet& s, Index) { return s.layer; }));
  source.cell_data.push_back(by_triangle<std::uint8_t>("material", stack, [](const Sheet& s, Index) { return static_cast<int>(s.material); }));
  source.cell_data.push_back(by_triangle<float>("thickness_mm", stack, [&](const Sheet& s, Index t) { return printed_height(stack, s, field, t); }));
  source.cell_data.push_back(by_triangle<std::uint8_t>("pass", stack, [](const Sheet& s, Index) { return s.pass; }));
  write_vtp(source, sink);
}

void write_skeleton_vtp(const Skeleton& skeleton, const ByteSink& sink) {
  std::vector<Index> line_points, line_ends;
  for (const SkeletonEdge& edge : skeleton.edges) {
    line_points.insert(line_points.end(), {edge.upper, edge.lower});
    line_ends.push_back(static_cast<Index>(line_points.size()));
  }
  const auto& edges = skeleton.edges;
  VtkPolySource source;
  source.points = vtk_column<double>("", skeleton.nodes, [](const SkeletonNode& n) { return n.position; });
  source.line_points = vtk_column<std::int32_t>("", line_points, kItself);
  source.line_ends = vtk_column<std::int32_t>("", line_ends, kItself);
  source.triangles = no_triangles();
  source.point_data.push_back(vtk_column<std::uint8_t>("kind", skeleton.nodes, [](const SkeletonNode& n) { return static_cast<int>(n.kind); }));
  source.cell_data.push_back(vtk_column<std::int32_t>("branch_count", edges, [](const SkeletonEdge& e) { return e.branch_count; }));
  source.cell_data.push_back(vtk_column<double>("radius_mm", edges, [](const SkeletonEdge& e) { return e.radius_mm; }));
  source.cell_data.push_back(vtk_column<std::int32_t>("layer", edges, [](const SkeletonEdge& e) { return e.layer; }));
  write_vtp(source, sink);
}

void write_toolpaths_vtp(const Toolpaths& toolpaths, const ByteSink& sink) {
  const auto& points = toolpaths.points;
  const auto& paths = toolpaths.paths;
  VtkPolySource source;
  source.points = vtk_column<float>("", points, [](const PathPoint& p) { return p.position; });
  source.line_points = counted(points.size());
  source.line_ends = vtk_column<std::int32_t>("", paths, [](const Path& p) { return p.first_point + p.point_count; });
  source.triangles = no_triangles();
  source.point_data.push_back(vtk_column<float>("normal", points, [](const PathPoint& p) { return p.normal; }));
  source.point_data.push_back(vtk_column<float>("height_mm", points, [](const PathPoint& p) { return p.height_mm; }));
  source.point_data.push_back(vtk_column<float>("width_mm", points, [](const PathPoint& p) { return p.width_mm; }));
  source.point_data.push_back(vtk_column<float>("volume_mm3", points, [](const PathPoint& p) { return p.volume_mm3; }));
  source.point_data.push_back(vtk_column<float>("tip_offset_mm", points, [](const PathPoint& p) { return p.tip_offset_mm; }));
  source.point_data.push_back(vtk_column<float>("feed_mm_s", points, [](const PathPoint& p) { return p.feed_mm_s; }));

  VtkColumn ids = counted(paths.size());
  ids.name = "path";
  source.cell_data.push_back(std::move(ids));
  source.cell_data.push_back(vtk_column<std::int32_t>("layer", paths, [](const Path& p) { return p.layer; }));
  source.cell_data.push_back(vtk_column<std::uint8_t>("material", paths, [](const Path& p) { return static_cast<int>(p.material); }));
  source.cell_data.push_back(vtk_column<std::uint8_t>("kind", paths, [](const Path& p) { return static_cast<int>(p.kind); }));
  source.cell_data.push_back(vtk_column<std::uint8_t>("closed", paths, [](const Path& p) { return p.closed ? 1 : 0; }));
  source.cell_data.push_back(vtk_column<std::int32_t>("pass", paths, [](const Path& p) { return p.pass; }));
  source.cell_data.push_back(vtk_column<std::int32_t>("piece", paths, [](const Path& p) { return p.piece; }));
  source.cell_data.push_back(vtk_column<std::int32_t>("group", paths, [](const Path& p) { return p.group; }));
  write_vtp(source, sink);
}

}  // namespace curvesup
