#include "trim/polygon.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace curvesup {

namespace {

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }
double twice_area(const Vec2& a, const Vec2& b, const Vec2& c) { return cross(b - a, c - a); }

double distance2_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * along).squaredNorm();
}

// Marks what stays of the points strictly between places `first` and `last` of a closed loop: from each one that stays on
// to the farthest one that a straight line reaches within the tolerance of all points between.
void mark_chain(std::span<const Vec2> points, const Loop& loop, std::size_t first, std::size_t last, double tolerance2,
                std::vector<char>& stays) {
  const auto at = [&](std::size_t place) -> const Vec2& { return points[loop[place % loop.size()]]; };
  const auto straight = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from + 1; i < to; ++i) {
      if (distance2_to_segment(at(i), at(from), at(to)) > tolerance2) return false;
    }
    return true;
  };
  while (first + 1 < last) {
    std::size_t next = first + 1;
    while (next < last && straight(first, next + 1)) ++next;
    if (next < last) stays[next % loop.size()] = 1;
    first = next;
  }
}

// Of the places from `first` to `last` of a closed loop those between them that stay are moved so that the border over them
// encloses what it did with all points. A round border loses two thirds of the tolerance's strip by straight lines otherwise.
void restore_area(std::span<const Vec2> points, const Loop& loop, std::size_t first, std::size_t last, double most,
                  const std::vector<char>& stays, std::span<Vec2> moved) {
  const auto at = [&](std::size_t place) -> const Vec2& { return points[loop[place % loop.size()]]; };
  const Vec2& origin = at(first);
  double lost2 = 0.0, width = 0.0;  // twice the area; and twice what a step outwards adds
  std::size_t before = first, here = first;
  for (std::size_t i = first + 1; i <= last; ++i) {
    lost2 += cross(at(i - 1) - origin, at(i) - origin);
    if (i != last && !stays[i % loop.size()]) continue;
    lost2 -= cross(at(here) - origin, at(i) - origin);
    if (here != first) width += (at(i) - at(before)).norm();
    before = std::exchange(here, i);
  }
  if (!(width > 0.0)) return;
  const double out = std::clamp(lost2 / width, -most, most);
  before = here = first;
  for (std::size_t i = first + 1; i <= last; ++i) {
    if (i != last && !stays[i % loop.size()]) continue;
    const Vec2 along = at(i) - at(before);
    const double length = along.norm();
    if (here != first && length > 0.0) moved[loop[here % loop.size()]] += out / length * Vec2(along.y(), -along.x());
    before = std::exchange(here, i);
  }
}

bool is_inside(std::span<const Vec2> points, const Loop& loop, const Vec2& p) {
  bool inside = false;
  for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
    const Vec2 &a = points[loop[i]], &b = points[loop[j]];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y())) inside = !inside;
  }
  return inside;
}

bool segments_cross(const Vec2& a, const Vec2& b, const Vec2& c, const Vec2& d) {
  return (twice_area(a, b, c) > 0.0) != (twice_area(a, b, d) > 0.0) &&
         (twice_area(c, d, a) > 0.0) != (twice_area(c, d, b) > 0.0);
}

// Whether p lies in the corner that the loop makes at place i.
bool in_corner(std::span<const Vec2> points, const Loop& loop, std::size_t i, const Vec2& p) {
  const Vec2 &before = points[loop[(i + loop.size() - 1) % loop.size()]], &at = points[loop[i]],
             &after = points[loop[(i + 1) % loop.size()]];
  const bool left_in = twice_area(before, at, p) >= 0.0, left_out = twice_area(at, after, p) >= 0.0;
  return twice_area(before, at, after) >= 0.0 ? left_in && left_out : left_in || left_out;
}

// Joins a hole to its outer loop by the shortest bridge from the hole's rightmost point that crosses nothing.
void bridge(std::span<const Vec2> points, const std::vector<Loop>& holes, const Loop& hole, Loop& outer) {
  const std::size_t from = std::max_element(hole.begin(), hole.end(), [&](Index a, Index b) {
                             return points[a].x() < points[b].x();
                           }) - hole.begin();
  const Vec2& start = points[hole[from]];
  const auto blocked = [&](const Loop& loop, const Vec2& end) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec2 &a = points[loop[i]], &b = points[loop[(i + 1) % loop.size()]];
      if (a == start || b == start || a == end || b == end) continue;
      if (segments_cross(start, end, a, b)) return true;
    }
    return false;
  };
  std::size_t best = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < outer.size(); ++i) {
    const Vec2& end = points[outer[i]];
    const double distance = (end - start).squaredNorm();
    if (distance >= nearest || !in_corner(points, outer, i, start) || blocked(outer, end)) continue;
    if (std::any_of(holes.begin(), holes.end(), [&](const Loop& other) { return blocked(other, end); })) continue;
    nearest = distance;
    best = i;
  }
  Loop joined(outer.begin(), outer.begin() + best + 1);
  for (std::size_t i = 0; i <= hole.size(); ++i) joined.push_back(hole[(from + i) % hole.size()]);
  joined.insert(joined.end(), outer.begin() + best, outer.end());
  outer = std::move(joined);
}

// Cuts ears off one simple loop, the best shaped one first.
class EarClipper {
 public:
  EarClipper(std::span<const Vec2> points, const Loop& loop, std::vector<std::array<Index, 3>>& triangles)
      : points_(points), loop_(loop), triangles_(triangles), places_(loop.size()) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      places_[i].next = (i + 1) % loop.size();
      places_[i].previous = (i + loop.size() - 1) % loop.size();
    }
    for (std::size_t i = 0; i < loop.size(); ++i) find_corner(i);
  }

  void run() {
    std::size_t left = loop_.size(), any = 0;
    const auto score_all = [&] {
      std::size_t i = any;
      do places_[i].score = score(i), i = next(i);
      while (i != any);
    };
    if (left > 3) score_all();
    while (left > 3) {
      std::size_t ear = best(any);
      if (places_[ear].score <= 0.0) {  // what blocked an ear may be gone by now
        score_all();
        ear = best(any);
      }
      clip(ear);
      any = next(ear);
      --left;
      for (const std::size_t i : {previous(ear), any}) find_corner(i);
      for (const std::size_t i : {previous(ear), any}) places_[i].score = score(i);
    }
    if (left == 3) triangles_.push_back({loop_[previous(any)], loop_[any], loop_[next(any)]});
  }

 private:
  // Of the loop that is left.
  struct Place {
    std::size_t next = 0, previous = 0;
    double twice_area = 0.0;  // of the corner there
    double score = 0.0;
  };

  [[nodiscard]] const Vec2& at(std::size_t place) const { return points_[loop_[place]]; }
  [[nodiscard]] std::size_t next(std::size_t place) const { return places_[place].next; }
  [[nodiscard]] std::size_t previous(std::size_t place) const { return places_[place].previous; }

  void find_corner(std::size_t place) {
    places_[place].twice_area = twice_area(at(previous(place)), at(place), at(next(place)));
  }

  [[nodiscard]] std::size_t best(std::size_t any) const {
    std::size_t ear = any;
    for (std::size_t i = next(any); i != any; i = next(i)) {
      if (places_[i].score > places_[ear].score) ear = i;
    }
    return ear;
  }

  void clip(std::size_t ear) {
    triangles_.push_back({loop_[previous(ear)], loop_[ear], loop_[next(ear)]});
    places_[previous(ear)].next = next(ear);
    places_[next(ear)].previous = previous(ear);
  }

  // Shape of the ear at a place, 1 for an equilateral triangle; 0 or less: no ear, the more so the more it is turned over.
  static constexpr double kBlocked = -2.0;  // another point lies in it
  static constexpr double kSpike = 2.0;     // there and back again: goes first
  [[nodiscard]] double score(std::size_t place) const {
    const Vec2 &a = at(previous(place)), &b = at(place), &c = at(next(place));
    if (a == c) return kSpike;
    const double area = places_[place].twice_area;
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    const double shape = sides > 0.0 ? 2.0 * std::sqrt(3.0) * area / sides : 0.0;
    if (area <= 0.0) return shape;
    for (std::size_t i = next(next(place)); i != previous(place); i = next(i)) {
      if (places_[i].twice_area > 0.0) continue;  // where one like that lies in the ear, so does one that is turned over
      const Vec2& p = at(i);
      if (twice_area(a, b, p) < 0.0 || twice_area(b, c, p) < 0.0 || twice_area(c, a, p) < 0.0) continue;
      if (p != a && p != b && p != c) return kBlocked;
    }
    return shape;
  }

  std::span<const Vec2> points_;
  const Loop& loop_;
  std::vector<std::array<Index, 3>>& triangles_;
  std::vector<Place> places_;
};

}  // namespace

double loop_area(std::span<const Vec2> points, std::span<const Index> loop) {
  double twice = 0.0;
  for (std::size_t i = 2; i < loop.size(); ++i) twice += twice_area(points[loop[0]], points[loop[i - 1]], points[loop[i]]);
  return 0.5 * twice;
}

void simplify_loop(std::span<const Vec2> points, const std::vector<char>& fixed, double tolerance, Loop& loop,
                   std::span<Vec2> moved) {
  if (loop.size() < 3) return;
  std::vector<char> stays(loop.size());
  std::vector<std::size_t> ends;
  ends.reserve(loop.size());
  for (std::size_t i = 0; i < loop.size(); ++i) {
    stays[i] = fixed[loop[i]];
    if (stays[i]) ends.push_back(i);
  }
  if (ends.size() < 2) {  // nothing holds the loop: its first point and the one farthest from that do
    if (ends.empty()) ends.push_back(0);
    std::size_t farthest = ends[0];
    double most = 0.0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const double distance2 = (points[loop[i]] - points[loop[ends[0]]]).squaredNorm();
      if (distance2 > most) most = distance2, farthest = i;
    }
    if (farthest != ends[0]) ends.push_back(farthest);
    std::sort(ends.begin(), ends.end());
    for (const std::size_t i : ends) stays[i] = 1;
  }
  for (std::size_t e = 0; e < ends.size(); ++e) {
    const std::size_t last = e + 1 < ends.size() ? ends[e + 1] : ends[0] + loop.size();
    mark_chain(points, loop, ends[e], last, tolerance * tolerance, stays);
    restore_area(points, loop, ends[e], last, tolerance, stays, moved);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (stays[i]) loop[kept++] = loop[i];
  }
  loop.resize(kept);
}

std::vector<std::array<Index, 3>> triangulate_loops(std::span<const Vec2> points, const std::vector<Loop>& all) {
  std::vector<std::array<Index, 3>> triangles;
  std::size_t points_of_all = 0;
  for (const Loop& loop : all) points_of_all += loop.size() + 2;  // a bridge makes two more
  triangles.reserve(points_of_all);
  if (all.size() == 1 && all[0].size() >= 3 && loop_area(points, all[0]) >= 0.0) {
    EarClipper(points, all[0], triangles).run();
    return triangles;
  }
  std::vector<Loop> loops = all;
  const auto first_hole = std::stable_partition(loops.begin(), loops.end(),
                                                [&](const Loop& loop) { return loop_area(points, loop) >= 0.0; });
  std::vector<Loop> holes(std::make_move_iterator(first_hole), std::make_move_iterator(loops.end()));
  loops.erase(first_hole, loops.end());
  // From right to left, so that no bridge has to pass a hole that is not joined yet.
  const auto right = [&](const Loop& loop) {
    double x = -std::numeric_limits<double>::infinity();
    for (const Index p : loop) x = std::max(x, points[p].x());
    return x;
  };
  std::stable_sort(holes.begin(), holes.end(), [&](const Loop& a, const Loop& b) { return right(a) > right(b); });
  for (const Loop& hole : holes) {
    const auto outer = std::find_if(loops.begin(), loops.end(), [&](const Loop& loop) {
      return loop.size() >= 3 && is_inside(points, loop, points[hole[0]]);
    });
    if (outer != loops.end()) bridge(points, holes, hole, *outer);
  }
  for (const Loop& loop : loops) {
    if (loop.size() >= 3) EarClipper(points, loop, triangles).run();
  }
  return triangles;
}

}  // namespace curvesup
