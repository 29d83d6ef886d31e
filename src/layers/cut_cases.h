#pragma once

#include <array>
#include <span>

#include "curvesup/mesh/tet_mesh.h"

namespace curvesup {

constexpr int local_edge(int a, int b) {
  for (int e = 0; e < 6; ++e) {
    if ((kTetEdge[e][0] == a && kTetEdge[e][1] == b) || (kTetEdge[e][0] == b && kTetEdge[e][1] == a)) return e;
  }
  return -1;
}

// The local edges of a tet that one level crosses, as a ring around the part above, seen from above counter-clockwise.
// Indexed by the bit mask of the local vertices that are above.
struct CutCase {
  int size = 0;  // 0, 3 or 4
  std::array<int, 4> edge{};
};

constexpr std::array<CutCase, 16> make_cut_cases() {
  std::array<CutCase, 16> cases{};
  for (int i = 0; i < 4; ++i) {
    const auto& f = kTetFace[i];  // its normal points away from vertex i
    const int a = local_edge(i, f[0]), b = local_edge(i, f[1]), c = local_edge(i, f[2]);
    cases[1 << i] = {3, {a, c, b, -1}};
    cases[15 ^ (1 << i)] = {3, {a, b, c, -1}};
  }
  // Even permutations (i, j, k, l): i and j above, k and l below.
  constexpr int kEven[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
  for (const auto& p : kEven) {
    cases[(1 << p[0]) | (1 << p[1])] = {
        4, {local_edge(p[0], p[2]), local_edge(p[1], p[2]), local_edge(p[1], p[3]), local_edge(p[0], p[3])}};
  }
  return cases;
}
inline constexpr std::array<CutCase, 16> kCutCases = make_cut_cases();

// Where the edge from a vertex below the level to one above crosses it.
[[nodiscard]] inline Vec3 crossing_point(const Vec3& below, double below_value, const Vec3& above, double above_value,
                                         double iso) {
  if (iso == above_value) return above;
  return below + (iso - below_value) / (above_value - below_value) * (above - below);
}

// Where an edge from one side of the platform to the other crosses it.
[[nodiscard]] inline Vec3 platform_point(const Vec3& p, const Vec3& q) {
  Vec3 cut = p + p.z() / (p.z() - q.z()) * (q - p);
  cut.z() = 0.0;
  return cut;
}

}  // namespace curvesup
