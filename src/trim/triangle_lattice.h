#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Samples of a triangle ABC in rows along BC: row 0 is A, row n is BC, evenly far apart. Row j has k_j intervals, 0 at A and k at
// BC, at most one more than the row before; so needles, which most triangles of a layer are, get no more samples than
// they need. Between rows lie cells of three nodes each: a node has links to the next in its row and to the nodes (j + 1, i) and
// (j + 1, i + 1) of the next one.
class TriangleLattice {
 public:
  struct Node {
    int j, i;
  };
  enum Link { kAlong, kDown, kDownAside };
  static constexpr std::int8_t kUnknownSide = -1;

  // k <= n.
  void set(const Vec3& a, const Vec3& b, const Vec3& c, int n, int k) {
    origin_ = a;
    down_ = (b - a) / n;
    along_ = (c - b) / n;
    rows_.clear();
    Index first = 0;
    for (int j = 0; j <= n; ++j) {
      const int intervals = (k * j + n - 1) / n;
      rows_.push_back({first, intervals, intervals > 0 ? Vec3(along_ * (static_cast<double>(j) / intervals)) : Vec3(Vec3::Zero())});
      first += intervals + 1;
    }
    side_.assign(first, kUnknownSide);
    value_.assign(first, std::numeric_limits<double>::quiet_NaN());
    crossing_.assign(first, {kNone, kNone, kNone});
  }

  [[nodiscard]] int rows() const { return static_cast<int>(rows_.size()) - 1; }
  [[nodiscard]] int intervals(int row) const { return rows_[row].intervals; }
  [[nodiscard]] Vec3 position(Node node) const { return origin_ + node.j * down_ + node.i * rows_[node.j].step; }
  // A place in a row, from 0 to 1.
  [[nodiscard]] Vec3 position(int row, double part) const { return origin_ + row * (down_ + part * along_); }
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
    Vec3 step;
  };
  [[nodiscard]] Index at(Node node) const { return rows_[node.j].first + node.i; }

  Vec3 origin_, down_, along_;
  std::vector<Row> rows_;
  std::vector<std::int8_t> side_;
  std::vector<double> value_;
  std::vector<std::array<Index, 3>> crossing_;
};

}  // namespace curvesup
