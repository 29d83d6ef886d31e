#pragma once

#include <cmath>
#include <functional>
#include <numbers>

#include "curvesup/toolpath/toolpaths.h"

// Small synthetic toolpaths for tests.
namespace curvesup::shapes {

inline void add_path(Toolpaths& toolpaths, const std::vector<Vec3>& positions, const std::vector<Vec3>& normals,
                     Index layer, Material material = Material::model, bool closed = false, double height = 0.6,
                     double width = 0.8, double feed = 10.0) {
  Path path;
  path.layer = layer;
  path.group = layer;
  path.material = material;
  path.closed = closed;
  path.first_point = static_cast<Index>(toolpaths.points.size());
  path.point_count = static_cast<Index>(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    PathPoint point;
    point.position = positions[i];
    point.normal = normals[i];
    point.height_mm = height;
    point.width_mm = width;
    point.tip_offset_mm = 0.5 * height;
    point.feed_mm_s = feed;
    point.volume_mm3 = i > 0 ? height * width * (positions[i] - positions[i - 1]).norm() : 0.0;
    toolpaths.points.push_back(point);
  }
  toolpaths.paths.push_back(path);
}

// A closed ring of radius r at height z whose normals lean outwards by `lean` radians.
inline void add_ring(Toolpaths& toolpaths, const Vec3& centre, double radius, double lean, Index layer,
                     int points = 200, Material material = Material::model) {
  std::vector<Vec3> positions, normals;
  for (int i = 0; i <= points; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i % points) / points;
    const Vec3 out(std::cos(angle), std::sin(angle), 0.0);
    positions.push_back(centre + radius * out);
    normals.push_back(std::cos(lean) * Vec3::UnitZ() + std::sin(lean) * out);
  }
  add_path(toolpaths, positions, normals, layer, material, true);
}

// Concentric rings 0.8 mm apart on flat layers: a plate.
inline Toolpaths flat_rings(double radius, int layers) {
  Toolpaths toolpaths;
  for (int k = 0; k < layers; ++k) {
    for (double r = radius; r > 0.5; r -= 0.8) add_ring(toolpaths, Vec3(0, 0, 0.3 + 0.6 * k), r, 0.0, k, 120);
  }
  return toolpaths;
}

// Rings on a spherical cap that leans up to `steepest` radians, from the rim up.
inline Toolpaths cap_rings(double sphere_radius, double steepest, double lift_mm) {
  Toolpaths toolpaths;
  const Vec3 centre(0, 0, lift_mm - sphere_radius * std::cos(steepest));
  for (double lean = steepest; lean * sphere_radius > 1.0; lean -= 1.6 / sphere_radius) {
    add_ring(toolpaths, centre + Vec3(0, 0, sphere_radius * std::cos(lean)), sphere_radius * std::sin(lean), lean, 0,
             240);
  }
  return toolpaths;
}

}  // namespace curvesup::shapes
