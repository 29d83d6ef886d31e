#include "toolpath/zigzag.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kGain = 1e-5;  // mm
constexpr std::uint8_t kMostVisits = 4;

// Triangles around each vertex.
struct Fans {
  std::vector<Index> first, triangles;

  explicit Fans(const PieceMesh& mesh) : first(mesh.vertices.size() + 1, 0), triangles(3 * mesh.triangles.size()) {
    for (const auto& corners : mesh.triangles) {
      for (const Index v : corners) ++first[v + 1];
    }
    for (std::size_t v = 0; v + 1 < first.size(); ++v) first[v + 1] += first[v];
    std::vector<Index> fill(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const Index v : mesh.triangles[t]) triangles[fill[v]++] = static_cast<Index>(t);
    }
  }
};

// Where a straight front that reaches a and b at the given distances reaches c: by the plane with slope 1 through both, if
// it comes across the edge between them, else along an edge.
double carried_on(const Vec3& a, double at_a, const Vec3& b, double at_b, const Vec3& c) {
  const Vec3 edge = b - a, side = c - a;
  const double length = edge.norm();
  double best = at_a + side.norm();
  if (at_b == kFar) return best;
  best = std::min(best, at_b + (c - b).norm());
  if (length < 1e-9) return best;
  const double along = side.dot(edge) / length, height = std::sqrt(std::max(0.0, side.squaredNorm() - along * along));
  const double slope = (at_b - at_a) / length;
  if (std::abs(slope) >= 1.0) return best;
  const double rise = std::sqrt(1.0 - slope * slope);
  const double from = along - height * slope / rise;  // where the way to c crosses the edge
  if (from < 0.0 || from > length) return best;
  return std::min(best, at_a + slope * along + rise * height);
}

class LineTracer {
 public:
  LineTracer(const BorderDistance& distance, const Ridge& ridge, const ZigzagOptions& options, std::vector<double> values)
      : distance_(distance), mesh_(distance.mesh()), ridge_(ridge), options_(options), values_(std::move(values)) {}

  std::vector<Track> run() {
    assign_slots();
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (Index s = slot_[t]; s < slot_[t + 1]; ++s) {
        if (!done_[s]) trace(static_cast<Index>(t), lowest_[t] + (s - slot_[t]));
      }
    }
    return std::move(lines_);
  }

 private:
  // A place where a line crosses an edge; `inside` is positive where lines may run.
  struct Crossing {
    TrackPoint point;
    double inside = 0.0;
  };

  [[nodiscard]] double value_of(int level) const { return (level + 0.5) * options_.spacing; }

  // One slot for each pair of a triangle and a line that crosses it.
  void assign_slots() {
    const std::size_t n = mesh_.triangles.size();
    slot_.assign(n + 1, 0);
    lowest_.assign(n, 0);
    for (std::size_t t = 0; t < n; ++t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      const auto [low, high] = std::minmax({values_[a], values_[b], values_[c]});
      int first = 0, last = -1;
      if (high < kFar && low > -kFar) {
        first = static_cast<int>(std::floor(low / options_.spacing - 0.5));
        while (value_of(first) <= low) ++first;
        last = static_cast<int>(std::floor(high / options_.spacing - 0.5)) + 1;
        while (value_of(last) > high) --last;
      }
      lowest_[t] = first;
      slot_[t + 1] = slot_[t] + std::max(0, last - first + 1);
    }
    done_.assign(slot_[n], 0);
  }

  // The edge of a triangle through which the line leaves it (`rising`) or enters it, higher values on its left.
  [[nodiscard]] int edge_across(Index t, double value, bool rising) const {
    const auto& corner = mesh_.triangles[t];
    for (int i = 0; i < 3; ++i) {
      const bool low = values_[corner[i]] < value, next_low = values_[corner[next3(i)]] < value;
      if (low != next_low && low == rising) return i;
    }
    return -1;
  }

  [[nodiscard]] double inside_at(Index v) const {
    const double here = distance_.distance(v), open = here - options_.inset;
    const double rise = ridge_.rise(v);
    if (rise == kFar) return open;
    return std::min(open, here + rise - options_.narrowest);
  }

  [[nodiscard]] Crossing crossing(Index t, int edge, double value) const {
    const auto& corner = mesh_.triangles[t];
    // Seen from both triangles alike: always from the lower vertex id.
    const Index a = std::min(corner[edge], corner[next3(edge)]), b = std::max(corner[edge], corner[next3(edge)]);
    const double part = (value - values_[a]) / (values_[b] - values_[a]);
    Crossing c;
    c.point.position = mesh_.vertices[a] + part * (mesh_.vertices[b] - mesh_.vertices[a]);
    c.point.normal = (mesh_.normals[a] + part * (mesh_.normals[b] - mesh_.normals[a])).normalized();
    c.point.triangle = t;
    c.inside = inside_at(a) + part * (inside_at(b) - inside_at(a));
    return c;
  }

  void trace(Index seed, int level) {
    const double value = value_of(level);
    const auto mark = [&](Index t) -> char& { return done_[slot_[t] + level - lowest_[t]]; };
    std::vector<Crossing> line, back;
    bool closed = false;
    line.push_back(crossing(seed, edge_across(seed, value, false), value));
    for (Index t = seed;;) {
      mark(t) = 1;
      const int exit = edge_across(t, value, true);
      line.push_back(crossing(t, exit, value));
      t = mesh_.neighbours[t][exit];
      if (t == kNone) break;
      if (mark(t)) {
        closed = true;
        break;
      }
    }
    if (!closed) {
      // Backwards: a segment's triangle stands at its later end.
      for (Index t = mesh_.neighbours[seed][edge_across(seed, value, false)]; t != kNone && !mark(t);) {
        mark(t) = 1;
        back.empty() ? line.front().point.triangle = t : back.back().point.triangle = t;
        const int entry = edge_across(t, value, false);
        back.push_back(crossing(t, entry, value));
        t = mesh_.neighbours[t][entry];
      }
      line.insert(line.begin(), back.rbegin(), back.rend());
    }
    cut(line, closed);
  }

  // Keeps the parts that run inside.
  void cut(const std::vector<Crossing>& line, bool closed) {
    Track track{.kind = PathKind::infill, .closed = closed, .points = {}};
    const auto flush = [&] {
      if (track.points.size() > 1 && length_of(track) >= options_.shortest) lines_.push_back(track);
      track.points.clear();
    };
    if (closed && std::all_of(line.begin(), line.end(), [](const Crossing& c) { return c.inside > 0.0; })) {
      for (const Crossing& c : line) track.points.push_back(c.point);
      return flush();
    }
    track.closed = false;
    // A closed line starts outside.
    std::size_t start = 0;
    if (closed) start = std::find_if(line.begin(), line.end(), [](const Crossing& c) { return c.inside <= 0.0; }) - line.begin();
    const std::size_t n = line.size();
    const auto at = [&](std::size_t i) -> const Crossing& { return closed ? line[i < n ? i : i - n + 1] : line[i]; };
    for (std::size_t k = 0; k < n; ++k) {
      const Crossing& here = at(start + k);
      if (k > 0) {
        const Crossing& before = at(start + k - 1);
        if ((before.inside > 0.0) != (here.inside > 0.0)) {
          TrackPoint point = here.point;
          const double part = before.inside / (before.inside - here.inside);
          point.position = before.point.position + part * (here.point.position - before.point.position);
          point.normal = (before.point.normal + part * (here.point.normal - before.point.normal)).normalized();
          track.points.push_back(point);
          if (here.inside <= 0.0) flush();
        }
      }
      if (here.inside > 0.0) track.points.push_back(here.point);
    }
    flush();
  }

  const BorderDistance& distance_;
  const PieceMesh& mesh_;
  const Ridge& ridge_;
  const ZigzagOptions& options_;
  std::vector<double> values_;  // by vertex; lines run at (level + 1/2) spacing
  std::vector<Index> slot_;
  std::vector<int> lowest_;
  std::vector<char> done_;
  std::vector<Track> lines_;
};

// Area means of place and normal.
std::pair<Vec3, Vec3> middle_of(const PieceMesh& mesh) {
  Vec3 centre = Vec3::Zero(), normal = Vec3::Zero();
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const double area = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    centre += area / 3.0 * (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]);
    normal += area / 3.0 * (mesh.normals[a] + mesh.normals[b] + mesh.normals[c]);
    sum += area;
  }
  return {centre / std::max(sum, 1e-12), normal};
}

// The direction that makes `angle` with the x axis in the plane across the normal.
Vec3 direction_across(const Vec3& normal, double angle) {
  const Vec3 up = normal.norm() > 1e-9 ? Vec3(normal.normalized()) : Vec3(Vec3::UnitZ());
  const Vec3 axis = std::abs(up.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 x = (axis - up * up.dot(axis)).normalized();
  return std::cos(angle) * x + std::sin(angle) * up.cross(x);
}

}  // namespace

std::vector<double> distance_from_section(const PieceMesh& mesh, const Vec3& origin, const Vec3& direction) {
  const std::size_t n = mesh.vertices.size();
  std::vector<double> height(n), distance(n, kFar);
  for (std::size_t v = 0; v < n; ++v) height[v] = direction.dot(mesh.vertices[v] - origin);
  using Entry = std::pair<double, Index>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  // A value is handed on a few times and not for small gains: corrections would run through the piece again and again.
  std::vector<std::uint8_t> visits(n, 0);
  const auto offer = [&](Index v, double value) {
    if (visits[v] == kMostVisits || !(value < distance[v] - (visits[v] > 0 ? kGain : 0.0))) return;
    distance[v] = value;
    queue.emplace(value, v);
  };
  for (const auto& corner : mesh.triangles) {
    const auto [low, high] = std::minmax({height[corner[0]], height[corner[1]], height[corner[2]]});
    if (low >= 0.0 || high < 0.0) continue;
    const Vec3 normal = (mesh.vertices[corner[1]] - mesh.vertices[corner[0]]).cross(mesh.vertices[corner[2]] - mesh.vertices[corner[0]]);
    const double area = normal.norm();
    // How fast the height grows along the triangle.
    const double slope = area > 1e-12 ? direction.cross(Vec3(normal / area)).norm() : 1.0;
    for (const Index v : corner) offer(v, std::abs(height[v]) / std::max(slope, 1e-3));
  }
  const Fans fans(mesh);
  while (!queue.empty()) {
    const auto [value, v] = queue.top();
    queue.pop();
    if (value != distance[v] || visits[v] == kMostVisits) continue;
    ++visits[v];
    for (Index k = fans.first[v]; k < fans.first[v + 1]; ++k) {
      const auto& corner = mesh.triangles[fans.triangles[k]];
      const int i = corner[0] == v ? 0 : corner[1] == v ? 1 : 2;
      const Index b = corner[next3(i)], c = corner[prev3(i)];
      for (const auto& [other, target] : {std::pair(b, c), std::pair(c, b)}) {
        if ((height[target] >= 0.0) != (height[v] >= 0.0)) continue;
        const bool same_side = (height[other] >= 0.0) == (height[v] >= 0.0);
        offer(target, carried_on(mesh.vertices[v], value, mesh.vertices[other], same_side ? distance[other] : kFar, mesh.vertices[target]));
      }
    }
  }
  for (std::size_t v = 0; v < n; ++v) {
    if (height[v] < 0.0) distance[v] = -distance[v];
  }
  return distance;
}

std::vector<Track> trace_lines(const BorderDistance& distance, const Ridge& ridge, const ZigzagOptions& options) {
  const auto [centre, normal] = middle_of(distance.mesh());
  const Vec3 direction = direction_across(normal, options.angle);
  const Vec3 origin = direction * (std::round(direction.dot(centre) / options.spacing) * options.spacing);
  std::vector<double> values = distance_from_section(distance.mesh(), origin, direction);
  const bool missed = std::none_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  if (missed) values = distance_from_section(distance.mesh(), centre, direction);
  return LineTracer(distance, ridge, options, std::move(values)).run();
}

}  // namespace curvesup::toolpath
