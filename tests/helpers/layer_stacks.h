#pragma once

#include <functional>

#include "curvesup/layers/layer_stack.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::shapes {

inline double sheet_area(const LayerStack& stack, const Sheet& sheet) {
  double sum = 0.0;
  for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
    const auto& t = stack.triangles[i];
    sum += triangle_area(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
  }
  return sum;
}

// The stack without the triangles for which drop(sheet, centroid) holds.
inline LayerStack without_triangles(const LayerStack& stack, const std::function<bool(const Sheet&, const Vec3&)>& drop) {
  LayerStack kept = stack;
  kept.triangles.clear();
  kept.triangle_tet.clear();
  for (Sheet& sheet : kept.sheets) {
    const Index first = static_cast<Index>(kept.triangles.size());
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& v = stack.triangles[t];
      if (drop(sheet, (stack.vertices[v[0]] + stack.vertices[v[1]] + stack.vertices[v[2]]) / 3.0)) continue;
      kept.triangles.push_back(v);
      kept.triangle_tet.push_back(stack.triangle_tet[t]);
    }
    sheet.first_triangle = first;
    sheet.triangle_count = static_cast<Index>(kept.triangles.size()) - first;
  }
  return kept;
}

}  // namespace curvesup::shapes
