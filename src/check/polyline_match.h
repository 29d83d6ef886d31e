#pragma once

#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup::emitted {

// Where a vertex of one polyline lies on another one, and what of the other one is passed on the way to it.
struct PolylinePlace {
  std::size_t segment = 1;  // the one that ends at this point of the source
  double share = 0.0;
  double distance = 0.0;  // of the vertex from its place
  double aside = 0.0;     // of the farthest source point between the place before and this one from the emitted segment
};

// How far two polylines may be apart.
struct PolylineLimits {
  double vertex = 0.0;  // a vertex of the emitted one from the source
  double aside = 0.0;   // a point of the source from the emitted one
};

// Walks `emitted` along `source`: places[i] is that of emitted[i], no place lies before the one of the vertex before, and
// emitted[0] lies at the source's start. A source that turns back upon itself passes some places more than once, so the
// nearest place need not be the right one: where the first places that fit lead outside the limits, all are tried, and
// the walk whose worst excess over the limits is least is returned. Source: two points or more.
// Cost: linear; on the second try, times the number of places within reach of a vertex, 32 at most.
[[nodiscard]] std::vector<PolylinePlace> match_polylines(std::span<const Vec3> source, std::span<const Vec3> emitted,
                                                         const PolylineLimits& limits);

}  // namespace curvesup::emitted
