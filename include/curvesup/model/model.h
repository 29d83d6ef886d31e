#pragma once

#include <string>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

// How the model's file coordinates are brought into the frame of the program, in this order: scale, up axis, rotate about
// x, then y, then z, move, drop.
struct PlaceOptions {
  std::string up_axis = "z";  // "z", or "y": (x, y, z) -> (x, -z, y), or "x": (x, y, z) -> (-z, y, x)
  double scale = 1.0;
  Vec3 rotate_deg = Vec3::Zero();
  Vec3 translate_mm = Vec3::Zero();
  bool drop_to_platform = false;
};

// A checked, placed model: valid tets (see TetMesh), every face in one or two tets, boundary a closed 2-manifold.
struct Model {
  std::string name;
  TetMesh mesh;
  TetTopology topology;
  std::vector<BoundaryFace> boundary;
  Mat3 rotation = Mat3::Identity();  // file frame -> placed frame, without scale and move; turns vector fields
};

// The boundary over all vertices of the model.
[[nodiscard]] inline TriangleMesh boundary_surface(const Model& model) {
  TriangleMesh surface;
  surface.vertices = model.mesh.vertices;
  surface.triangles.reserve(model.boundary.size());
  for (const BoundaryFace& face : model.boundary) surface.triangles.push_back(face.vertices);
  return surface;
}

struct ModelReport {
  Index vertices = 0, tets = 0, boundary_faces = 0;
  double volume_mm3 = 0.0;
  int genus = 0;       // sum over the boundary's components
  int components = 0;  // face-connected volume components
  int cavities = 0;    // closed boundary components inside the volume
  Index flipped_tets = 0;
  Index duplicate_vertices = 0, unreferenced_vertices = 0;
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
};

struct ModelResult {
  Model model;
  ModelReport report;
};

}  // namespace curvesup
