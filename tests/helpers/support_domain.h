#pragma once

#include <algorithm>
#include <functional>

#include "curvesup/domain/domain.h"
#include "curvesup/overhang/overhang.h"
#include "helpers/shapes.h"

// Whole domains made of bricks: model and support region conform by construction, no mesher needed.
namespace curvesup::shapes {

struct SupportDomain {
  Model model;
  Domain domain;
  ScalarField field;
  Overhang overhang;
};

// Faces with n . d_p + sin(alpha) <= 0 by their definition, those at z = 0 left out.
inline Overhang plain_overhang(const Model& model, const ScalarField& field, Angle alpha = Angle::degrees(45)) {
  Overhang overhang;
  std::vector<Vec3> mean(model.mesh.vertices.size(), Vec3::Zero());
  for (std::size_t f = 0; f < model.boundary.size(); ++f) {
    const auto& v = model.boundary[f].vertices;
    const Vec3 &a = model.mesh.vertices[v[0]], &b = model.mesh.vertices[v[1]], &c = model.mesh.vertices[v[2]];
    const Vec3 twice_area = (b - a).cross(c - a), d = print_direction(field, model.boundary[f].tet);
    if (twice_area.normalized().dot(d) + alpha.sin() > 0.0) continue;
    if (a.z() < 1e-9 && b.z() < 1e-9 && c.z() < 1e-9) continue;
    overhang.faces.push_back(static_cast<Index>(f));
    overhang.area_mm2 += 0.5 * twice_area.norm();
    for (const Index i : v) mean[i] -= twice_area.norm() * d;
  }
  for (std::size_t v = 0; v < mean.size(); ++v) {
    if (mean[v].norm() == 0.0) continue;
    overhang.vertices.push_back(static_cast<Index>(v));
    overhang.vertex_direction.push_back(mean[v].normalized());
  }
  return overhang;
}

// The box [low, high] in bricks; those for which is_model(centre) holds are the model, the rest is support domain.
inline SupportDomain support_domain(const Vec3& low, const Vec3& high, std::array<int, 3> cells,
                                const std::function<bool(const Vec3&)>& is_model,
                                const std::function<double(const Vec3&)>& value) {
  const TetMesh all = brick_mesh(low, high, cells);
  const Vec3 step = (high - low).cwiseQuotient(Vec3(cells[0], cells[1], cells[2]));
  const auto in_model = [&](const std::array<Index, 4>& t) {
    const Vec3 at = (all.vertices[t[0]] + all.vertices[t[1]] + all.vertices[t[2]] + all.vertices[t[3]]) / 4.0;
    const Vec3 brick = (at - low).cwiseQuotient(step).array().floor();
    return is_model(low + step.cwiseProduct(brick + Vec3::Constant(0.5)));
  };
  SupportDomain result;
  TetMesh& mesh = result.domain.mesh;
  std::vector<Index> id(all.vertices.size(), kNone);
  TetMesh model_mesh;
  for (const bool model : {true, false}) {
    for (const auto& t : all.tets) {
      if (in_model(t) != model) continue;
      std::array<Index, 4> tet{};
      for (int i = 0; i < 4; ++i) {
        if (id[t[i]] == kNone) {
          id[t[i]] = static_cast<Index>(mesh.vertices.size());
          mesh.vertices.push_back(all.vertices[t[i]]);
        }
        tet[i] = id[t[i]];
      }
      mesh.tets.push_back(tet);
    }
    if (model) model_mesh = mesh;
  }
  result.model = as_model(model_mesh);
  result.domain.model_vertices = static_cast<Index>(model_mesh.vertices.size());
  result.domain.model_tets = static_cast<Index>(model_mesh.tets.size());
  result.domain.topology = build_topology(mesh);
  for (const BoundaryFace& f : result.model.boundary) {
    result.domain.interface_tet.push_back(result.domain.topology.neighbours[f.tet][f.face]);
  }
  std::vector<double> values;
  for (const Vec3& v : mesh.vertices) values.push_back(value(v));
  result.field = make_scalar_field(mesh, values);
  result.overhang = plain_overhang(result.model, result.field);
  return result;
}

}  // namespace curvesup::shapes
