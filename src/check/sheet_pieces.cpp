#include "check/sheet_pieces.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::certificate {

std::vector<Piece> pieces_of(const LayerStack& stack, Index sheet_index, Neighbours* neighbours) {
  const Sheet& sheet = stack.sheets[sheet_index];
  // Sides in buckets by their lower vertex; two triangles share a side when they meet in a bucket with equal higher
  // ones.
  Index lowest = std::numeric_limits<Index>::max(), highest = 0;
  for (Index t = 0; t < sheet.triangle_count; ++t) {
    for (const Index v : stack.triangles[sheet.first_triangle + t]) {
      lowest = std::min(lowest, v);
      highest = std::max(highest, v);
    }
  }
  if (sheet.triangle_count == 0) return {};
  struct Side {
    Index high, triangle;
    int corner;
  };
  std::vector<Index> first(static_cast<std::size_t>(highest - lowest) + 2, 0);
  const auto for_each_side = [&](const auto& use) {
    for (Index t = 0; t < sheet.triangle_count; ++t) {
      const auto& v = stack.triangles[sheet.first_triangle + t];
      for (int c = 0; c < 3; ++c) {
        const Index a = v[c], b = v[(c + 1) % 3];
        use(std::min(a, b) - lowest, Side{std::max(a, b), t, c});
      }
    }
  };
  for_each_side([&](Index bucket, const Side&) { ++first[bucket + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Side> sides(first.back());
  std::vector<Index> next(first.begin(), first.end() - 1);
  for_each_side([&](Index bucket, const Side& side) { sides[next[bucket]++] = side; });
  std::vector<Index> parent(sheet.triangle_count);
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  if (neighbours != nullptr) neighbours->assign(sheet.triangle_count, {kNone, kNone, kNone});
  const auto meet = [&](const Side& side, Index other) {
    Index& slot = (*neighbours)[side.triangle][side.corner];
    slot = slot == kNone ? other : kSeveral;
  };
  for (std::size_t bucket = 0; bucket + 1 < first.size(); ++bucket) {
    for (Index i = first[bucket]; i < first[bucket + 1]; ++i) {
      for (Index j = i + 1; j < first[bucket + 1]; ++j) {
        if (sides[i].high != sides[j].high) continue;
        if (neighbours != nullptr) {
          meet(sides[i], sides[j].triangle);
          meet(sides[j], sides[i].triangle);
        }
        const Index a = find(sides[i].triangle), b = find(sides[j].triangle);
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  std::vector<Index> piece_of(sheet.triangle_count, kNone);
  std::vector<Piece> pieces;
  for (Index t = 0; t < sheet.triangle_count; ++t) {
    const Index root = find(t);
    if (root == t) {
      piece_of[t] = static_cast<Index>(pieces.size());
      pieces.emplace_back().sheet = sheet_index;
    }
    Piece& piece = pieces[piece_of[root]];
    const auto c = corners_of(stack, sheet.first_triangle + t);
    const double area = triangle_area(c[0], c[1], c[2]);
    piece.triangles.push_back(sheet.first_triangle + t);
    piece.area += area;
    piece.centroid += area / 3.0 * (c[0] + c[1] + c[2]);
  }
  for (Piece& piece : pieces) {
    if (piece.area > 0.0) {
      piece.centroid /= piece.area;
    } else {
      piece.centroid = corners_of(stack, piece.triangles.front())[0];
    }
  }
  return pieces;
}

}  // namespace curvesup::certificate
