#pragma once

#include <utility>
#include <vector>

#include "toolpath/piece_mesh.h"

namespace curvesup::toolpath {

// An edge of a piece's border, the piece on its left. Loops close by next / previous.
struct BorderEdge {
  Index from = kNone, to = kNone;  // vertices
  Index next = kNone, previous = kNone;
  Vec3 start = Vec3::Zero(), along = Vec3::Zero();
  double inverse_squared_length = 0.0;  // 0 of an edge without length
};

// What a point of the surface sees of the border.
struct Front {
  Vec3 way = Vec3::Zero();  // to the nearest place on it, laid into the tangent plane of the point; as long as `distance`
  double distance = 0.0;
  Index edge = kNone;       // on which that place lies ...
  bool inside = false;      // ... and not at an end of it
};

// A vertex to which two fronts come from equally far: the medial line passes there, or a branch of it into a corner.
struct Meeting {
  Index vertex = kNone;
  Front other;  // beside the vertex' own
};

struct DistanceOptions {
  double tolerance_mm = 0.02;  // an edge is halved while its middle is farther than this off the linear value ...
  double min_edge_mm = 0.36;   // ... and it is longer than this
  double max_edge_mm = 1.6;    // longer ones are halved before: their ends would not see what lies between them
};

// Distance to the border of a piece in mm along its surface, at vertices so dense that linear interpolation holds. Edges on
// which two fronts meet are cut at that place, so that the mesh has vertices along the medial line.
//
// The nearest place on the border is sought in space, among the edges that neighbours have found nearest and along the border
// from there, so a fold of the layer that comes near is never seen. The way to it is taken for the arc of a circle that stands on
// the normals at its two ends: exact on planes, cylinders and spheres; elsewhere the error is of the third order in distance over
// radius. Needles, degenerate triangles and rough sheets do no harm. O(n).
class BorderDistance {
 public:
  BorderDistance(PieceMesh mesh, const DistanceOptions& options);

  [[nodiscard]] const PieceMesh& mesh() const { return mesh_; }
  [[nodiscard]] const EdgeTable& edges() const { return edges_; }
  [[nodiscard]] double distance(Index vertex) const { return fronts_[vertex].distance; }
  [[nodiscard]] const Front& front(Index vertex) const { return fronts_[vertex]; }
  // The front of `vertex` as seen from the point vertex + offset, whose unit normal is given.
  [[nodiscard]] Front seen_from(Index vertex, const Vec3& offset, const Vec3& normal) const;

  // Where the distance has a kink: in the order of their vertices.
  [[nodiscard]] const std::vector<Meeting>& meetings() const { return meetings_; }
  // Of a vertex; kNone where fronts do not meet there.
  [[nodiscard]] Index meeting_of(Index vertex) const { return meeting_of_[vertex]; }
  // The fronts of two vertices that come from one side, as far as there are such.
  [[nodiscard]] std::pair<const Front*, const Front*> alike(Index a, Index b) const;
  // Whether both fronts that meet at `a` meet at `b` as well.
  [[nodiscard]] bool meet_alike(Index a, Index b) const;

 private:
  struct Place {
    Index edge = kNone;
    double part = 0.0;  // of the edge's length
    double squared = 0.0;  // distance in space
  };
  void collect_border();
  std::vector<char> refine(const DistanceOptions& options, const std::vector<char>& at);
  std::vector<char> hand_on(std::vector<Index> changed);
  void take(Index vertex, const Front& front);
  [[nodiscard]] Place on_edge(Index edge, const Vec3& point) const;
  [[nodiscard]] Place nearest_along(Index edge, const Vec3& point) const;
  // The place that a known front comes from as seen from a point nearby.
  [[nodiscard]] Place nearest_from(const Front& front, const Vec3& point) const;
  [[nodiscard]] Front front_at(const Place& place, const Vec3& point, const Vec3& normal) const;
  // That of a vertex' fronts whose way runs most along a given one.
  [[nodiscard]] const Front& most_along(Index vertex, const Vec3& way) const;
  // The front that goes on from a known one, as seen from a point nearby.
  [[nodiscard]] Front seen_along(const Front& front, const Vec3& point, const Vec3& normal) const;
  [[nodiscard]] bool stays_on_edge(const Front& from, const Front& to, Index vertex) const;
  Index cut_edge(Index a, Index b, const DistanceOptions& options);
  Index cut_at_kink(Index a, Index b, Front from_a, Front from_b);
  Index add_vertex(Index a, Index b, double part, const Front& front);
  void add_meeting(Index vertex, const Front& other);
  void put_meetings_in_order();

  PieceMesh mesh_;
  EdgeTable edges_;
  std::vector<BorderEdge> border_;
  std::vector<Front> fronts_;
  std::vector<Meeting> meetings_;
  std::vector<Index> meeting_of_;  // by vertex
};

}  // namespace curvesup::toolpath
