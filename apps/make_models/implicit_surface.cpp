#include "implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "curvesup/core/error.h"
#include "curvesup/mesh/tet_mesh.h"

namespace make_models {

using curvesup::Error;
using curvesup::ErrorKind;
using curvesup::Index;
using curvesup::kNone;
using curvesup::TriangleMesh;
using curvesup::Vec3;

namespace {

using Edge = std::array<Index, 2>;  // inner node, outer node

// Corners and centres of a grid of cubes, and the tetrahedra between neighbouring centres.
class Lattice {
 public:
  Lattice(const Implicit& f, const Vec3& low, const Vec3& high, double cube) : low_(low), cube_(cube) {
    for (int a = 0; a < 3; ++a) n_[a] = static_cast<int>(std::ceil((high[a] - low[a]) / cube)) + 1;
    const std::size_t corners = static_cast<std::size_t>(n_[0] + 1) * (n_[1] + 1) * (n_[2] + 1);
    first_centre_ = static_cast<Index>(corners);
    points_.resize(corners + static_cast<std::size_t>(n_[0]) * n_[1] * n_[2]);
    for (int k = 0; k <= n_[2]; ++k) {
      for (int j = 0; j <= n_[1]; ++j) {
        for (int i = 0; i <= n_[0]; ++i) {
          points_[corner({i, j, k})] = low_ + cube_ * Vec3(i, j, k);
          if (i < n_[0] && j < n_[1] && k < n_[2])
            points_[centre({i, j, k})] = low_ + cube_ * Vec3(i + 0.5, j + 0.5, k + 0.5);
        }
      }
    }
    values_.reserve(points_.size());
    for (const Vec3& p : points_) values_.push_back(f(p));
  }

  [[nodiscard]] const Vec3& point(Index node) const { return points_[node]; }
  [[nodiscard]] double value(Index node) const { return values_[node]; }
  [[nodiscard]] bool inside(Index node) const { return values_[node] < 0.0; }

  // visit(tet) for every positively oriented tet of the lattice.
  template <class Visit>
  void for_each_tet(const Visit& visit) const {
    for (int k = 0; k < n_[2]; ++k) {
      for (int j = 0; j < n_[1]; ++j) {
        for (int i = 0; i < n_[0]; ++i) {
          for (int axis = 0; axis < 3; ++axis) {
            std::array<int, 3> here = {i, j, k}, next = here;
            if (++next[axis] >= n_[axis]) continue;
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::array<int, 3> ring[4] = {next, next, next, next};
            ++ring[1][u], ++ring[2][u], ++ring[2][v], ++ring[3][v];
            for (int e = 0; e < 4; ++e) {
              std::array<Index, 4> tet = {centre(here), centre(next), corner(ring[e]), corner(ring[(e + 1) % 4])};
              if (curvesup::tet_volume(points_[tet[0]], points_[tet[1]], points_[tet[2]], points_[tet[3]]) < 0.0) {
                std::swap(tet[2], tet[3]);
              }
              visit(tet);
            }
          }
        }
      }
    }
  }

 private:
  [[nodiscard]] Index corner(const std::array<int, 3>& c) const {
    return static_cast<Index>((static_cast<std::size_t>(c[2]) * (n_[1] + 1) + c[1]) * (n_[0] + 1) + c[0]);
  }
  [[nodiscard]] Index centre(const std::array<int, 3>& c) const {
    return first_centre_ + static_cast<Index>((static_cast<std::size_t>(c[2]) * n_[1] + c[1]) * n_[0] + c[0]);
  }

  Vec3 low_;
  double cube_;
  std::array<int, 3> n_{};
  Index first_centre_ = 0;
  std::vector<Vec3> points_;
  std::vector<double> values_;
};

// Fraction of the way from the inner to the outer node at which f vanishes.
double cut_fraction(const Implicit& f, const Lattice& lattice, const Edge& edge) {
  double in = 0.0, out = 1.0;
  for (int step = 0; step < 40; ++step) {
    const double middle = 0.5 * (in + out);
    (f(lattice.point(edge[0]) + middle * (lattice.point(edge[1]) - lattice.point(edge[0]))) < 0.0 ? in : out) = middle;
  }
  return 0.5 * (in + out);
}

// The triangles of marching tetrahedra, corners given as cut lattice edges, looking outward.
std::vector<std::array<Edge, 3>> march(const Lattice& lattice) {
  std::vector<std::array<Edge, 3>> triangles;
  lattice.for_each_tet([&](const std::array<Index, 4>& tet) {
    std::vector<int> in, out;
    for (int v = 0; v < 4; ++v) (lattice.inside(tet[v]) ? in : out).push_back(v);
    if (in.empty() || out.empty()) return;
    const auto cut = [&](int a, int b) { return Edge{tet[a], tet[b]}; };
    std::vector<std::array<Edge, 3>> found;
    if (in.size() == 1) found = {{cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2])}};
    if (out.size() == 1) found = {{cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0])}};
    if (in.size() == 2) {
      const Edge a = cut(in[0], out[0]), b = cut(in[0], out[1]), c = cut(in[1], out[1]), d = cut(in[1], out[0]);
      found = {{a, b, c}, {a, c, d}};
    }
    Vec3 outward = Vec3::Zero();
    for (const int v : out) outward += lattice.point(tet[v]) / static_cast<double>(out.size());
    for (const int v : in) outward -= lattice.point(tet[v]) / static_cast<double>(in.size());
    const auto middle = [&](const Edge& e) { return Vec3(0.5 * (lattice.point(e[0]) + lattice.point(e[1]))); };
    for (auto& t : found) {
      if (curvesup::area_normal(middle(t[0]), middle(t[1]), middle(t[2])).dot(outward) < 0.0) std::swap(t[1], t[2]);
      triangles.push_back(t);
    }
  });
  return triangles;
}

// One vertex for each cut lattice edge.
TriangleMesh indexed(const Implicit& f, const Lattice& lattice, const std::vector<std::array<Edge, 3>>& triangles) {
  TriangleMesh mesh;
  std::map<Edge, Index> vertex;
  for (const auto& t : triangles) {
    std::array<Index, 3> corners{};
    for (int c = 0; c < 3; ++c) {
      const auto [slot, fresh] = vertex.emplace(t[c], static_cast<Index>(mesh.vertices.size()));
      corners[c] = slot->second;
      if (!fresh) continue;
      const double fraction = cut_fraction(f, lattice, t[c]);
      mesh.vertices.push_back(lattice.point(t[c][0]) + fraction * (lattice.point(t[c][1]) - lattice.point(t[c][0])));
    }
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

// Collapses edges shorter than min_length to their middle, shortest first, wherever the surface stays a manifold and no
// triangle turns over: this removes the needles of marching tetrahedra.
class EdgeCollapse {
 public:
  explicit EdgeCollapse(TriangleMesh& mesh) : mesh_(mesh), around_(mesh.vertices.size()) {
    for (Index t = 0; t < static_cast<Index>(mesh.triangles.size()); ++t) {
      for (const Index v : mesh.triangles[t]) around_[v].push_back(t);
    }
  }

  void run(double min_length) {
    for (bool changed = true; changed;) {
      changed = false;
      for (const auto& [length, edge] : short_edges(min_length)) {
        const bool same = (mesh_.vertices[edge[0]] - mesh_.vertices[edge[1]]).norm() == length;
        if (same && neighbours(edge[0]).contains(edge[1]) && may_collapse(edge)) {
          collapse(edge);
          changed = true;
        }
      }
    }
    compact();
  }

 private:
  [[nodiscard]] std::set<Index> neighbours(Index v) const {
    std::set<Index> result;
    for (const Index t : around_[v]) result.insert(mesh_.triangles[t].begin(), mesh_.triangles[t].end());
    result.erase(v);
    return result;
  }

  [[nodiscard]] std::vector<std::pair<double, Edge>> short_edges(double min_length) const {
    std::vector<std::pair<double, Edge>> edges;
    for (Index v = 0; v < static_cast<Index>(around_.size()); ++v) {
      for (const Index w : neighbours(v)) {
        const double length = (mesh_.vertices[v] - mesh_.vertices[w]).norm();
        if (v < w && length < min_length) edges.push_back({length, {v, w}});
      }
    }
    std::sort(edges.begin(), edges.end());
    return edges;
  }

  [[nodiscard]] bool may_collapse(const Edge& edge) const {
    const std::set<Index> a = neighbours(edge[0]), b = neighbours(edge[1]);
    std::vector<Index> both;
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
    if (both.size() != 2 || a.size() + b.size() < 8) return false;
    for (const Index v : both) {
      if (around_[v].size() <= 3) return false;
    }
    const Vec3 middle = 0.5 * (mesh_.vertices[edge[0]] + mesh_.vertices[edge[1]]);
    return keeps_normals(edge[0], edge[1], middle) && keeps_normals(edge[1], edge[0], middle);
  }

  // Moving v to `to` turns none of its triangles over, those at `other` aside.
  [[nodiscard]] bool keeps_normals(Index v, Index other, const Vec3& to) const {
    for (const Index t : around_[v]) {
      const auto& corners = mesh_.triangles[t];
      if (std::find(corners.begin(), corners.end(), other) != corners.end()) continue;
      std::array<Vec3, 3> before, after;
      for (int c = 0; c < 3; ++c) {
        before[c] = mesh_.vertices[corners[c]];
        after[c] = corners[c] == v ? to : before[c];
      }
      const Vec3 n0 = curvesup::area_normal(before[0], before[1], before[2]);
      const Vec3 n1 = curvesup::area_normal(after[0], after[1], after[2]);
      if (n0.dot(n1) < 0.2 * n0.norm() * n1.norm()) return false;
    }
    return true;
  }

  void collapse(const Edge& edge) {
    const auto [kept, gone] = edge;
    mesh_.vertices[kept] = 0.5 * (mesh_.vertices[kept] + mesh_.vertices[gone]);
    for (const Index t : std::vector<Index>(around_[gone])) {
      auto& corners = mesh_.triangles[t];
      if (std::find(corners.begin(), corners.end(), kept) != corners.end()) {
        for (const Index v : corners) std::erase(around_[v], t);
        corners = {kNone, kNone, kNone};
      } else {
        std::replace(corners.begin(), corners.end(), gone, kept);
        around_[kept].push_back(t);
      }
    }
    around_[gone].clear();
  }

  void compact() {
    TriangleMesh result;
    std::vector<Index> id(mesh_.vertices.size(), kNone);
    for (auto corners : mesh_.triangles) {
      if (corners[0] == kNone) continue;
      for (Index& v : corners) {
        if (id[v] == kNone) {
          id[v] = static_cast<Index>(result.vertices.size());
          result.vertices.push_back(mesh_.vertices[v]);
        }
        v = id[v];
      }
      result.triangles.push_back(corners);
    }
    mesh_ = std::move(result);
  }

  TriangleMesh& mesh_;
  std::vector<std::vector<Index>> around_;  // triangles at each vertex
};

Vec3 gradient(const Implicit& f, const Vec3& p) {
  constexpr double kStep = 1e-4;
  Vec3 g;
  for (int a = 0; a < 3; ++a) {
    Vec3 forward = p, back = p;
    forward[a] += kStep, back[a] -= kStep;
    g[a] = (f(forward) - f(back)) / (2.0 * kStep);
  }
  return g;
}

Vec3 project(const Implicit& f, Vec3 p) {
  for (int step = 0; step < 12; ++step) {
    const Vec3 g = gradient(f, p);
    p -= f(p) / std::max(g.squaredNorm(), 0.01) * g;
  }
  return p;
}

void smooth(const Implicit& f, TriangleMesh& mesh, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    std::vector<Vec3> sum(mesh.vertices.size(), Vec3::Zero());
    std::vector<double> weight(mesh.vertices.size(), 0.0);
    for (const auto& t : mesh.triangles) {
      const Vec3 centre = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
      const double area = curvesup::triangle_area(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
      for (const Index v : t) sum[v] += area * centre, weight[v] += area;
    }
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      Vec3& p = mesh.vertices[v];
      p = project(f, p + 0.6 * (sum[v] / weight[v] - p));
    }
  }
}

}  // namespace

bool is_closed_manifold(const TriangleMesh& mesh) {
  std::map<Edge, int> directed;
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) ++directed[{t[c], t[(c + 1) % 3]}];
  }
  for (const auto& [edge, uses] : directed) {
    const auto back = directed.find({edge[1], edge[0]});
    if (uses != 1 || back == directed.end() || back->second != 1) return false;
  }
  // Walk the fan around each vertex from its first triangle: it must meet all triangles of the vertex.
  std::map<Edge, Index> next;  // (vertex, neighbour) -> the following neighbour around the vertex
  std::vector<int> degree(mesh.vertices.size(), 0);
  std::vector<Index> start(mesh.vertices.size(), kNone);
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      next[{t[c], t[(c + 1) % 3]}] = t[(c + 2) % 3];
      start[t[c]] = t[(c + 1) % 3];
      ++degree[t[c]];
    }
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (start[v] == kNone) return false;
    int steps = 0;
    Index at = start[v];
    do {
      at = next.at({static_cast<Index>(v), at});
      ++steps;
    } while (at != start[v] && steps <= degree[v]);
    if (steps != degree[v]) return false;
  }
  return true;
}

SurfaceTopology surface_topology(const TriangleMesh& mesh) {
  std::vector<Index> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  SurfaceTopology result;
  for (Index v = 0; v < static_cast<Index>(parent.size()); ++v) result.components += root(v) == v;
  const int faces = static_cast<int>(mesh.triangles.size());
  const int euler = static_cast<int>(mesh.vertices.size()) - 3 * faces / 2 + faces;
  result.genus = (2 * result.components - euler) / 2;
  return result;
}

TriangleMesh mesh_zero_set(const Implicit& f, const Vec3& low, const Vec3& high, double edge_mm) {
  constexpr int kSmoothingRounds = 30;
  const Lattice lattice(f, low, high, edge_mm);
  TriangleMesh mesh = indexed(f, lattice, march(lattice));
  EdgeCollapse(mesh).run(0.6 * edge_mm);
  smooth(f, mesh, kSmoothingRounds);
  for (const auto& t : mesh.triangles) {
    const Vec3& a = mesh.vertices[t[0]];
    const Vec3& b = mesh.vertices[t[1]];
    const Vec3& c = mesh.vertices[t[2]];
    if (curvesup::area_normal(a, b, c).dot(gradient(f, (a + b + c) / 3.0)) <= 0.0) {
      throw Error(ErrorKind::geometry, "zero set", "has a folded triangle on this lattice", "use shorter edges");
    }
  }
  return mesh;
}

}  // namespace make_models
