#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "curvesup/solid/solid.h"
#include "trim/edge_map.h"
#include "trim/polygon.h"
#include "trim/row_lattice.h"

namespace curvesup {

// Keeps what of the polygons of one sheet lies inside the solid. One that is all inside stays as it is. Where the solid's
// surface passes, the polygon is sampled at a lattice, the border runs from root to root of the solid between samples,
// points that hardly bend it are left out, and the region inside it is divided into triangles.
//
// What happens on an edge is decided by the edge alone, and its cut points are made once: so the two polygons at an edge
// agree, and a sheet stays without cracks.
class SheetCutter {
 public:
  SheetCutter(const Solid& solid, double edge_length_mm) : solid_(solid.local()), edge_length_(edge_length_mm) {}

  // Vertices get the ids 0, 1, 2, ...; a vertex that two polygons share must be added once.
  Index add_vertex(const Vec3& position);
  // Adds what of a triangle or a convex quadrilateral lies inside, cut up into triangles. They get the same tet, and it lies in the
  // neighbourhood.
  void add_polygon(std::span<const Index> corners, Index tet, const Neighbourhood& around = {});
  // Calls visit(vertex) for the ends of an edge that lie inside and for its cuts: every part of it that is inside has one.
  template <typename Visit>
  void for_inside_points(Index a, Index b, const Visit& visit) {
    const Edge found = edge(a, b);
    for (const Index v : {a, b}) {
      if (inside(v)) visit(v);
    }
    for (Index i = found.first_cut; i < found.first_cut + found.cut_count; ++i) visit(cuts_[i].vertex);
  }

  [[nodiscard]] const std::vector<Vec3>& vertices() const { return vertices_; }
  [[nodiscard]] const std::vector<std::array<Index, 3>>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<Index>& triangle_tet() const { return triangle_tet_; }
  [[nodiscard]] double cut_away_area() const { return cut_away_; }

 private:
  // As of a lattice: rows from the side AD to BC; of a triangle A and D are one.
  using Corners = std::array<Index, 4>;
  enum class EdgeSide : std::uint8_t { outside, inside, mixed };
  // Between its cuts an edge lies on one side.
  struct Edge {
    EdgeSide side = EdgeSide::outside;
    double step = 0.0;  // wanted length of an interval, here and in its polygons
    int intervals = 1;  // at whose ends it was sampled
    Index first_cut = 0, cut_count = 0;
    std::size_t first_sample = 0;  // intervals + 1 values, from the end with the lower id; NaN: not asked for
  };
  struct Cut {
    double at;  // in (0, 1), from the end with the lower id
    Index vertex;
  };
  // A point of the border inside the polygon that is being cut, or a cut or corner of it.
  struct BorderPoint {
    Vec3 position;
    Index vertex;  // kNone: not in the sheet yet
    Index next;    // along the border, the inside on the left
  };

  using Node = RowLattice::Node;
  // Nodes of the rows top .. bottom of the lattice that lie between two parts, from 0 to 1, of their rows.
  struct Block {
    int top, bottom;
    double left, right;
  };

  double value(Index vertex);
  bool inside(Index vertex);
  [[nodiscard]] static int intervals(double length, double step);
  const Edge& edge(Index a, Index b);
  void sample_edge(const Vec3& start, const Vec3& along, int low, int high);
  Index cut_between(const Vec3& inside, double inside_value, const Vec3& outside, double outside_value);

  [[nodiscard]] double length(Index a, Index b) const;
  [[nodiscard]] Corners rows_of_triangle(std::span<const Index> t) const;
  [[nodiscard]] Corners rows_of_quadrilateral(std::span<const Index> q) const;
  void start_lattice(const Corners& ring, const std::array<Edge, 4>& edges, double step);
  void take_edge(const Corners& ring, int corner, const Edge& edge);
  template <typename Visit>
  void for_nodes(const Block& block, const Visit& visit);
  void sample(const Block& block);
  void sample_halves(const Block& block);
  [[nodiscard]] bool proved_outside(const Block& block);
  [[nodiscard]] bool well_inside(const Block& block);
  double lattice_value(Node node);
  [[nodiscard]] Vec2 flat_of(const Vec3& p) const { return {(p - origin_).dot(frame_x_), (p - origin_).dot(frame_y_)}; }
  Index add_border_point(const Vec3& position, Index vertex, bool fixed);
  Index crossing(Node inside, Node outside, Index& slot);
  void march_cell(const std::array<Node, 3>& node, const std::array<Index*, 3>& slot);
  void bow(Index from, Index to, const std::array<Node, 3>& node);
  Index point_beside(Index from, Index to, const std::array<Node, 3>& node);
  void stay_in_polygon();
  void triangulate(Index tet, double area);
  void keep(const std::array<Index, 3>& triangle, Index tet);

  std::unique_ptr<LocalSolid> solid_;
  double edge_length_;
  std::vector<Vec3> vertices_;
  std::vector<double> value_;      // NaN: not asked for yet
  std::vector<std::int8_t> side_;  // 1 inside, 0 outside
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Index> triangle_tet_;
  EdgeMap edge_of_;
  std::vector<Edge> edges_;
  std::vector<Cut> cuts_;
  std::vector<double> samples_;
  double cut_away_ = 0.0;

  // Of the edge and the polygon at hand.
  std::vector<std::int8_t> edge_side_;
  std::vector<double> edge_value_;
  RowLattice lattice_;
  Vec3 origin_ = Vec3::Zero(), frame_x_ = Vec3::UnitX(), frame_y_ = Vec3::UnitY();
  std::array<Vec2, 4> flat_corners_;
  double straight_length_ = 0.0;  // of the border, between two of its points
  std::vector<BorderPoint> border_;
  std::vector<Vec2> flat_, evened_;  // where they are in the polygon's plane, and where they go
  std::vector<char> fixed_;
  std::vector<std::array<Index, 2>> perimeter_;  // border point, and whether the edge after it is inside
};

}  // namespace curvesup
