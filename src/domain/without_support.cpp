#include "curvesup/domain/domain.h"

namespace curvesup {

DomainResult domain_without_support(const Model& model) {
  DomainResult result;
  Domain& domain = result.domain;
  domain.mesh = model.mesh;
  domain.topology = model.topology;
  domain.model_vertices = static_cast<Index>(model.mesh.vertices.size());
  domain.model_tets = static_cast<Index>(model.mesh.tets.size());
  domain.vertex_flags.assign(model.mesh.vertices.size(), 0);
  for (const BoundaryFace& face : model.boundary) {
    for (const Index v : face.vertices) domain.vertex_flags[v] = Domain::kOnModel | Domain::kOnHull;
  }
  result.report.vertices = domain.model_vertices;
  result.report.tets = domain.model_tets;
  return result;
}

}  // namespace curvesup
