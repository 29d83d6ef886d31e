#include "trim/sheet_cutter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// The ball around the middle of a triangle's longest edge that holds the triangle: the third corner is at most
// sqrt(3) / 2 of that edge away.
constexpr double kCoveringRadius = 0.8660254037844388;
// Edges inside the solid need not be shorter than this many times the wanted length.
constexpr double kInsideEdges = 4.0;
// An edge may be as long as this part of the radius of the thinnest strut near it.
constexpr double kEdgePerRadius = 0.5;
// Halving a triangle more often than this makes slivers thinner than rounding along an edge that stays whole.
constexpr int kMaxDepth = 40;
constexpr double kRootTolerance_mm = 1e-5;
// A border that leaves its chord by less is left straight.
constexpr double kFlatBorder_mm = 2e-3;

// Root of the solid between a point inside (value >= 0) and one outside, by regula falsi with the Illinois rule; a guess
// nearer than the tolerance to an end of the bracket is moved off it, which closes the bracket from the other side. Bisection
// wherever four steps have not made it eight times shorter. The point returned is the inside end of the last bracket.
Vec3 root_between(const Solid& solid, const Vec3& inside, double inside_value, const Vec3& outside, double outside_value) {
  const Vec3 along = outside - inside;
  const double length = along.norm();
  const double least = 0.45 * kRootTolerance_mm / std::max(length, kRootTolerance_mm);
  double low = 0.0, high = 1.0, low_value = inside_value, high_value = outside_value;
  double wide = 1.0;
  int last_side = 0;
  for (int i = 0; i < 80 && (high - low) * length > kRootTolerance_mm; ++i) {
    const double slope = low_value - high_value;
    double t = slope > 0.0 ? low + (high - low) * low_value / slope : 0.5 * (low + high);
    t = std::clamp(t, low + least, high - least);
    if (i % 4 == 3) {
      if (high - low > 0.125 * wide || !(t > low && t < high)) t = 0.5 * (low + high);
      wide = high - low;
    }
    const double v = solid.value(inside + t * along);
    if (v >= 0.0) {
      low = t;
      low_value = v;
      if (last_side == 1) high_value *= 0.5;
      last_side = 1;
      if (v == 0.0) break;
    } else {
      high = t;
      high_value = v;
      if (last_side == -1) low_value *= 0.5;
      last_side = -1;
    }
  }
  return inside + low * along;
}

}  // namespace

Index SheetCutter::add_vertex(const Vec3& position) {
  vertices_.push_back(position);
  value_.push_back(kUnknown);
  side_.push_back(kUnknownSide);
  return static_cast<Index>(vertices_.size()) - 1;
}

double SheetCutter::value(Index vertex) {
  if (std::isnan(value_[vertex])) value_[vertex] = solid_.value(vertices_[vertex]);
  return value_[vertex];
}

bool SheetCutter::inside(Index vertex) {
  if (side_[vertex] == kUnknownSide) side_[vertex] = solid_.inside(vertices_[vertex]);
  return side_[vertex] == 1;
}

double SheetCutter::area(const Corners& t) const { return triangle_area(vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]); }

void SheetCutter::keep(const Corners& t, Index tet) {
  triangles_.push_back(t);
  triangle_tet_.push_back(tet);
}

bool SheetCutter::may_be_inside(Index a, Index b) const {
  const Vec3 middle = 0.5 * (vertices_[a] + vertices_[b]);
  return !solid_.surely_outside(middle, 0.5 * (vertices_[b] - vertices_[a]).norm());
}

void SheetCutter::add_triangle(const std::array<Index, 3>& corners, Index tet) {
  pending_.assign(1, {corners, 0});
  while (!pending_.empty()) {
    const auto [t, depth] = pending_.back();
    pending_.pop_back();
    std::array<Index, 3> edge{};  // from corner c to the next
    double longest2 = 0.0;
    int longest = 0;
    for (int c = 0; c < 3; ++c) {
      const double length2 = (vertices_[t[(c + 1) % 3]] - vertices_[t[c]]).squaredNorm();
      if (length2 > longest2) longest = c;
      longest2 = std::max(longest2, length2);
      edge[c] = decide(t[c], t[(c + 1) % 3]);
    }
    if (edge[longest] == kOutside) {
      cut_away_ += area(t);
    } else if (depth < kMaxDepth && (edge[0] >= 0 || edge[1] >= 0 || edge[2] >= 0)) {
      refine(t, edge, depth + 1);
    } else {
      cut(t, tet);
    }
  }
}

// The decision hangs on the edge alone: longer than wanted, and the solid's surface may be within the ball that covers any
// triangle whose longest edge it is. So both triangles at an edge agree, and no triangle that the solid meets from outside
// stays large. What is wanted grows with the thinnest strut that reaches into that ball. Inside, an edge of moderate length
// stays whole when its ends and its middle are inside: struts are convex, so all that this can overlook is a notch or a hole
// narrower than half the edge.
Index SheetCutter::decide(Index a, Index b) {
  const double length = (vertices_[b] - vertices_[a]).norm();
  if (length <= edge_length_) return kWhole;
  const auto slot = midpoints_.at(a, b);
  if (!slot.is_new) return slot.value;
  const Vec3 middle = 0.5 * (vertices_[a] + vertices_[b]);
  const double radius = kCoveringRadius * length;
  const auto short_enough = [&](double wanted) {
    return wanted <= edge_length_ || !solid_.may_be_thinner(middle, radius, wanted / kEdgePerRadius);
  };
  // Points cost less than bounds: where an end is inside, no bound can prove the ball outside.
  const bool a_inside = inside(a), b_inside = inside(b);
  std::int8_t middle_side = kUnknownSide;
  if (a_inside && b_inside) {
    if (short_enough(length / kInsideEdges)) {
      middle_side = solid_.inside(middle);
      if (middle_side == 1) return slot.value = kWhole;
    }
  } else if (!a_inside && !b_inside && solid_.surely_outside(middle, radius)) {
    return slot.value = kOutside;
  }
  if (short_enough(length)) return slot.value = kWhole;
  slot.value = add_vertex(middle);
  side_.back() = middle_side;
  return slot.value;
}

void SheetCutter::refine(const Corners& t, const std::array<Index, 3>& m, int depth) {
  int splits = 0, last = 0, whole = 0;
  for (int c = 0; c < 3; ++c) {
    if (m[c] < 0) {
      whole = c;
    } else {
      last = c;
      ++splits;
    }
  }
  if (splits == 3) {
    pending_.insert(pending_.end(), {{{m[0], m[1], m[2]}, depth},
                                      {{t[2], m[2], m[1]}, depth},
                                      {{t[1], m[1], m[0]}, depth},
                                      {{t[0], m[0], m[2]}, depth}});
  } else if (splits == 1) {
    const Index a = t[last], b = t[(last + 1) % 3], c = t[(last + 2) % 3];
    pending_.insert(pending_.end(), {{{m[last], b, c}, depth}, {{a, m[last], c}, depth}});
  } else {
    // a -> b is the whole edge, c the corner opposite it.
    const Index a = t[whole], b = t[(whole + 1) % 3], c = t[(whole + 2) % 3];
    const Index p = m[(whole + 1) % 3], q = m[(whole + 2) % 3];
    if ((vertices_[a] - vertices_[p]).squaredNorm() <= (vertices_[b] - vertices_[q]).squaredNorm()) {
      pending_.insert(pending_.end(), {{{c, q, p}, depth}, {{a, p, q}, depth}, {{a, b, p}, depth}});
    } else {
      pending_.insert(pending_.end(), {{{c, q, p}, depth}, {{b, p, q}, depth}, {{a, b, q}, depth}});
    }
  }
}

// Where the edge from a vertex inside to one outside leaves the solid.
Index SheetCutter::cut_point(Index inside, Index outside) {
  const auto slot = cuts_.at(inside, outside);
  if (slot.is_new) {
    const Vec3 root =
        root_between(solid_, vertices_[inside], value(inside), vertices_[outside], value(outside));
    slot.value = add_vertex(root);
    side_.back() = 1;
  }
  return slot.value;
}

// One more root between the cut points p and q of a triangle, on the line from its corner `from` through the middle of pq to
// the opposite edge: it stays inside the triangle, so neighbours need not know. kNone where the border is straight enough.
Index SheetCutter::border_point(Index from, Index p, Index q, Index edge_a, Index edge_b) {
  const Vec3 middle = 0.5 * (vertices_[p] + vertices_[q]);
  const Vec3& corner = vertices_[from];
  const Vec3 direction = middle - corner;
  const double chord = (vertices_[q] - vertices_[p]).norm();
  const double reach = direction.norm();
  if (chord <= 4.0 * kFlatBorder_mm || reach <= kFlatBorder_mm) return kNone;
  const double middle_value = solid_.value(middle);
  // Towards the corner the line ends there; away from it, just before the opposite edge, or half a chord further.
  const bool corner_inside = inside(from);
  const bool towards_corner = corner_inside != (middle_value >= 0.0);
  Vec3 end = corner + 0.05 * direction;
  if (!towards_corner) {
    const Vec3 normal = direction.cross(vertices_[edge_b] - vertices_[edge_a]);
    const Vec3 side = normal.cross(vertices_[edge_b] - vertices_[edge_a]);  // in the plane, across the opposite edge
    const double along = side.dot(direction);
    if (along == 0.0) return kNone;
    const double to_edge = side.dot(vertices_[edge_a] - middle) / along;
    if (!(to_edge > 0.0)) return kNone;
    end = middle + std::min(0.95 * to_edge, 0.5 * chord / reach) * direction;
  }
  const double end_value = solid_.value(end);
  if ((end_value >= 0.0) == (middle_value >= 0.0)) return kNone;
  const Vec3 root = middle_value >= 0.0 ? root_between(solid_, middle, middle_value, end, end_value)
                                        : root_between(solid_, end, end_value, middle, middle_value);
  if ((root - middle).squaredNorm() < kFlatBorder_mm * kFlatBorder_mm) return kNone;
  return add_vertex(root);
}

void SheetCutter::cut(const Corners& t, Index tet) {
  int count = 0;
  std::array<bool, 3> in{};
  for (int c = 0; c < 3; ++c) {
    in[c] = inside(t[c]);
    count += in[c];
  }
  if (count == 3) {
    keep(t, tet);
    return;
  }
  if (count == 0) {
    cut_away_ += area(t);
    return;
  }
  // Turn the triangle so that the corner that is alone on its side comes first.
  const bool alone_inside = count == 1;
  const int first = in[0] == alone_inside && in[1] != alone_inside && in[2] != alone_inside ? 0
                    : in[1] == alone_inside && in[2] != alone_inside                        ? 1
                                                                                            : 2;
  const Index a = t[first], b = t[(first + 1) % 3], c = t[(first + 2) % 3];
  const Index p = alone_inside ? cut_point(a, b) : cut_point(b, a);
  const Index q = alone_inside ? cut_point(a, c) : cut_point(c, a);
  const Index r = border_point(a, p, q, b, c);

  std::array<Corners, 2> tip{};   // between a and the border
  std::array<Corners, 3> base{};  // between the border and bc
  int tips = 0, bases = 0;
  if (r == kNone) {
    tip[tips++] = {a, p, q};
    if ((vertices_[p] - vertices_[c]).squaredNorm() <= (vertices_[q] - vertices_[b]).squaredNorm()) {
      base[bases++] = {p, b, c};
      base[bases++] = {p, c, q};
    } else {
      base[bases++] = {p, b, q};
      base[bases++] = {b, c, q};
    }
  } else {
    tip[tips++] = {a, p, r};
    tip[tips++] = {a, r, q};
    base[bases++] = {p, b, r};
    base[bases++] = {b, c, r};
    base[bases++] = {c, q, r};
  }
  for (int i = 0; i < tips; ++i) alone_inside ? keep(tip[i], tet) : void(cut_away_ += area(tip[i]));
  for (int i = 0; i < bases; ++i) alone_inside ? void(cut_away_ += area(base[i])) : keep(base[i], tet);
}

}  // namespace curvesup
