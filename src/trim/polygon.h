#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

using Vec2 = Eigen::Vector2d;
// Ids into a list of points; closed, the region on its left: outer loops run counter-clockwise, holes clockwise.
using Loop = std::vector<Index>;

[[nodiscard]] double loop_area(std::span<const Vec2> points, std::span<const Index> loop);

// Removes points that lie within `tolerance` of the straight line between those that stay. Points for
// which `fixed` is true stay. What is left of a loop without area may have fewer than three points.
// `moved`, as long as `points`, gets places for the others that stay at which the loop has the area it had before: between
// two fixed points all of them go out, or in, by one distance, at most the tolerance.
void simplify_loop(std::span<const Vec2> points, const std::vector<char>& fixed, double tolerance, Loop& loop,
                   std::span<Vec2> moved);

// Triangles that fill the region of the loops, counter-clockwise, well shaped ones preferred (ear clipping, holes joined to
// their outer loop by bridges). Every point of a loop is a corner. Where loops touch or cross by rounding, triangles
// without area make up for it. O(n^2) for n points.
[[nodiscard]] std::vector<std::array<Index, 3>> triangulate_loops(std::span<const Vec2> points, const std::vector<Loop>& all);

}  // namespace curvesup
