#include "mesh/face_uses.h"

#include <algorithm>
#include <numeric>

namespace curvesup {

namespace {

FaceUse face_use(const TetMesh& mesh, Index tet, int face) {
  FaceUse use{face_vertices(mesh.tets[tet], face), tet, face};
  auto& [a, b, c] = use.sorted;
  if (a > b) std::swap(a, b);
  if (b > c) std::swap(b, c);
  if (a > b) std::swap(a, b);
  return use;
}

bool before(const FaceUse& a, const FaceUse& b) {
  if (a.sorted[1] != b.sorted[1]) return a.sorted[1] < b.sorted[1];
  if (a.sorted[2] != b.sorted[2]) return a.sorted[2] < b.sorted[2];
  return a.tet < b.tet;
}

}  // namespace

std::vector<FaceUse> sorted_face_uses(const TetMesh& mesh) {
  const Index tets = static_cast<Index>(mesh.tets.size());
  std::vector<std::size_t> first(mesh.vertices.size() + 1, 0);  // of the faces with a given lowest vertex
  for (Index t = 0; t < tets; ++t) {
    for (int f = 0; f < 4; ++f) ++first[face_use(mesh, t, f).sorted[0] + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<FaceUse> uses(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (Index t = 0; t < tets; ++t) {
    for (int f = 0; f < 4; ++f) {
      const FaceUse use = face_use(mesh, t, f);
      uses[next[use.sorted[0]]++] = use;
    }
  }
  for (std::size_t v = 0; v + 1 < first.size(); ++v) {
    std::sort(uses.begin() + static_cast<std::ptrdiff_t>(first[v]), uses.begin() + static_cast<std::ptrdiff_t>(first[v + 1]), before);
  }
  return uses;
}

}  // namespace curvesup
