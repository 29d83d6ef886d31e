#include "model/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "core/disjoint_sets.h"
#include "curvesup/mesh/triangle_tree.h"
#include "mesh/face_uses.h"

namespace curvesup::mesh_checks {

namespace {

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

bool in_range(const std::array<Index, 4>& tet, Index vertices) {
  return std::all_of(tet.begin(), tet.end(), [&](Index v) { return v >= 0 && v < vertices; });
}

// An edge (lower vertex first) or a face with where it came from, for sorting.
struct EdgeUse {
  Index low, high, face;
  friend bool operator<(const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  }
};

std::vector<EdgeUse> sorted_edge_uses(const std::vector<std::array<Index, 3>>& faces) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * faces.size());
  for (Index f = 0; f < size_of(faces); ++f) {
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(faces[f][c], faces[f][(c + 1) % 3]);
      uses.push_back({low, high, f});
    }
  }
  std::sort(uses.begin(), uses.end());
  return uses;
}

// Calls visit(begin, end) for each run of uses of one edge.
void for_each_edge(const std::vector<EdgeUse>& uses, const auto& visit) {
  for (std::size_t begin = 0; begin < uses.size();) {
    std::size_t end = begin + 1;
    while (end < uses.size() && uses[end].low == uses[begin].low && uses[end].high == uses[begin].high) ++end;
    visit(begin, end);
    begin = end;
  }
}

}  // namespace

Box bounding_box(const TetMesh& mesh) {
  Box box{Vec3::Constant(std::numeric_limits<double>::max()), Vec3::Constant(-std::numeric_limits<double>::max())};
  const auto add = [&](const Vec3& p) {
    if (!p.allFinite()) return;
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  };
  for (const auto& tet : mesh.tets) {
    if (!in_range(tet, size_of(mesh.vertices))) continue;
    for (const Index v : tet) add(mesh.vertices[v]);
  }
  if (box.low.x() > box.high.x()) std::for_each(mesh.vertices.begin(), mesh.vertices.end(), add);
  return box.low.x() > box.high.x() ? Box{} : box;
}

std::vector<Index> vertices_not_finite(const TetMesh& mesh) {
  std::vector<Index> found;
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (!mesh.vertices[v].allFinite()) found.push_back(v);
  }
  return found;
}

std::vector<Index> tets_out_of_range(const TetMesh& mesh) {
  std::vector<Index> found;
  for (Index t = 0; t < size_of(mesh.tets); ++t) {
    if (!in_range(mesh.tets[t], size_of(mesh.vertices))) found.push_back(t);
  }
  return found;
}

std::vector<Index> first_of_equal_vertices(const TetMesh& mesh) {
  std::vector<Index> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](Index v) {
    const Vec3& p = mesh.vertices[v];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::erase_if(order, [&](Index v) { return !mesh.vertices[v].allFinite(); });
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    const auto ka = key(a), kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  std::vector<Index> first(mesh.vertices.size());
  std::iota(first.begin(), first.end(), 0);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (mesh.vertices[order[i]] == mesh.vertices[order[i - 1]]) first[order[i]] = first[order[i - 1]];
  }
  return first;
}

std::vector<Index> unreferenced_vertices(const TetMesh& mesh) {
  std::vector<char> used(mesh.vertices.size(), 0);
  for (const auto& tet : mesh.tets) {
    for (const Index v : tet) used[v] = 1;
  }
  std::vector<Index> found;
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (!used[v]) found.push_back(v);
  }
  return found;
}

Volumes classify_volumes(const TetMesh& mesh, double diagonal) {
  const double zero = kZeroVolume * diagonal * diagonal * diagonal;
  Volumes found;
  for (Index t = 0; t < size_of(mesh.tets); ++t) {
    const double volume = tet_volume(mesh, t);
    if (!(std::abs(volume) >= zero) || volume == 0.0) {
      found.zero.push_back(t);
    } else if (volume < 0.0) {
      found.negative.push_back(t);
    }
  }
  return found;
}

Faces classify_faces(const TetMesh& mesh) {
  // The oriented face is an even permutation of the sorted one.
  const auto even = [&](const FaceUse& use) {
    const auto v = face_vertices(mesh.tets[use.tet], use.face);
    return ((v[0] > v[1]) + (v[0] > v[2]) + (v[1] > v[2])) % 2 == 0;
  };
  const std::vector<FaceUse> uses = sorted_face_uses(mesh);
  Faces found;
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].sorted == uses[i].sorted) ++end;
    if (end - i == 1) found.boundary.push_back(face_vertices(mesh.tets[uses[i].tet], uses[i].face));
    if (end - i == 2 && even(uses[i]) == even(uses[i + 1])) found.overlapping.push_back({uses[i].tet, uses[i + 1].tet});
    if (end - i > 2) found.overfull.push_back(uses[i].sorted);
    i = end;
  }
  return found;
}

TrueTriangles true_triangles(const TriangleMesh& surface) {
  TrueTriangles result;
  std::vector<std::pair<std::array<Index, 3>, Index>> turned;  // lowest vertex first, so that equal ones are the same
  for (Index t = 0; t < size_of(surface.triangles); ++t) {
    std::array<Index, 3> v = surface.triangles[t];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      result.collapsed.push_back(t);
      continue;
    }
    std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
    turned.emplace_back(v, t);
  }
  std::sort(turned.begin(), turned.end());
  std::vector<char> repeats(surface.triangles.size(), 0);
  for (std::size_t i = 1; i < turned.size(); ++i) {
    if (turned[i].first == turned[i - 1].first) repeats[turned[i].second] = 1;
  }
  for (Index t = 0, next = 0; t < size_of(surface.triangles); ++t) {
    if (next < size_of(result.collapsed) && result.collapsed[next] == t) {
      ++next;
    } else if (repeats[t]) {
      result.repeated.push_back(t);
    } else {
      result.kept.push_back(surface.triangles[t]);
    }
  }
  return result;
}

Manifold check_manifold(const std::vector<std::array<Index, 3>>& faces, std::size_t vertices) {
  Manifold found;
  const auto uses = sorted_edge_uses(faces);
  // Corners 3f + c around one vertex are joined across shared edges; one set a vertex means one fan.
  DisjointSets corners(3 * faces.size());
  const auto corner = [&](Index face, Index vertex) {
    int c = 0;
    while (faces[face][c] != vertex) ++c;
    return 3 * face + c;
  };
  std::vector<char> on_bad_edge(vertices, 0);
  for_each_edge(uses, [&](std::size_t begin, std::size_t end) {
    const auto [low, high, face] = uses[begin];
    if (end - begin != 2) {
      found.bad_edges.push_back({low, high});
      if (end - begin == 1) found.open_edges.push_back({low, high});
      on_bad_edge[low] = on_bad_edge[high] = 1;
      return;
    }
    corners.join(corner(face, low), corner(uses[begin + 1].face, low));
    corners.join(corner(face, high), corner(uses[begin + 1].face, high));
  });
  std::vector<Index> fans(vertices, 0);
  for (Index f = 0; f < size_of(faces); ++f) {
    for (int c = 0; c < 3; ++c) {
      if (corners.root(3 * f + c) == 3 * f + c) ++fans[faces[f][c]];
    }
  }
  for (Index v = 0; v < size_of(fans); ++v) {
    if (fans[v] > 1 && !on_bad_edge[v]) found.bad_vertices.push_back(v);
  }
  return found;
}

namespace {

// The segment meets the inside of the triangle.
bool crosses(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, const Vec3& r) {
  const double above = tet_volume(p, q, r, a), below = tet_volume(p, q, r, b);
  if (!(above * below < 0.0)) return false;
  const double u = tet_volume(a, b, p, q), v = tet_volume(a, b, q, r), w = tet_volume(a, b, r, p);
  return (u > 0.0 && v > 0.0 && w > 0.0) || (u < 0.0 && v < 0.0 && w < 0.0);
}

}  // namespace

Contacts find_contacts(const TriangleMesh& surface, double gap) {
  const auto& [vertices, faces] = surface;
  const TriangleTree tree(surface);
  const auto has = [&](Index face, Index v) { return std::find(faces[face].begin(), faces[face].end(), v) != faces[face].end(); };
  const auto corner = [&](Index face, int c) -> const Vec3& { return vertices[faces[face][c]]; };
  Contacts found;
  std::vector<char> seen(vertices.size(), 0);
  for (const auto& face : faces) {
    bool crossing = false;
    for (int c = 0; c < 3; ++c) {
      const Index a = face[c], b = face[(c + 1) % 3];
      const Vec3 &pa = vertices[a], &pb = vertices[b];
      tree.overlapping(pa.cwiseMin(pb), pa.cwiseMax(pb), [&](Index other) {
        if (crossing || has(other, a) || has(other, b)) return;
        crossing = crosses(pa, pb, corner(other, 0), corner(other, 1), corner(other, 2));
      });
      if (seen[a]) continue;
      seen[a] = 1;
      bool near = false;
      const Vec3 around = Vec3::Constant(gap);
      tree.overlapping(pa - around, pa + around, [&](Index other) {
        if (near || has(other, a) || has(other, b) || has(other, face[(c + 2) % 3])) return;
        near = (closest_point_on_triangle(pa, corner(other, 0), corner(other, 1), corner(other, 2)) - pa).norm() < gap;
      });
      if (near) found.close.push_back(a);
    }
    if (crossing) found.crossed.push_back(face);
  }
  std::sort(found.crossed.begin(), found.crossed.end());
  std::sort(found.close.begin(), found.close.end());
  return found;
}

Shape measure_shape(const TetMesh& mesh, const TetTopology& topology, const std::vector<BoundaryFace>& boundary) {
  Shape shape;
  DisjointSets volumes(mesh.tets.size());
  for (Index t = 0; t < size_of(mesh.tets); ++t) {
    for (const Index other : topology.neighbours[t]) {
      if (other > t) volumes.join(t, other);
    }
  }
  for (Index t = 0; t < size_of(mesh.tets); ++t) shape.components += volumes.root(t) == t;

  DisjointSets shells(mesh.vertices.size());
  std::vector<char> on_boundary(mesh.vertices.size(), 0);
  for (const auto& face : boundary) {
    shells.join(face.vertices[0], face.vertices[1]);
    shells.join(face.vertices[0], face.vertices[2]);
    for (const Index v : face.vertices) on_boundary[v] = 1;
  }
  // Characteristic V - E + F with E = 3 F / 2, and six times the enclosed volume, of each shell.
  std::vector<Index> vertex_count(mesh.vertices.size(), 0), face_count(mesh.vertices.size(), 0);
  std::vector<double> enclosed(mesh.vertices.size(), 0.0);
  const Vec3 origin = bounding_box(mesh).low;
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (on_boundary[v]) ++vertex_count[shells.root(v)];
  }
  for (const auto& face : boundary) {
    const Index shell = shells.root(face.vertices[0]);
    ++face_count[shell];
    const Vec3 a = mesh.vertices[face.vertices[0]] - origin, b = mesh.vertices[face.vertices[1]] - origin,
               c = mesh.vertices[face.vertices[2]] - origin;
    enclosed[shell] += a.cross(b).dot(c);
  }
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (face_count[v] == 0) continue;
    ++shape.shells;
    shape.cavities += enclosed[v] < 0.0;
    shape.genus += (2 - (vertex_count[v] - face_count[v] / 2)) / 2;
  }
  return shape;
}

}  // namespace curvesup::mesh_checks
