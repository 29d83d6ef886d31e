#include "field/vertex_plateaus.h"

#include <numeric>

namespace curvesup {

VertexPlateaus::VertexPlateaus(const TetMesh& mesh, std::span<const double> value) {
  const Index vertices = static_cast<Index>(mesh.vertices.size());
  std::vector<Index> parent(vertices);
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<char> used(vertices, 0), has_lower(vertices, 0);
  for (const auto& tet : mesh.tets) {
    for (const Index v : tet) used[v] = 1;
    for (const auto& [i, j] : kTetEdge) {
      const Index a = tet[i], b = tet[j];
      if (value[a] < value[b]) has_lower[b] = 1;
      if (value[b] < value[a]) has_lower[a] = 1;
      if (value[a] == value[b]) {
        const Index ra = find(a), rb = find(b);
        parent[std::max(ra, rb)] = std::min(ra, rb);
      }
    }
  }
  // A group's root is its lowest vertex, so groups come in ascending order of it.
  std::vector<Index> group(vertices, kNone), size;
  std::vector<char> group_has_lower;
  for (Index v = 0; v < vertices; ++v) {
    if (!used[v]) continue;
    const Index root = find(v);
    if (root == v) {
      group[v] = static_cast<Index>(size.size());
      size.push_back(0);
      group_has_lower.push_back(0);
    }
    group[v] = group[root];
    ++size[group[v]];
    group_has_lower[group[v]] |= has_lower[v];
  }
  first_.assign(size.size() + 1, 0);
  std::partial_sum(size.begin(), size.end(), first_.begin() + 1);
  members_.resize(first_.back());
  std::vector<Index> next(first_.begin(), first_.end() - 1);
  for (Index v = 0; v < vertices; ++v) {
    if (used[v]) members_[next[group[v]]++] = v;
  }
  for (Index g = 0; g < static_cast<Index>(size.size()); ++g) {
    if (!group_has_lower[g]) minima_.push_back(g);
  }
}

}  // namespace curvesup
