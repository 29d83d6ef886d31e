#include "trim/coarsen.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

// A line along which a border vertex goes runs at no smaller slant to the border, as a sine.
constexpr double kSlant = 0.2;
constexpr double kSmallest = 1e-12;  // areas, volumes

class Segment {
 public:
  Segment(const Vec3& a, const Vec3& b) : a_(a), along_(b - a), length2_(along_.squaredNorm()) {}
  [[nodiscard]] bool within(const Vec3& p, double distance2) const {
    const Vec3 offset = p - a_;
    const double dot = offset.dot(along_), offset2 = offset.squaredNorm();
    if (dot <= 0.0) return offset2 <= distance2;
    if (dot >= length2_) return offset2 - 2.0 * dot + length2_ <= distance2;
    return (offset2 - distance2) * length2_ <= dot * dot;
  }

 private:
  Vec3 a_, along_;
  double length2_;
};

// The plane of the layer in one tet.
struct Plane {
  Vec3 normal = Vec3::Zero();  // unit
  double offset = 0.0;
  double thickness = 0.0;  // 1 / |grad G|
  [[nodiscard]] double distance(const Vec3& p) const { return std::abs(normal.dot(p) - offset); }
};

class Coarsener {
 public:
  Coarsener(TrimmedSheet& sheet, std::span<const Vec3> gradient, const CoarsenOptions& options)
      : sheet_(sheet), options_(options), at_(sheet.vertices), corners_(sheet.triangles) {
    find_planes(gradient);
    find_rings();
    find_border();
    stamp_.assign(at_.size(), 0);
    freedom_.resize(at_.size());
    planes_of_.assign(at_.size(), {kNone, kNone});
    along_.resize(at_.size());
    for (Index v = 0; v < static_cast<Index>(at_.size()); ++v) {
      if (!on_border(v)) continue;
      freedom_[v] = fixed_[v] ? Freedom::fixed : Freedom::plane;
      find_freedom(v);
    }
  }

  CoarsenReport run() {
    sweep_border();
    sweep_inside();
    remove_dead_triangles();
    for (std::size_t t = 0; t < corners_.size(); ++t) {
      const double area = sheet_.area(t);
      report_.area_after_mm2 += area;
      report_.volume_after += area * planes_[plane_of_[t]].thickness;
    }
    return report_;
  }

 private:
  // The triangles around a vertex: a range of ring_, in which dead ones may linger.
  struct Ring {
    std::size_t first = 0;
    Index count = 0;
  };
  // How far a vertex may go: anywhere in the one plane of its triangles, along the line of its two, or nowhere.
  enum class Freedom : std::uint8_t { plane, line, none, fixed };

  void find_planes(std::span<const Vec3> gradient) {
    std::vector<Index> tets = sheet_.triangle_tet;
    tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
    std::sort(tets.begin(), tets.end());
    tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
    planes_.resize(tets.size());
    std::vector<double> area(tets.size(), 0.0);
    plane_of_.resize(corners_.size());
    for (std::size_t t = 0; t < corners_.size(); ++t) {
      const bool same = t > 0 && sheet_.triangle_tet[t] == sheet_.triangle_tet[t - 1];
      const Index p = same ? plane_of_[t - 1]
                           : static_cast<Index>(std::lower_bound(tets.begin(), tets.end(), sheet_.triangle_tet[t]) - tets.begin());
      plane_of_[t] = p;
      const Vec3& g = gradient[sheet_.triangle_tet[t]];
      Plane& plane = planes_[p];
      if (!same) {
        plane.normal = g.normalized();
        plane.thickness = 1.0 / g.norm();
      }
      const auto& [a, b, c] = corners_[t];
      const double weight = triangle_area(at_[a], at_[b], at_[c]) + std::numeric_limits<double>::min();
      report_.area_before_mm2 += weight;
      report_.volume_before += weight * plane.thickness;
      area[p] += weight;
      plane.offset += weight / 3.0 * plane.normal.dot(at_[a] + at_[b] + at_[c]);
    }
    for (std::size_t p = 0; p < planes_.size(); ++p) planes_[p].offset /= area[p];
    most_drift_ = 2.0 * options_.volume * report_.volume_before;
  }

  void find_rings() {
    rings_.assign(at_.size(), {});
    for (const auto& t : corners_) {
      for (const Index v : t) ++rings_[v].count;
    }
    std::size_t sum = 0;
    for (Ring& ring : rings_) {
      ring.first = sum;
      sum += ring.count;
      ring.count = 0;
    }
    ring_.reserve(3 * sum);
    ring_.resize(sum);
    for (std::size_t t = 0; t < corners_.size(); ++t) {
      for (const Index v : corners_[t]) ring_[rings_[v].first + rings_[v].count++] = static_cast<Index>(t);
    }
  }

  void find_border() {
    const std::size_t n = at_.size();
    next_.assign(n, kNone);
    previous_.assign(n, kNone);
    fixed_.assign(n, 0);
    place_.assign(n, 0);
    loop_of_.assign(n, kNone);
    surface_error_.assign(n, 0.0);
    // An edge is on the border where nothing runs the other way.
    std::vector<Index> leaves(n, kNone), arrives(n, kNone);
    for (Index v = 0; v < static_cast<Index>(n); ++v) {
      const auto mark = [&](std::vector<Index>& seen, Index w) {
        if (seen[w] == v) fixed_[v] = fixed_[w] = 1;
        seen[w] = v;
      };
      for (const Index t : ring(v)) mark(leaves, corner_after(t, v));
      for (const Index t : ring(v)) {
        const Index u = corner_before(t, v);
        mark(arrives, u);
        if (leaves[u] == v) continue;
        // Where two borders touch.
        if (next_[u] != kNone) fixed_[u] = 1;
        if (previous_[v] != kNone) fixed_[v] = 1;
        next_[u] = v;
        previous_[v] = u;
      }
    }
    for (const auto& [a, b, c] : corners_) {
      if (a == b || b == c || c == a) fixed_[a] = fixed_[b] = fixed_[c] = 1;
    }
    for (std::size_t v = 0; v < n; ++v) {
      if (next_[v] == kNone && previous_[v] == kNone) continue;
      if (next_[v] == kNone || previous_[v] == kNone) fixed_[v] = 1;
      if (sheet_.source[v] == kNone) continue;
      fixed_[v] = 1;
      if (next_[v] != kNone) fixed_[next_[v]] = 1;
      if (previous_[v] != kNone) fixed_[previous_[v]] = 1;
    }
    // A loop that meets a place where it cannot be followed stays as it is.
    for (std::size_t v = 0; v < n; ++v) {
      if (loop_of_[v] != kNone || next_[v] == kNone) continue;
      Loop loop{border_points_.size(), 0};
      Index u = static_cast<Index>(v);
      do {
        loop_of_[u] = static_cast<Index>(loops_.size());
        place_[u] = static_cast<Index>(border_points_.size() - loop.first);
        border_points_.push_back(at_[u]);
        u = next_[u];
      } while (u != kNone && loop_of_[u] == kNone);
      loop.count = static_cast<Index>(border_points_.size() - loop.first);
      const bool closed = u == static_cast<Index>(v);
      for (Index w = static_cast<Index>(v), i = 0; !closed && i < loop.count; ++i, w = next_[w]) fixed_[w] = 1;
      loops_.push_back(loop);
    }
  }

  [[nodiscard]] bool on_border(Index v) const { return next_[v] != kNone || previous_[v] != kNone; }
  [[nodiscard]] bool alive(Index triangle) const { return corners_[triangle][0] != kNone; }
  [[nodiscard]] bool has(Index triangle, Index v) const {
    const auto& [a, b, c] = corners_[triangle];
    return a == v || b == v || c == v;
  }
  [[nodiscard]] Index corner_after(Index triangle, Index v) const {
    const auto& [a, b, c] = corners_[triangle];
    return v == a ? b : v == b ? c : a;
  }
  [[nodiscard]] Index corner_before(Index triangle, Index v) const {
    const auto& [a, b, c] = corners_[triangle];
    return v == a ? c : v == b ? a : b;
  }
  [[nodiscard]] std::span<const Index> ring(Index v) const { return {ring_.data() + rings_[v].first, static_cast<std::size_t>(rings_[v].count)}; }

  // Drops dead triangles from a ring.
  void clean(Index v) {
    Ring& r = rings_[v];
    Index kept = 0;
    for (Index i = 0; i < r.count; ++i) {
      const Index t = ring_[r.first + i];
      if (alive(t)) ring_[r.first + kept++] = t;
    }
    r.count = kept;
  }

  void sweep_border() {
    for (Index v = 0; v < static_cast<Index>(at_.size()); ++v) {
      if (rings_[v].count > 0 && next_[v] != kNone && previous_[v] != kNone) merge_on_border(v, next_[v]);
    }
  }

  void sweep_inside() {
    for (Index v = 0; v < static_cast<Index>(at_.size()); ++v) {
      if (rings_[v].count > 0 && !on_border(v) && !fixed_[v]) merge_inside(v);
    }
  }

  // What a vertex may do, by the triangles that it has now.
  void find_freedom(Index v) {
    Freedom& freedom = freedom_[v];
    const bool fixed = freedom == Freedom::fixed;
    Index first = kNone, second = kNone;
    freedom = Freedom::plane;
    for (const Index t : ring(v)) {
      const Index p = plane_of_[t];
      if (first == kNone || p == first) {
        first = p;
      } else if (second == kNone || p == second) {
        second = p;
        freedom = Freedom::line;
      } else {
        freedom = Freedom::none;
        break;
      }
    }
    planes_of_[v] = {first, second};
    if (fixed) freedom = Freedom::fixed;
    if (freedom != Freedom::line) return;
    along_[v] = line_of(v);
    if (!(along_[v].squaredNorm() > 0.0)) freedom = Freedom::none;
  }

  // The edge between the two planes of a vertex, from there; zero where it cannot be found.
  Vec3 line_of(Index v) {
    const auto [first, second] = planes_of_[v];
    ++now_;
    for (const Index t : ring(v)) {
      if (plane_of_[t] != first) continue;
      for (const Index w : corners_[t]) stamp_[w] = now_;
    }
    for (const Index t : ring(v)) {
      if (plane_of_[t] != second) continue;
      for (const Index w : corners_[t]) {
        if (w != v && stamp_[w] == now_) return at_[w] - at_[v];
      }
    }
    return Vec3::Zero();
  }

  // Neighbours that two vertices have in common.
  int common_neighbours(Index v, Index u) {
    ++now_;
    for (const Index t : ring(v)) {
      for (const Index w : corners_[t]) stamp_[w] = now_;
    }
    int count = 0;
    ++now_;
    for (const Index t : ring(u)) {
      for (const Index w : corners_[t]) {
        if (w == v || w == u || stamp_[w] != now_ - 1) continue;
        stamp_[w] = now_;
        ++count;
      }
    }
    return count;
  }

  bool merge_on_border(Index v, Index u) {
    const Index p = previous_[v], n = next_[u];
    if (p == kNone || n == kNone || p == n || p == u) return false;
    if (next_[p] != v || previous_[n] != u || loop_of_[p] != loop_of_[n]) return false;  // where borders touch
    const Freedom free_v = freedom_[v], free_u = freedom_[u];
    if (free_v == Freedom::fixed && free_u == Freedom::fixed) return false;
    const Vec3 &a = at_[p], &b = at_[v], &c = at_[u], chord = at_[n] - a;
    const bool in_plane = free_v == Freedom::plane && free_u == Freedom::plane;
    const Vec3 normal = in_plane ? planes_[planes_of_[v][0]].normal : mean_normal(v, u), across = chord.cross(normal);
    const double across2 = across.squaredNorm();
    if (!(across2 > kSmallest)) return false;
    // (x - p) . across is twice the area of p x n.
    const double wanted = (b - a).cross(c - a).dot(normal) + (c - a).dot(across);
    const auto missing = [&](const Vec3& x) { return wanted - (x - a).dot(across); };
    if (in_plane) {
      for (const Vec3& base : {Vec3(0.5 * (b + c)), c, b}) {
        if (try_border(p, v, u, n, base + missing(base) / across2 * across)) return true;
      }
      return false;
    }
    const auto keep = [&](bool keep_u) {
      const Vec3& base = keep_u ? c : b;
      if (std::max(free_u, free_v) != Freedom::line) return try_border(p, v, u, n, base, keep_u);
      const Vec3& along = along_[keep_u ? u : v];
      const double rate = along.dot(across);
      if (rate * rate < kSlant * kSlant * across2 * along.squaredNorm()) return false;
      return try_border(p, v, u, n, base + missing(base) / rate * along, keep_u);
    };
    return (free_u >= free_v && keep(true)) || (free_v >= free_u && keep(false));
  }

  [[nodiscard]] Vec3 mean_normal(Index v, Index u) const {
    Vec3 sum = Vec3::Zero();
    for (const Index w : {v, u}) {
      for (const Index p : planes_of_[w]) {
        if (p != kNone) sum += planes_[p].normal;
      }
    }
    return sum.normalized();
  }

  // Merges v and u, its successor on the border, at x if nothing speaks against it.
  bool try_border(Index p, Index v, Index u, Index n, const Vec3& x, bool keep_u = true) {
    if (x.z() < 0.0 && at_[v].z() >= 0.0 && at_[u].z() >= 0.0) return false;
    Index place = 0;
    if (!near_border(p, n, x, place)) return false;
    clean(v);
    clean(u);
    const Index stays = keep_u ? u : v, goes = keep_u ? v : u;
    if (common_neighbours(v, u) != 1) return false;
    const double off = off_planes(goes, stays, x);
    if (off > options_.surface_mm || !can_move(goes, stays, x, around(goes), off)) return false;
    move(goes, stays, x);
    next_[p] = stays;
    previous_[stays] = p;
    next_[stays] = n;
    previous_[n] = stays;
    next_[goes] = previous_[goes] = kNone;
    place_[stays] = place;
    find_freedom(stays);
    return true;
  }

  // Whether the border p x n is within the tolerance of the points that were between p and n at first; `place` becomes that
  // of them that x stands for.
  bool near_border(Index p, Index n, const Vec3& x, Index& place) const {
    const Loop& loop = loops_[loop_of_[p]];
    const auto at_place = [&](Index i) { return i >= loop.count ? i - loop.count : i; };
    const auto point = [&](Index i) -> const Vec3& { return border_points_[loop.first + at_place(i)]; };
    const Index first = place_[p], last = place_[n] > first ? place_[n] : place_[n] + loop.count;
    const Segment to_x(at_[p], x), from_x(x, at_[n]);
    for (Index i = first + 1; i < last; ++i) {
      if (!to_x.within(point(i), border2_) && !from_x.within(point(i), border2_)) return false;
    }
    double nearest = std::numeric_limits<double>::infinity();
    bool beside = false;
    for (Index i = first; i < last; ++i) {
      beside = beside || Segment(point(i), point(i + 1)).within(x, border2_);
      const double distance = (point(i) - x).squaredNorm();
      if (i == first || distance >= nearest) continue;
      nearest = distance;
      place = at_place(i);
    }
    return beside && last > first + 1;
  }

  struct Shape {
    double area = 0.0;  // twice, as seen from above
    double height2 = 0.0;
    bool upright = false;
  };
  [[nodiscard]] static Shape shape(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
    const Vec3 ab = b - a, ac = c - a, twice = ab.cross(ac);
    const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
    const double area = twice.dot(normal), area2 = twice.squaredNorm();
    return {area, longest2 > 0.0 ? area2 / longest2 : 0.0, area > 0.0 && area * area > 0.25 * area2};
  }

  // How far x lies from the planes of the triangles of `goes` that stay; as soon as that is too far, at least how far.
  [[nodiscard]] double off_planes(Index goes, Index stays, const Vec3& x) const {
    double off = 0.0;
    for (const Index t : ring(goes)) {
      if (has(t, stays)) continue;
      off = std::max(off, planes_[plane_of_[t]].distance(x));
      if (off > options_.surface_mm) break;
    }
    return off;
  }

  // The triangles around a vertex as they are.
  struct Around {
    double volume = 0.0;  // twice
    double height2 = std::numeric_limits<double>::infinity();
    double error = 0.0;  // on the surface, the most at a corner
  };
  void add(Index t, Around& around) const {
    const Plane& plane = planes_[plane_of_[t]];
    const auto& [a, b, c] = corners_[t];
    const Shape before = shape(at_[a], at_[b], at_[c], plane.normal);
    around.volume += before.area * plane.thickness;
    around.height2 = std::min(around.height2, before.height2);
    around.error = std::max({around.error, surface_error_[a], surface_error_[b], surface_error_[c]});
  }
  [[nodiscard]] Around around(Index v) const {
    Around around;
    for (const Index t : ring(v)) add(t, around);
    return around;
  }

  // Whether `goes` can be merged into `stays` at x, so far off the planes, as far as their triangles are concerned.
  // least_height_ becomes that of the triangles that they would have.
  bool can_move(Index goes, Index stays, const Vec3& x, Around before, double off) {
    double volume = 0.0, height2 = std::numeric_limits<double>::infinity();
    const auto stays_upright = [&](Index t, Index v) {
      const Plane& plane = planes_[plane_of_[t]];
      const auto& [a, b, c] = corners_[t];
      const Shape after = shape(a == v ? x : at_[a], b == v ? x : at_[b], c == v ? x : at_[c], plane.normal);
      volume += after.area * plane.thickness;
      height2 = std::min(height2, after.height2);
      return after.upright;
    };
    for (const Index t : ring(goes)) {
      if (!has(t, stays) && !stays_upright(t, goes)) return false;
    }
    if (x != at_[stays]) {
      off = std::max(off, off_planes(stays, goes, x));
      if (off > options_.surface_mm) return false;
      for (const Index t : ring(stays)) {
        if (has(t, goes)) continue;
        add(t, before);
        if (!stays_upright(t, stays)) return false;
      }
    }
    if (height2 < std::min(options_.height_mm * options_.height_mm, before.height2)) return false;
    change_ = volume - before.volume;
    if (std::abs(change_) > options_.step_volume * before.volume + kSmallest) return false;
    if (std::abs(drift_ + change_) > std::max(most_drift_, std::abs(drift_))) return false;
    error_after_ = before.error + off;
    if (error_after_ > 2.0 * options_.surface_mm) return false;
    least_height_ = height2;
    return true;
  }

  void move(Index goes, Index stays, const Vec3& x) {
    at_[stays] = x;
    drift_ += change_;
    surface_error_[stays] = error_after_;
    const std::size_t first = ring_.size();
    for (Index i = 0; i < rings_[stays].count; ++i) {
      const Index t = ring_[rings_[stays].first + i];
      if (has(t, goes)) {
        corners_[t] = {kNone, kNone, kNone};
      } else {
        ring_.push_back(t);
      }
    }
    for (Index i = 0; i < rings_[goes].count; ++i) {
      const Index t = ring_[rings_[goes].first + i];
      if (!alive(t)) continue;
      for (Index& w : corners_[t]) {
        if (w == goes) w = stays;
      }
      ring_.push_back(t);
    }
    rings_[stays] = {first, static_cast<Index>(ring_.size() - first)};
    rings_[goes].count = 0;
  }

  // One that lies near enough to the planes around a vertex.
  struct Neighbour {
    Index vertex;
    double off;
  };

  // Moves a vertex inside the sheet to the neighbour that leaves the best triangles.
  void merge_inside(Index v) {
    clean(v);
    neighbours_.clear();
    ++now_;
    stamp_[v] = now_;
    for (const Index t : ring(v)) {
      for (const Index w : corners_[t]) {
        if (stamp_[w] == now_) continue;
        stamp_[w] = now_;
        const double off = off_planes(v, w, at_[w]);  // most vertices are held by the plane of one triangle
        if (off <= options_.surface_mm) neighbours_.push_back({w, off});
      }
    }
    if (neighbours_.empty()) return;
    const Around before = around(v);
    Neighbour best{kNone, 0.0};
    double highest = 0.0;
    for (const Neighbour& u : neighbours_) {
      if (!can_move(v, u.vertex, at_[u.vertex], before, u.off) || least_height_ <= highest) continue;
      clean(u.vertex);
      if (common_neighbours(v, u.vertex) != 2) continue;
      highest = least_height_;
      best = u;
    }
    if (best.vertex == kNone || !can_move(v, best.vertex, at_[best.vertex], before, best.off)) return;
    move(v, best.vertex, at_[best.vertex]);
  }

  void remove_dead_triangles() {
    std::size_t kept = 0;
    const bool pieces = sheet_.triangle_piece.size() == corners_.size();
    for (std::size_t t = 0; t < corners_.size(); ++t) {
      if (corners_[t][0] == kNone) continue;
      corners_[kept] = corners_[t];
      plane_of_[kept] = plane_of_[t];
      sheet_.triangle_tet[kept] = sheet_.triangle_tet[t];
      if (pieces) sheet_.triangle_piece[kept] = sheet_.triangle_piece[t];
      ++kept;
    }
    corners_.resize(kept);
    plane_of_.resize(kept);
    sheet_.triangle_tet.resize(kept);
    if (pieces) sheet_.triangle_piece.resize(kept);
  }

  // The points that a border had at first.
  struct Loop {
    std::size_t first;
    Index count;
  };

  TrimmedSheet& sheet_;
  const CoarsenOptions options_;
  const double border2_ = options_.border_mm * options_.border_mm;
  CoarsenReport report_;
  std::vector<Vec3>& at_;
  std::vector<std::array<Index, 3>>& corners_;  // kNone: gone
  std::vector<Plane> planes_;
  std::vector<Index> plane_of_;  // per triangle
  std::vector<Ring> rings_;
  std::vector<Index> ring_;
  std::vector<Index> next_, previous_;  // along the border, the sheet on the left
  std::vector<char> fixed_;
  std::vector<Vec3> border_points_;
  std::vector<Loop> loops_;
  std::vector<Index> loop_of_, place_;  // per border vertex: which of the points it stands for
  std::vector<double> surface_error_;
  std::vector<Index> stamp_;
  std::vector<Neighbour> neighbours_;
  std::vector<Freedom> freedom_;  // on the border
  std::vector<std::array<Index, 2>> planes_of_;
  std::vector<Vec3> along_;
  Index now_ = 0;
  double least_height_ = 0.0, error_after_ = 0.0, change_ = 0.0;  // of the last pair that was looked at
  double drift_ = 0.0, most_drift_ = 0.0;                         // twice the volume that has come up to now, and may
};

}  // namespace

CoarsenReport coarsen(TrimmedSheet& sheet, std::span<const Vec3> gradient, const CoarsenOptions& options) {
  if (sheet.triangles.empty()) return {};
  return Coarsener(sheet, gradient, options).run();
}

}  // namespace curvesup
