#pragma once

#include <vector>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/model/model.h"

namespace curvesup {

// A part of space, or of the boundary, in which the user wants support or wants none. In the placed frame, millimetres.
struct Region {
  enum class Kind { box, sphere, faces, mesh };
  Kind kind = Kind::box;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // box
  Vec3 centre = Vec3::Zero();                    // sphere
  double radius_mm = 0.0;
  std::vector<Index> faces;  // indices into Model::boundary
  TriangleMesh mesh;         // closed surface; what lies inside it

  [[nodiscard]] static Region box(const Vec3& low, const Vec3& high);
  [[nodiscard]] static Region sphere(const Vec3& centre, double radius_mm);
  [[nodiscard]] static Region of_faces(std::vector<Index> faces);
  [[nodiscard]] static Region inside(TriangleMesh mesh);
};

// Per boundary face 1 when its centroid lies in one of the regions or one of them lists it. Throws Error{usage} on a
// face that the model does not have, a box or sphere of no size, or a mesh that is not closed.
[[nodiscard]] std::vector<char> faces_in_regions(const Model& model, const std::vector<Region>& regions);

}  // namespace curvesup
