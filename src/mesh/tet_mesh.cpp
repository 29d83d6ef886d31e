#include "curvesup/mesh/tet_mesh.h"

#include <cstddef>
#include <string>

#include "curvesup/core/error.h"
#include "mesh/face_uses.h"

namespace curvesup {

double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6.0;
}

double tet_volume(const TetMesh& mesh, Index tet) {
  const auto& t = mesh.tets[tet];
  return tet_volume(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], mesh.vertices[t[3]]);
}

double total_volume(const TetMesh& mesh) {
  double sum = 0.0;
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) sum += tet_volume(mesh, t);
  return sum;
}

TetTopology build_topology(const TetMesh& mesh) {
  const std::vector<FaceUse> keys = sorted_face_uses(mesh);
  TetTopology topology;
  topology.neighbours.assign(mesh.tets.size(), {kNone, kNone, kNone, kNone});
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t end = i + 1;
    while (end < keys.size() && keys[end].sorted == keys[i].sorted) ++end;
    if (end - i > 2) {
      throw Error(ErrorKind::input, "tet " + std::to_string(keys[i + 2].tet),
                  "more than two tets share the face of vertices " + std::to_string(keys[i].sorted[0]) + ", " +
                      std::to_string(keys[i].sorted[1]) + ", " + std::to_string(keys[i].sorted[2]),
                  "remove the overlapping tets");
    }
    if (end - i == 2) {
      topology.neighbours[keys[i].tet][keys[i].face] = keys[i + 1].tet;
      topology.neighbours[keys[i + 1].tet][keys[i + 1].face] = keys[i].tet;
    }
    i = end;
  }
  return topology;
}

std::vector<BoundaryFace> boundary_faces(const TetMesh& mesh, const TetTopology& topology) {
  std::vector<BoundaryFace> faces;
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    for (int f = 0; f < 4; ++f) {
      if (topology.neighbours[t][f] == kNone) faces.push_back({t, f, face_vertices(mesh.tets[t], f)});
    }
  }
  return faces;
}

Vec3 tet_gradient(const TetMesh& mesh, Index tet, std::span<const double> vertex_value) {
  const auto& t = mesh.tets[tet];
  const Vec3& origin = mesh.vertices[t[0]];
  const Vec3 a = mesh.vertices[t[1]] - origin, b = mesh.vertices[t[2]] - origin, c = mesh.vertices[t[3]] - origin;
  const double base = vertex_value[t[0]];
  const double det = a.cross(b).dot(c);
  return ((vertex_value[t[1]] - base) * b.cross(c) + (vertex_value[t[2]] - base) * c.cross(a) +
          (vertex_value[t[3]] - base) * a.cross(b)) /
         det;
}

ScalarField make_scalar_field(const TetMesh& mesh, std::vector<double> vertex_value) {
  ScalarField field;
  field.value = std::move(vertex_value);
  field.gradient.resize(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    field.gradient[t] = tet_gradient(mesh, static_cast<Index>(t), field.value);
  }
  return field;
}

Vec3 print_direction(const ScalarField& field, Index tet) {
  const Vec3& g = field.gradient[tet];
  const double length = g.norm();
  return length > 0.0 ? Vec3(g / length) : Vec3(Vec3::UnitZ());
}

}  // namespace curvesup
