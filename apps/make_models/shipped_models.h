#pragma once

#include <functional>
#include <string>
#include <vector>

#include "curvesup/mesh/triangle_mesh.h"

namespace make_models {

// One model of data/: its surface, the potential whose level sets are its layers, and what must come out.
struct ShippedModel {
  std::string name;
  std::function<curvesup::TriangleMesh()> surface;
  double max_tet_volume_mm3 = 2.0;
  std::function<double(const curvesup::Vec3&)> potential;  // grows upward everywhere: d/dz >= 1
  int genus = 0;
};

[[nodiscard]] std::vector<ShippedModel> shipped_models();

}  // namespace make_models
