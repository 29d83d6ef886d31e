#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Samples of a quadrilateral ABCD in rows, evenly far apart: row 0 is AD, row n is BC. The rows have k_j intervals, from their
// own number at AD up to that at BC, at most one more than the row before; of a triangle A and D are one. Needles, which most
// triangles of a layer are, get no more samples than they need. Between rows lie cells of three nodes each: a node has links to
// the next in its row and to the nodes (j + 1, i) and (j + 1, i + 1) of the next one.
class RowLattice {
 public:
  struct Node {
    int j, i;
  };
  enum Link { kAlong, kDown, kDownAside };
  static constexpr std::int8_t kUnknownSide = -1;

  struct Size {
    int rows, top, bottom;  // intervals; bottom is at least top, and at most rows more
  };
  void set(const std::array<Vec3, 4>& corners, const Size& size) {
    const auto& [a, b, c, d] = corners;
    rows_.clear();
    Index first = 0;
    for (int j = 0; j <= size.rows; ++j) {
      const int intervals = size.top + ((size.bottom - size.top) * j + size.rows - 1) / size.rows;
      const double part = static_cast<double>(j) / size.rows;
      const Vec3 left = a + part * (b - a), along = (d - a) + part * ((c - b) - (d - a));
      rows_.push_back({first, intervals, left, along, along / std::max(1, intervals)});
      first += intervals + 1;
    }
    side_.assign(first, kUnknownSide);
    value_.assign(first, std::numeric_limits<double>::quiet_NaN());
    crossing_.assign(first, {kNone, kNone, kNone});
  }

  [[nodiscard]] int rows() const { return static_cast<int>(rows_.size()) - 1; }
  [[nodiscard]] int intervals(int row) const { return rows_[row].intervals; }
  [[nodiscard]] Vec3 position(Node node) const { return rows_[node.j].left + node.i * rows_[node.j].step; }
  // A place in a row, from 0 to 1.
  [[nodiscard]] Vec3 position(int row, double part) const { return rows_[row].left + part * rows_[row].along; }
  [[nodiscard]] std::int8_t& side(Node node) { return side_[at(node)]; }
  [[nodiscard]] double& value(Node node) { return value_[at(node)]; }  // NaN: not asked for yet
  // The point where the border crosses the link that starts there.
  [[nodiscard]] Index& crossing(Node node, Link link) { return crossing_[at(node)][link]; }
  [[nodiscard]] bool all_on(std::int8_t side) const {
    return std::all_of(side_.begin(), side_.end(), [side](std::int8_t s) { return s == side; });
  }

 private:
  struct Row {
    Index first;
    int intervals;
    Vec3 left, along, step;
  };
  [[nodiscard]] Index at(Node node) const { return rows_[node.j].first + node.i; }

  std::vector<Row> rows_;
  std::vector<std::int8_t> side_;
  std::vector<double> value_;
  std::vector<std::array<Index, 3>> crossing_;
};

}  // namespace curvesup
