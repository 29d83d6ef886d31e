#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "curvesup/solid/solid.h"
#include "trim/edge_map.h"

namespace curvesup {

// Refines the triangles of one sheet where the solid's surface passes and keeps what lies inside.
class SheetCutter {
 public:
  SheetCutter(const Solid& solid, double edge_length_mm) : solid_(solid), edge_length_(edge_length_mm) {}

  // Vertices get the ids 0, 1, 2, ...; a vertex that two triangles share must be added once.
  Index add_vertex(const Vec3& position);
  // Adds what of the triangle lies inside. Its parts get the same tet.
  void add_triangle(const std::array<Index, 3>& corners, Index tet);
  // Whether any point between two vertices may be inside the solid; never wrongly false.
  [[nodiscard]] bool may_be_inside(Index a, Index b) const;

  [[nodiscard]] const std::vector<Vec3>& vertices() const { return vertices_; }
  [[nodiscard]] const std::vector<std::array<Index, 3>>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<Index>& triangle_tet() const { return triangle_tet_; }
  [[nodiscard]] double cut_away_area() const { return cut_away_; }

 private:
  using Corners = std::array<Index, 3>;
  struct Pending {
    Corners corners;
    int depth;
  };
  [[nodiscard]] double area(const Corners& t) const;
  double value(Index vertex);
  bool inside(Index vertex);
  // What becomes of an edge: the id of its midpoint where it has to be split, else one of the two below.
  static constexpr Index kWhole = -1;    // short enough, or inside
  static constexpr Index kOutside = -2;  // and so is any triangle whose longest edge it is
  Index decide(Index a, Index b);
  void refine(const Corners& t, const std::array<Index, 3>& midpoints, int depth);
  void cut(const Corners& t, Index tet);
  Index cut_point(Index inside, Index outside);
  Index border_point(Index from, Index p, Index q, Index edge_a, Index edge_b);
  void keep(const Corners& t, Index tet);

  const Solid& solid_;
  double edge_length_;
  std::vector<Vec3> vertices_;
  static constexpr std::int8_t kUnknownSide = -1;
  std::vector<double> value_;       // NaN: not asked for yet
  std::vector<std::int8_t> side_;   // 1 inside, 0 outside
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<Index> triangle_tet_;
  std::vector<Pending> pending_;
  EdgeMap midpoints_, cuts_;
  double cut_away_ = 0.0;
};

}  // namespace curvesup
