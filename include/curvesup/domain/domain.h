#pragma once

#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/hull/hull.h"

namespace curvesup {

struct DomainOptions {
  // Where the model is far; near it the tets are as small as its faces. Tets of 20 and of 60 mm3 give fields that differ by
  // 0.2 layers (rms) on an arch bridge of 150 layers, and by 0.2 % in most thicknesses.
  double max_tet_volume_mm3 = 40.0;
  double radius_edge_ratio = 1.414;
};

// T^c: the model's own tets, then the support tets between model and hull; conforming, one mesh.
// Model vertices come first, in input order; model tets come first, in input order.
struct Domain {
  TetMesh mesh;
  TetTopology topology;
  Index model_vertices = 0;
  Index model_tets = 0;
  // Per vertex: bit 0 on the model's boundary, bit 1 on the hull (outer boundary of the domain).
  std::vector<std::uint8_t> vertex_flags;
  // Model::boundary[i] is also a face of support tet interface_tet[i].
  std::vector<Index> interface_tet;

  static constexpr std::uint8_t kOnModel = 1, kOnHull = 2;
  [[nodiscard]] Material region(Index tet) const { return tet < model_tets ? Material::model : Material::support; }
};

struct DomainReport {
  Index vertices = 0, tets = 0, support_tets = 0, interface_faces = 0;
  double volume_rel_error = 0.0;  // |model + support - inside of hull| / inside of hull
  double min_dihedral_deg = 0.0;
  std::vector<Check> checks;
};

struct DomainResult {
  Domain domain;
  DomainReport report;
};

// Throws Error{geometry} with TetGen's reason; a failure inside TetGen never ends the process. Throws Error{usage} when
// millions of tets would fill the space, and Error{interrupted} without waiting for TetGen.
[[nodiscard]] DomainResult mesh_domain(const Model& model, const TriangleMesh& hull, const DomainOptions& options = {},
                                       const RunContext& run = {});

// The model's own tets alone, for a model that gets no support: no support tets, interface_tet empty.
[[nodiscard]] DomainResult domain_without_support(const Model& model);

}  // namespace curvesup
