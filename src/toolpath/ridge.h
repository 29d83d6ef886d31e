#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "toolpath/track.h"

namespace curvesup::toolpath {

struct BeadWidths {
  double width = 0.8, min = 0.2, max = 1.2;

  // The widest strip that one centre line fills, between so many rings on either side. In a wider one two beads of half its
  // width lie. Between rings, which run half a width beside the strip, no place is farther than 0.55 widths from a path then.
  [[nodiscard]] double widest_strip(int rings) const { return rings == 0 ? max : std::min(max, std::max(1.2 * width, 2.0 * min)); }
};

// Where fronts from two sides of the piece meet under more than a right angle and a third: the medial line, apart from
// its branches into corners, which rings fill by themselves.
//
// With D the distance to the border on it, n = floor(D / w) rings lie on either side and a strip of width
// R = 2 (D - n w) is left. Where R is between `min` and `widest_strip(n)`, one centre line fills it; below, the rings beside
// it are wider; above, ring n runs in the middle of either half. Their widths follow from the area they fill (share_area.h).
class Ridge {
 public:
  Ridge(const BorderDistance& distance, const BeadWidths& beads);

  // Tracks along the medial line. Free ends are drawn out towards the border, as near to it as the bead must come to hold
  // what lies around its end.
  [[nodiscard]] std::vector<Track> centre_lines() const;

  // How far from the border the ring of a level runs beside a vertex.
  [[nodiscard]] double ring_distance(int level, Index vertex) const;

  // Whether a centre line takes the place of a ring at `level` at a point between two vertices, so far from the border.
  [[nodiscard]] bool replaces_ring(int level, Index from, Index to, const Vec3& position, double distance) const;

  // How far below the medial line a vertex lies; infinite where that is more than three widths or unknown.
  [[nodiscard]] double rise(Index vertex) const;

  [[nodiscard]] bool empty() const { return nodes_.empty(); }

 private:
  struct Node {
    Vec3 position, normal;
    double distance = 0.0;
    bool filled = false;  // by a centre line
  };
  struct Segment {
    Index a = kNone, b = kNone, triangle = kNone;
  };
  struct Summit {
    Index vertex = kNone, node = kNone;
    std::vector<Index> around;  // triangles
  };
  void find_nodes();
  void join_in_triangle(Index triangle, const std::vector<char>& joined);
  void find_summits();
  void cut_to_strips();
  void chain_up();
  void hand_down();
  [[nodiscard]] double slack(Index node, const Vec3& position, double distance) const;
  // What the rings leave where the medial line is so far from the border.
  [[nodiscard]] double strip_width(double distance) const;
  [[nodiscard]] bool fits(double distance) const;
  void draw_out(Track& track, Index end) const;

  const BorderDistance& distance_;
  BeadWidths beads_;
  std::vector<Node> nodes_;
  std::vector<Segment> segments_;
  std::vector<Summit> summits_;
  std::vector<std::vector<Index>> chains_;       // nodes
  std::vector<std::vector<Index>> chain_under_;  // triangle of the segment that ends at each node
  std::vector<char> cut_end_;                    // node was made by cut_to_strips
  std::vector<char> free_end_;                   // nothing goes on from the node
  std::vector<Index> node_of_vertex_;            // the ridge node uphill of each vertex
};

}  // namespace curvesup::toolpath
