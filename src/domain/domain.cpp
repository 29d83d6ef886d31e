#include "curvesup/domain/domain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "mesh/tet_budget.h"
#include "mesh/tetgen_wrapper.h"

namespace curvesup {
namespace {

constexpr const char* kStage = "domain";

// Face-connected volume components, numbered in order of their first tet.
std::vector<Index> tet_components(const TetTopology& topology, Index& count) {
  std::vector<Index> component(topology.neighbours.size(), kNone);
  std::vector<Index> stack;
  count = 0;
  for (std::size_t seed = 0; seed < component.size(); ++seed) {
    if (component[seed] != kNone) continue;
    component[seed] = count;
    stack.assign(1, static_cast<Index>(seed));
    while (!stack.empty()) {
      const Index tet = stack.back();
      stack.pop_back();
      for (const Index next : topology.neighbours[tet]) {
        if (next == kNone || component[next] != kNone) continue;
        component[next] = count;
        stack.push_back(next);
      }
    }
    ++count;
  }
  return component;
}

// A point well inside each component: the centroid of its largest tet, so no inside test is needed.
std::vector<Vec3> hole_seeds(const Model& model) {
  Index count = 0;
  const std::vector<Index> component = tet_components(model.topology, count);
  std::vector<double> largest(count, 0.0);
  std::vector<Vec3> seed(count, Vec3::Zero());
  for (Index t = 0; t < static_cast<Index>(model.mesh.tets.size()); ++t) {
    const double volume = tet_volume(model.mesh, t);
    if (volume <= largest[component[t]]) continue;
    largest[component[t]] = volume;
    const auto& v = model.mesh.tets[t];
    const auto& p = model.mesh.vertices;
    seed[component[t]] = 0.25 * (p[v[0]] + p[v[1]] + p[v[2]] + p[v[3]]);
  }
  return seed;
}

// Model boundary, then hull. `source` maps the complex's first vertices to the model's.
PiecewiseComplex boundary_complex(const Model& model, const TriangleMesh& hull, std::vector<Index>& source) {
  std::vector<Index> id(model.mesh.vertices.size(), kNone);
  for (const BoundaryFace& face : model.boundary) {
    for (const Index v : face.vertices) id[v] = 0;
  }
  PiecewiseComplex complex;
  for (std::size_t v = 0; v < id.size(); ++v) {
    if (id[v] == kNone) continue;
    id[v] = static_cast<Index>(source.size());
    source.push_back(static_cast<Index>(v));
    complex.vertices.push_back(model.mesh.vertices[v]);
  }
  for (const BoundaryFace& face : model.boundary) {
    complex.facets.push_back({id[face.vertices[0]], id[face.vertices[1]], id[face.vertices[2]]});
  }
  const Index offset = static_cast<Index>(source.size());
  complex.vertices.insert(complex.vertices.end(), hull.vertices.begin(), hull.vertices.end());
  for (const auto& t : hull.triangles) complex.facets.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  complex.holes = hole_seeds(model);
  return complex;
}

// The model's tets and then the support's, over the model's vertices and then the support's own.
void join(const Model& model, const TetMesh& support, const std::vector<Index>& source, Domain& domain) {
  const Index shared = static_cast<Index>(source.size());
  const Index first_new = static_cast<Index>(model.mesh.vertices.size());
  domain.model_vertices = first_new;
  domain.model_tets = static_cast<Index>(model.mesh.tets.size());
  domain.mesh = model.mesh;
  domain.mesh.vertices.insert(domain.mesh.vertices.end(), support.vertices.begin() + shared, support.vertices.end());
  domain.mesh.tets.reserve(domain.mesh.tets.size() + support.tets.size());
  for (std::array<Index, 4> tet : support.tets) {
    for (Index& v : tet) v = v < shared ? source[v] : first_new + v - shared;
    domain.mesh.tets.push_back(tet);
  }
}

void flag_vertices(const Model& model, Domain& domain) {
  domain.vertex_flags.assign(domain.mesh.vertices.size(), 0);
  for (const BoundaryFace& face : model.boundary) {
    for (const Index v : face.vertices) domain.vertex_flags[v] |= Domain::kOnModel;
  }
  for (const BoundaryFace& face : boundary_faces(domain.mesh, domain.topology)) {
    for (const Index v : face.vertices) domain.vertex_flags[v] |= Domain::kOnHull;
  }
}

// Six times the volume inside a closed, outward oriented surface, summed around a point near by.
double inside_volume(const TriangleMesh& surface) {
  if (surface.vertices.empty()) return 0.0;
  const Vec3 origin = surface.vertices.front();
  double sum = 0.0;
  for (const auto& t : surface.triangles) {
    const Vec3 a = surface.vertices[t[0]] - origin, b = surface.vertices[t[1]] - origin, c = surface.vertices[t[2]] - origin;
    sum += a.cross(b).dot(c);
  }
  return sum / 6.0;
}

double smallest_dihedral_deg(const TetMesh& mesh, Index first, Index last) {
  double largest_cosine = -1.0;
  for (Index t = first; t < last; ++t) {
    std::array<Vec3, 4> normal;
    for (int f = 0; f < 4; ++f) {
      const auto v = face_vertices(mesh.tets[t], f);
      normal[f] = area_normal(mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]).normalized();
    }
    for (const auto& [f, g] : kTetEdge) largest_cosine = std::max(largest_cosine, -normal[f].dot(normal[g]));
  }
  return std::acos(std::clamp(largest_cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

// Interface faces that lie in exactly one support tet; fills Domain::interface_tet.
Index match_interface(const Model& model, Domain& domain, std::string& first_missing) {
  Index matched = 0;
  domain.interface_tet.assign(model.boundary.size(), kNone);
  for (std::size_t i = 0; i < model.boundary.size(); ++i) {
    const Index other = domain.topology.neighbours[model.boundary[i].tet][model.boundary[i].face];
    if (other != kNone && other >= domain.model_tets) {
      domain.interface_tet[i] = other;
      ++matched;
    } else if (first_missing.empty()) {
      first_missing = format("first face without one: %zu", i);
    }
  }
  return matched;
}

void verify(const Model& model, const TriangleMesh& hull, const std::string& first_missing, Index matched,
            const Domain& domain, DomainReport& report) {
  const TetMesh& mesh = domain.mesh;
  const Index tets = static_cast<Index>(mesh.tets.size());
  report.vertices = static_cast<Index>(mesh.vertices.size());
  report.tets = tets;
  report.support_tets = tets - domain.model_tets;
  report.interface_faces = matched;
  report.min_dihedral_deg = smallest_dihedral_deg(mesh, domain.model_tets, tets);
  Index inverted = 0;
  for (Index t = domain.model_tets; t < tets; ++t) inverted += tet_volume(mesh, t) <= 0.0;
  const double inside = inside_volume(hull);
  report.volume_rel_error = std::abs(total_volume(mesh) - inside) / inside;
  Index outer = 0;
  for (Index t = 0; t < tets; ++t) {
    for (const Index n : domain.topology.neighbours[t]) outer += n == kNone;
  }
  report.checks.push_back(check_equal("domain.interface_faces_conform", matched, static_cast<double>(model.boundary.size()),
                                      "faces of the model's boundary in exactly one support tet; " + first_missing));
  report.checks.push_back(check_equal("domain.hull_faces_kept", outer, static_cast<double>(hull.triangles.size()),
                                      "outer faces of the domain against the hull's triangles"));
  report.checks.push_back(check_at_most("domain.volume_rel_error", report.volume_rel_error, 1e-12,
                                        "volume of model and support tets against the inside of the hull"));
  report.checks.push_back(check_equal("domain.inverted_tets", inverted, 0.0, "support tets without positive volume"));
}

void refuse_too_many_tets(const Model& model, const TriangleMesh& hull, const DomainOptions& options) {
  const double volume = inside_volume(hull) - total_volume(model.mesh);
  if (expected_tets(volume, options.max_tet_volume_mm3) <= kMostTets) return;
  throw Error(ErrorKind::usage, "config keys model.scale and domain.max_tet_volume_mm3",
              format("the space around the model takes about %.2g tets of at most %g mm3", expected_tets(volume, options.max_tet_volume_mm3),
                     options.max_tet_volume_mm3),
              format("if the file is not in millimetres set model.scale; else max_tet_volume_mm3 to %.2g or more",
                     1.05 * expected_tets(volume, kMostTets)));
}

}  // namespace

DomainResult mesh_domain(const Model& model, const TriangleMesh& hull, const DomainOptions& options, const RunContext& run) {
  run.check_stop();
  refuse_too_many_tets(model, hull, options);
  std::vector<Index> source;
  const PiecewiseComplex complex = boundary_complex(model, hull, source);
  const TetMesh support = tetrahedralize(
      complex,
      {.max_tet_volume_mm3 = options.max_tet_volume_mm3, .radius_edge_ratio = options.radius_edge_ratio, .where = kStage},
      run);
  run.check_stop();

  DomainResult result;
  Domain& domain = result.domain;
  join(model, support, source, domain);
  try {
    domain.topology = build_topology(domain.mesh);
  } catch (const Error& error) {
    throw Error(ErrorKind::geometry, kStage, "model and support tets overlap: " + error.problem(),
                "repair the mesh, or enlarge the hull's margin");
  }
  flag_vertices(model, domain);
  std::string first_missing;
  const Index matched = match_interface(model, domain, first_missing);
  verify(model, hull, first_missing, matched, domain, result.report);
  return result;
}

}  // namespace curvesup
