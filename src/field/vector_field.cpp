#include "field/vector_field.h"

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <numeric>

#include "curvesup/core/error.h"

namespace curvesup {

namespace {

// Gradients of the four hat functions of a tet.
std::array<Vec3, 4> hat_gradients(const TetMesh& mesh, Index tet) {
  const auto& t = mesh.tets[tet];
  const Vec3& origin = mesh.vertices[t[0]];
  const Vec3 a = mesh.vertices[t[1]] - origin, b = mesh.vertices[t[2]] - origin, c = mesh.vertices[t[3]] - origin;
  const double det = a.cross(b).dot(c);
  std::array<Vec3, 4> g;
  g[1] = b.cross(c) / det;
  g[2] = c.cross(a) / det;
  g[3] = a.cross(b) / det;
  g[0] = -(g[1] + g[2] + g[3]);
  return g;
}

// Per vertex the lowest vertex of its connected part.
std::vector<Index> connected_parts(const TetMesh& mesh) {
  std::vector<Index> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& tet : mesh.tets) {
    for (int c = 1; c < 4; ++c) {
      const Index a = find(tet[0]), b = find(tet[c]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  for (Index v = 0; v < static_cast<Index>(parent.size()); ++v) parent[v] = find(v);
  return parent;
}

Vec3 mean_vector(const TetMesh& mesh, const std::vector<Vec3>& tet_vector) {
  Vec3 sum = Vec3::Zero();
  double volume = 0.0;
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    const double v = tet_volume(mesh, t);
    sum += v * tet_vector[t];
    volume += v;
  }
  return sum / volume;
}

}  // namespace

IntegratedField integrate_vector_field(const TetMesh& mesh, const std::vector<Vec3>& tet_vector,
                                       const RunContext& run) {
  // Vertices that are the first of their part are pinned; an unreferenced vertex is a part of its own.
  const auto part = connected_parts(mesh);
  const Vec3 mean = mean_vector(mesh, tet_vector);
  const Index vertices = static_cast<Index>(mesh.vertices.size());
  IntegratedField result;
  result.value.assign(mesh.vertices.size(), 0.0);
  std::vector<Index> unknown(mesh.vertices.size(), kNone);
  Index unknowns = 0;
  for (Index v = 0; v < vertices; ++v) {
    if (part[v] == v) {
      result.value[v] = mean.dot(mesh.vertices[v]);
    } else {
      unknown[v] = unknowns++;
    }
  }

  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(10 * mesh.tets.size());
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns);
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    const auto g = hat_gradients(mesh, t);
    const double volume = tet_volume(mesh, t);
    for (int i = 0; i < 4; ++i) {
      const Index row = unknown[mesh.tets[t][i]];
      if (row == kNone) continue;
      rhs[row] += volume * g[i].dot(tet_vector[t]);
      for (int j = 0; j < 4; ++j) {
        const Index column = unknown[mesh.tets[t][j]];
        const double k = volume * g[i].dot(g[j]);
        if (column == kNone) {
          rhs[row] -= k * result.value[mesh.tets[t][j]];
        } else if (column <= row) {
          entries.emplace_back(row, column, k);
        }
      }
    }
  }
  run.check_stop();
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver(matrix);
  if (solver.info() != Eigen::Success) {
    throw Error(ErrorKind::solver, "field", "the system of equation 1 cannot be factorised",
                "look for needle tets with inspect");
  }
  const Eigen::VectorXd solution = solver.solve(rhs);
  if (!solution.allFinite()) throw Error(ErrorKind::solver, "field", "the solution of equation 1 is not finite");
  const double scale = rhs.norm();
  result.relative_residual =
      (matrix.selfadjointView<Eigen::Lower>() * solution - rhs).norm() / (scale > 0.0 ? scale : 1.0);
  for (Index v = 0; v < vertices; ++v) {
    if (unknown[v] != kNone) result.value[v] = solution[unknown[v]];
  }
  return result;
}

}  // namespace curvesup
