#include "artifacts.h"

#include <algorithm>

#include "curvesup/io/vtk_file.h"

namespace curvesup {

namespace {

template <class T, class Element, class Value>
VtkArray array_of(const char* name, const std::vector<Element>& elements, Value value, int components = 1) {
  std::vector<T> values;
  values.reserve(elements.size() * static_cast<std::size_t>(components));
  for (const Element& element : elements) {
    if constexpr (std::is_same_v<decltype(value(element)), Vec3>) {
      const Vec3 v = value(element);
      values.insert(values.end(), {static_cast<T>(v.x()), static_cast<T>(v.y()), static_cast<T>(v.z())});
    } else {
      values.push_back(static_cast<T>(value(element)));
    }
  }
  return {name, components, std::move(values)};
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

std::string layers_vtp(const LayerStack& stack, const ScalarField& field) {
  VtkPolyData data;
  data.points = stack.vertices;
  data.triangles = stack.triangles;
  const std::size_t count = stack.triangles.size();
  std::vector<std::int32_t> layer(count), pass(count);
  std::vector<std::uint8_t> material(count);
  std::vector<float> thickness(count), value(stack.vertices.size());
  for (const Sheet& sheet : stack.sheets) {
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      layer[t] = sheet.layer;
      pass[t] = sheet.pass;
      material[t] = static_cast<std::uint8_t>(sheet.material);
      thickness[t] = static_cast<float>(printed_height(stack, sheet, field, t));
      for (const Index v : stack.triangles[t]) value[v] = static_cast<float>(sheet.iso_value);
    }
  }
  data.point_data.push_back({"G", 1, std::move(value)});
  data.cell_data.push_back({"layer", 1, std::move(layer)});
  data.cell_data.push_back({"material", 1, std::move(material)});
  data.cell_data.push_back({"thickness_mm", 1, std::move(thickness)});
  data.cell_data.push_back({"pass", 1, std::move(pass)});
  return to_vtp(data);
}

std::string skeleton_vtp(const Skeleton& skeleton) {
  VtkPolyData data;
  for (const SkeletonNode& node : skeleton.nodes) data.points.push_back(node.position);
  for (const SkeletonEdge& edge : skeleton.edges) {
    data.line_points.insert(data.line_points.end(), {edge.upper, edge.lower});
    data.line_ends.push_back(static_cast<Index>(data.line_points.size()));
  }
  data.point_data.push_back(array_of<std::uint8_t>("kind", skeleton.nodes, [](const SkeletonNode& n) { return static_cast<int>(n.kind); }));
  data.cell_data.push_back(array_of<std::int32_t>("branch_count", skeleton.edges, [](const SkeletonEdge& e) { return e.branch_count; }));
  data.cell_data.push_back(array_of<double>("radius_mm", skeleton.edges, [](const SkeletonEdge& e) { return e.radius_mm; }));
  data.cell_data.push_back(array_of<std::int32_t>("layer", skeleton.edges, [](const SkeletonEdge& e) { return e.layer; }));
  return to_vtp(data, VtkPrecision::float64);
}

std::string toolpaths_vtp(const Toolpaths& toolpaths) {
  VtkPolyData data;
  data.points.reserve(toolpaths.points.size());
  for (const PathPoint& point : toolpaths.points) data.points.push_back(point.position);
  data.line_points.resize(toolpaths.points.size());
  for (std::size_t i = 0; i < data.line_points.size(); ++i) data.line_points[i] = static_cast<Index>(i);
  for (const Path& path : toolpaths.paths) data.line_ends.push_back(path.first_point + path.point_count);

  const auto& points = toolpaths.points;
  data.point_data.push_back(array_of<double>("normal", points, [](const PathPoint& p) { return p.normal; }, 3));
  data.point_data.push_back(array_of<double>("height_mm", points, [](const PathPoint& p) { return p.height_mm; }));
  data.point_data.push_back(array_of<double>("width_mm", points, [](const PathPoint& p) { return p.width_mm; }));
  data.point_data.push_back(array_of<double>("volume_mm3", points, [](const PathPoint& p) { return p.volume_mm3; }));
  data.point_data.push_back(array_of<double>("tip_offset_mm", points, [](const PathPoint& p) { return p.tip_offset_mm; }));
  data.point_data.push_back(array_of<double>("feed_mm_s", points, [](const PathPoint& p) { return p.feed_mm_s; }));

  const auto& paths = toolpaths.paths;
  std::vector<std::int32_t> ids(paths.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::int32_t>(i);
  data.cell_data.push_back({"path", 1, std::move(ids)});
  data.cell_data.push_back(array_of<std::int32_t>("layer", paths, [](const Path& p) { return p.layer; }));
  data.cell_data.push_back(array_of<std::uint8_t>("material", paths, [](const Path& p) { return static_cast<int>(p.material); }));
  data.cell_data.push_back(array_of<std::uint8_t>("kind", paths, [](const Path& p) { return static_cast<int>(p.kind); }));
  data.cell_data.push_back(array_of<std::uint8_t>("closed", paths, [](const Path& p) { return p.closed ? 1 : 0; }));
  data.cell_data.push_back(array_of<std::int32_t>("pass", paths, [](const Path& p) { return p.pass; }));
  data.cell_data.push_back(array_of<std::int32_t>("piece", paths, [](const Path& p) { return p.piece; }));
  data.cell_data.push_back(array_of<std::int32_t>("group", paths, [](const Path& p) { return p.group; }));
  return to_vtp(data, VtkPrecision::float64);
}

}  // namespace curvesup
