#include "layers/sheet_edges.h"

#include <algorithm>

namespace curvesup {

namespace {
struct Use {
  Index high;
  Index triangle;
  Index direction;
};
}  // namespace

std::vector<SheetEdge> sheet_edges(std::span<const std::array<Index, 3>> triangles) {
  std::vector<SheetEdge> edges;
  if (triangles.empty()) return edges;
  Index first = triangles[0][0], last = first;
  for (const auto& t : triangles) {
    for (const Index v : t) {
      first = std::min(first, v);
      last = std::max(last, v);
    }
  }
  // Bucket the uses by their lower vertex, then order each small bucket.
  std::vector<Index> start(last - first + 2, 0);
  const auto for_each_use = [&](const auto& visit) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const Index a = triangles[i][c], b = triangles[i][(c + 1) % 3];
        if (a < b) visit(a, Use{b, static_cast<Index>(i), 1});
        if (a > b) visit(b, Use{a, static_cast<Index>(i), -1});
      }
    }
  };
  for_each_use([&](Index low, const Use&) { ++start[low - first + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  std::vector<Use> uses(start.back());
  std::vector<Index> next(start.begin(), start.end() - 1);
  for_each_use([&](Index low, const Use& use) { uses[next[low - first]++] = use; });

  edges.reserve(uses.size() / 2 + 16);
  for (std::size_t v = 0; v + 1 < start.size(); ++v) {
    const auto begin = uses.begin() + start[v], end = uses.begin() + start[v + 1];
    std::sort(begin, end, [](const Use& a, const Use& b) { return a.high != b.high ? a.high < b.high : a.triangle < b.triangle; });
    for (auto use = begin; use != end;) {
      SheetEdge edge{first + static_cast<Index>(v), use->high, 0, 0, use->triangle};
      for (; use != end && use->high == edge.high; ++use) {
        ++edge.uses;
        edge.balance += use->direction;
      }
      edges.push_back(edge);
    }
  }
  return edges;
}

}  // namespace curvesup
