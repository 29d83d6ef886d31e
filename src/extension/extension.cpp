#include "curvesup/extension/extension.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "extension/least_squares.h"

namespace curvesup {
namespace {

constexpr double kFloorCosine = 0.7;  // a hull face that looks down more than this is floor, every other one is side
constexpr double kFloorThickness = 1.25;  // mm; about what volume per area was in tets of 20 mm3
constexpr std::size_t kGrain = 4096;

// Gradients of a tet's four hat functions: grad G = sum of value · hat.
std::array<Vec3, 4> hat_gradients(const TetMesh& mesh, Index tet) {
  const auto& v = mesh.tets[tet];
  const auto& p = mesh.vertices;
  std::array<Vec3, 4> hat;
  const double six_volumes = 6.0 * tet_volume(mesh, tet);
  for (int f = 0; f < 4; ++f) {
    const auto face = face_vertices(v, f);
    hat[f] = area_normal(p[face[0]], p[face[1]], p[face[2]]) / -six_volumes;
  }
  return hat;
}

// Adds value · G(vertex) to a row: to its unknowns where the vertex is free, to its target where G is given.
class RowBuilder {
 public:
  RowBuilder(const std::vector<Index>& unknown, const std::vector<double>& given) : unknown_(unknown), given_(given) {}

  void add(LeastSquaresRow& row, Index vertex, double value) const {
    const Index i = unknown_[vertex];
    if (i == kNone) {
      row.target -= value * given_[vertex];
      return;
    }
    for (int c = 0; c < row.size; ++c) {
      if (row.unknown[c] == i) {
        row.coefficient[c] += value;
        return;
      }
    }
    row.add(i, value);
  }

  void add_gradient(LeastSquaresRow& row, const TetMesh& mesh, Index tet, const Vec3& along) const {
    const auto hat = hat_gradients(mesh, tet);
    for (int c = 0; c < 4; ++c) add(row, mesh.tets[tet][c], hat[c].dot(along));
  }

 private:
  const std::vector<Index>& unknown_;
  const std::vector<double>& given_;
};

constexpr double kFlat = 1e-5;  // of a tet's longest edge: lower ones have no gradient to speak of

// Marks the support tets without height. They lie where more than three vertices of a flat face of the model are in one plane but for
// rounding, as they are when it stands at any other angle than it was drawn.
std::vector<char> flat_tets(const Domain& domain) {
  const TetMesh& mesh = domain.mesh;
  std::vector<char> flat(mesh.tets.size(), 0);
  for (Index t = domain.model_tets; t < static_cast<Index>(flat.size()); ++t) {
    const auto& v = mesh.tets[t];
    double longest = 0.0, broadest = 0.0;
    for (const auto& [a, b] : kTetEdge) longest = std::max(longest, (mesh.vertices[v[a]] - mesh.vertices[v[b]]).norm());
    for (int f = 0; f < 4; ++f) {
      const auto c = face_vertices(v, f);
      broadest = std::max(broadest, area_normal(mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]).norm());
    }
    flat[t] = 6.0 * tet_volume(mesh, t) <= kFlat * longest * broadest;
  }
  return flat;
}

// Gives flat tets the gradient of a neighbour across one of their largest faces, as near as there is one.
void fill_flat_tets(const Domain& domain, std::vector<char> flat, ScalarField& field) {
  const TetMesh& mesh = domain.mesh;
  for (bool any = true; any;) {
    any = false;
    for (Index t = domain.model_tets; t < static_cast<Index>(flat.size()); ++t) {
      if (!flat[t]) continue;
      double largest = 0.0;
      for (int f = 0; f < 4; ++f) {
        const Index other = domain.topology.neighbours[t][f];
        if (other == kNone || flat[other]) continue;
        const auto c = face_vertices(mesh.tets[t], f);
        const double area = area_normal(mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]).norm();
        if (area <= largest) continue;
        largest = area;
        field.gradient[t] = field.gradient[other];
      }
      if (largest > 0.0) flat[t] = 0, any = true;
    }
  }
}

// A support tet's face with its unit outward normal and area.
struct Face {
  Index tet = kNone;
  int face = 0;
  Vec3 normal = Vec3::Zero();
  double area = 0.0;
};

Face make_face(const TetMesh& mesh, Index tet, int f) {
  const auto v = face_vertices(mesh.tets[tet], f);
  const Vec3 n = area_normal(mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]);
  const double length = n.norm();
  return {tet, f, n / length, 0.5 * length};
}

struct SupportFaces {
  std::vector<Face> inner;      // between two support tets, once, seen from the lower id
  std::vector<Face> interface;  // to a model tet
  std::vector<Face> floor, side;
};

// Those of flat tets are left out.
SupportFaces collect_faces(const Domain& domain, const std::vector<char>& flat) {
  SupportFaces faces;
  for (Index t = domain.model_tets; t < static_cast<Index>(domain.mesh.tets.size()); ++t) {
    if (flat[t]) continue;
    for (int f = 0; f < 4; ++f) {
      const Index other = domain.topology.neighbours[t][f];
      if (other != kNone && other >= domain.model_tets && (other < t || flat[other])) continue;
      const Face face = make_face(domain.mesh, t, f);
      if (other == kNone) {
        (face.normal.z() < -kFloorCosine ? faces.floor : faces.side).push_back(face);
      } else {
        (other < domain.model_tets ? faces.interface : faces.inner).push_back(face);
      }
    }
  }
  return faces;
}

// Volume-weighted quantiles of |grad G| over the tets [first, last) that `keep` accepts.
std::vector<double> gradient_quantiles(const TetMesh& mesh, const ScalarField& field, Index first, Index last, bool above_platform,
                                       const std::vector<double>& quantiles) {
  std::vector<std::pair<double, double>> length_and_volume;
  double total = 0.0;
  for (Index t = first; t < last; ++t) {
    const auto& v = mesh.tets[t];
    const double centre = 0.25 * (mesh.vertices[v[0]].z() + mesh.vertices[v[1]].z() + mesh.vertices[v[2]].z() + mesh.vertices[v[3]].z());
    if (above_platform && centre < 0.0) continue;
    const double volume = tet_volume(mesh, t);
    length_and_volume.emplace_back(field.gradient[t].norm(), volume);
    total += volume;
  }
  std::sort(length_and_volume.begin(), length_and_volume.end());
  std::vector<double> result(quantiles.size(), 0.0);
  double sum = 0.0;
  std::size_t next = 0;
  for (const auto& [length, volume] : length_and_volume) {
    sum += volume;
    for (; next < quantiles.size() && sum >= quantiles[next] * total * (1.0 - 1e-12); ++next) result[next] = length;
  }
  return result;
}

// Rows in a fixed order: inner faces, interface faces, floor (three a tet), side. The last block's weights change.
struct System {
  std::vector<LeastSquaresRow> rows;
  std::size_t first_side = 0;
};

System assemble(const Domain& domain, const ScalarField& model_field, const SupportFaces& faces,
                const std::vector<Index>& unknown, const std::vector<double>& given, double median_gradient,
                const ExtensionOptions& options, const RunContext& run) {
  const TetMesh& mesh = domain.mesh;
  const RowBuilder builder(unknown, given);
  const std::size_t inner = faces.inner.size(), interface = faces.interface.size(), floor = faces.floor.size();
  System system;
  system.first_side = inner + interface + 3 * floor;
  system.rows.resize(system.first_side + faces.side.size());
  // Jump of the normal derivative; w = A²/(V1 + V2).
  parallel_for(inner, kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const Face& face = faces.inner[i];
      const Index other = domain.topology.neighbours[face.tet][face.face];
      LeastSquaresRow& row = system.rows[i];
      builder.add_gradient(row, mesh, face.tet, face.normal);
      builder.add_gradient(row, mesh, other, -face.normal);
      row.weight = face.area * face.area / (tet_volume(mesh, face.tet) + tet_volume(mesh, other));
    }
  });
  for (std::size_t i = 0; i < interface; ++i) {
    const Face& face = faces.interface[i];
    const Index other = domain.topology.neighbours[face.tet][face.face];
    LeastSquaresRow& row = system.rows[inner + i];
    builder.add_gradient(row, mesh, face.tet, face.normal);
    row.target += model_field.gradient[other].dot(face.normal);
    row.weight = face.area * face.area / (tet_volume(mesh, face.tet) + tet_volume(mesh, other));
  }
  for (std::size_t i = 0; i < floor; ++i) {
    const Face& face = faces.floor[i];
    for (int c = 0; c < 3; ++c) {
      LeastSquaresRow& row = system.rows[inner + interface + 3 * i + c];
      builder.add_gradient(row, mesh, face.tet, Vec3::Unit(c));
      if (c == 2) row.target += median_gradient;
      row.weight = options.floor_weight * kFloorThickness * face.area;
    }
  }
  for (std::size_t i = 0; i < faces.side.size(); ++i) {
    builder.add_gradient(system.rows[system.first_side + i], mesh, faces.side[i].tet, faces.side[i].normal);
  }
  return system;
}

// Side faces that -grad G leaves get the outflow weight, the others none. Returns whether any weight changed.
bool weigh_outflow(const TetMesh& mesh, const SupportFaces& faces, const std::vector<double>& value, double weight,
                    System& system) {
  bool changed = false;
  for (std::size_t i = 0; i < faces.side.size(); ++i) {
    const Face& face = faces.side[i];
    const bool leaves = tet_gradient(mesh, face.tet, value).dot(face.normal) < 0.0;
    const double wanted = leaves ? weight * face.area * face.area / tet_volume(mesh, face.tet) : 0.0;
    double& current = system.rows[system.first_side + i].weight;
    changed = changed || current != wanted;
    current = wanted;
  }
  return changed;
}

void count_extrema(const Domain& domain, const std::vector<double>& value, ExtensionReport& report) {
  const std::size_t count = domain.mesh.vertices.size();
  std::vector<std::uint8_t> seen(count, 0);  // bit 0 a lower neighbour, bit 1 a higher one, bit 2 used
  for (Index t = domain.model_tets; t < static_cast<Index>(domain.mesh.tets.size()); ++t) {
    for (const auto& [a, b] : kTetEdge) {
      const Index i = domain.mesh.tets[t][a], j = domain.mesh.tets[t][b];
      seen[i] |= value[j] < value[i] ? 1 : value[j] > value[i] ? 2 : 0;
      seen[j] |= value[i] < value[j] ? 1 : value[i] > value[j] ? 2 : 0;
    }
  }
  for (std::size_t v = domain.model_vertices; v < count; ++v) {
    if (seen[v] == 3) continue;
    ++((domain.vertex_flags[v] & Domain::kOnHull) ? report.hull_extrema : report.false_extrema);
  }
}

}  // namespace

ExtensionResult extend_field(const Domain& domain, const ScalarField& model_field, int layer_count,
                             const ExtensionOptions& options, const RunContext& run) {
  run.check_stop();
  const TetMesh& mesh = domain.mesh;
  const Index vertices = static_cast<Index>(mesh.vertices.size());
  std::vector<double> value = model_field.value;
  value.resize(vertices, 0.0);
  std::vector<Index> unknown(vertices, kNone);
  for (Index v = domain.model_vertices; v < vertices; ++v) unknown[v] = v - domain.model_vertices;
  const double median = gradient_quantiles(mesh, model_field, 0, domain.model_tets, false, {0.5})[0];

  ExtensionResult result;
  ExtensionReport& report = result.report;
  report.unknowns = vertices - domain.model_vertices;
  const std::vector<char> flat = flat_tets(domain);
  const SupportFaces faces = collect_faces(domain, flat);
  System system = assemble(domain, model_field, faces, unknown, value, median, options, run);
  LeastSquaresSolver solver(report.unknowns, system.rows, run);
  for (int round = 0;; ++round) {
    run.check_stop();
    const std::vector<double> solution = solver.solve(system.rows, run);
    std::copy(solution.begin(), solution.end(), value.begin() + domain.model_vertices);
    if (round == options.outflow_rounds || options.outflow_weight == 0.0) break;
    run.progress(static_cast<double>(round + 1) / (options.outflow_rounds + 1));
    if (!weigh_outflow(mesh, faces, value, options.outflow_weight, system)) break;
  }
  report.residual = solver.residual();
  result.field = make_scalar_field(mesh, std::move(value));
  fill_flat_tets(domain, flat, result.field);
  count_extrema(domain, result.field.value, report);
  const auto lengths = gradient_quantiles(mesh, result.field, domain.model_tets, static_cast<Index>(mesh.tets.size()), true,
                                          {0.01, 0.5, 0.99});
  const auto thickness = [&](double length) { return 1.0 / (layer_count * std::max(length, 1e-300)); };
  report.thickness_p1_mm = thickness(lengths[2]);
  report.thickness_p50_mm = thickness(lengths[1]);
  report.thickness_p99_mm = thickness(lengths[0]);
  report.checks.push_back(check_equal("extension.false_extrema", report.false_extrema, 0.0,
                                      "free vertices off the hull without a lower or a higher neighbour"));
  report.checks.push_back(check_at_most("extension.residual", report.residual, 1e-6, "relative residual of the last solve"));
  return result;
}

}  // namespace curvesup
