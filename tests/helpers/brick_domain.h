#pragma once

#include <algorithm>
#include <functional>

#include "curvesup/domain/domain.h"
#include "helpers/shapes.h"

namespace curvesup::shapes {

// The box [low, high] as a domain without any mesher: the bricks for which in_model(centre) holds are the model, all others
// are support.
inline Domain brick_domain(const Vec3& low, const Vec3& high, std::array<int, 3> cells,
                           const std::function<bool(const Vec3&)>& in_model) {
  const TetMesh all = brick_mesh(low, high, cells);
  std::vector<char> is_model(all.tets.size());
  const Vec3 step = (high - low).cwiseQuotient(Vec3(cells[0], cells[1], cells[2]));
  for (std::size_t t = 0; t < all.tets.size(); ++t) {
    Vec3 centre = Vec3::Zero();
    for (const Index v : all.tets[t]) centre += 0.25 * all.vertices[v];
    const Vec3 cell = (centre - low).cwiseQuotient(step).array().floor();
    is_model[t] = in_model(low + step.cwiseProduct(cell + Vec3::Constant(0.5)));
  }
  Domain domain;
  std::vector<Index> id(all.vertices.size(), kNone);
  for (const char region : {1, 0}) {
    for (std::size_t t = 0; t < all.tets.size(); ++t) {
      if (is_model[t] != region) continue;
      auto tet = all.tets[t];
      for (Index& v : tet) {
        if (id[v] == kNone) {
          id[v] = static_cast<Index>(domain.mesh.vertices.size());
          domain.mesh.vertices.push_back(all.vertices[v]);
        }
        v = id[v];
      }
      domain.mesh.tets.push_back(tet);
    }
    if (region == 1) {
      domain.model_vertices = static_cast<Index>(domain.mesh.vertices.size());
      domain.model_tets = static_cast<Index>(domain.mesh.tets.size());
    }
  }
  domain.topology = build_topology(domain.mesh);
  domain.vertex_flags.assign(domain.mesh.vertices.size(), 0);
  for (const BoundaryFace& face : boundary_faces(domain.mesh, domain.topology)) {
    for (const Index v : face.vertices) domain.vertex_flags[v] |= Domain::kOnHull;
  }
  for (Index t = 0; t < domain.model_tets; ++t) {
    for (int f = 0; f < 4; ++f) {
      const Index neighbour = domain.topology.neighbours[t][f];
      if (neighbour != kNone && neighbour < domain.model_tets) continue;
      domain.interface_tet.push_back(neighbour);
      for (const Index v : face_vertices(domain.mesh.tets[t], f)) domain.vertex_flags[v] |= Domain::kOnModel;
    }
  }
  return domain;
}

inline ScalarField sampled_field(const Domain& domain, const std::function<double(const Vec3&)>& value) {
  std::vector<double> at_vertex;
  at_vertex.reserve(domain.mesh.vertices.size());
  for (const Vec3& v : domain.mesh.vertices) at_vertex.push_back(value(v));
  return make_scalar_field(domain.mesh, std::move(at_vertex));
}

// A block that floats 12 mm above the platform, with 4 mm of support domain around it and down to z = -3.
inline Domain floating_block_domain(double cell = 2.0) {
  const auto n = [&](double length) { return static_cast<int>(length / cell + 0.5); };
  return brick_domain(Vec3(-4, -4, -3), Vec3(24, 16, 25), {n(28), n(20), n(28)}, [](const Vec3& c) {
    return c.x() > 0 && c.x() < 20 && c.y() > 0 && c.y() < 12 && c.z() > 11 && c.z() < 21;
  });
}

}  // namespace curvesup::shapes
