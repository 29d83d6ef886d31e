#pragma once

#include <vector>

#include "toolpath/piece_mesh.h"

namespace curvesup::toolpath {

// The border of a piece as directed edges, the piece on their left. Loops close by next / previous.
struct Border {
  std::vector<Index> from, to;  // vertices
  std::vector<Index> next, previous;
  std::vector<double> length;
  std::vector<double> turn_cos, turn_sin;  // by which the tangent turns from an edge to the next one, about the normal
};

// The straight line from a point of the surface to the nearest place on the border, unrolled into the tangent plane of
// that point: where the border edge starts and which way it runs, as seen from there.
struct Front {
  Vec3 start = Vec3::Zero();
  Vec3 tangent = Vec3::UnitX();
  double distance = 0.0;
  Index edge = kNone;
  bool wave = false;  // far from the border: only `distance` and the direction `tangent` towards the border are known
};

struct DistanceOptions {
  double tolerance_mm = 0.02;  // an edge is halved while its middle is farther than this off the linear value ...
  double min_edge_mm = 0.36;   // ... and it is longer than this
  double unrolled_mm = 1.6;    // up to here the border itself is unrolled; farther in the distance is marched
};

// Distance to the border of a piece in mm along its surface, at vertices so dense that linear interpolation holds.
//
// Up to `unrolled_mm` each vertex keeps the nearest border edge, unrolled into its tangent plane; neighbours hand it on by the rotation that
// takes one normal into the other, and slide along the border to the nearest place, in the order of Dijkstra. Exact on
// planes; the error on gently curved pieces is of the third order in edge length over radius. Unrolled over a long way
// across a rough surface the border would land in the wrong place, so farther in the distance is handed from triangle to
// triangle. Needles and degenerate triangles do no harm. O(n log n).
class BorderDistance {
 public:
  BorderDistance(PieceMesh mesh, const DistanceOptions& options);

  [[nodiscard]] const PieceMesh& mesh() const { return mesh_; }
  [[nodiscard]] const EdgeTable& edges() const { return edges_; }
  [[nodiscard]] double distance(Index vertex) const { return fronts_[vertex].distance; }
  [[nodiscard]] const Front& front(Index vertex) const { return fronts_[vertex]; }
  // Whether the nearest border edges of two vertices are one, or run on into each other.
  [[nodiscard]] bool on_one_front(Index a, Index b) const;

  // The front of `vertex` as seen from the point vertex + offset, whose unit normal is given.
  [[nodiscard]] Front seen_from(Index vertex, const Vec3& offset, const Vec3& normal) const;
  // From the point that owns the front to the nearest place on the border; length = front.distance.
  [[nodiscard]] Vec3 to_border(const Front& front) const;

 private:
  void collect_border();
  void propagate(bool from_border);
  [[nodiscard]] bool faces_edge(const Front& front) const;
  void keep_above_chord(Front& front, Index vertex) const;
  void march();
  Index add_middle(Index a, Index b, const DistanceOptions& options);
  bool refine(const DistanceOptions& options);
  void slide(Front& front, const Vec3& normal) const;

  PieceMesh mesh_;
  EdgeTable edges_;
  Border border_;
  std::vector<Front> fronts_;
  double near_ = 0.0;
};

}  // namespace curvesup::toolpath
