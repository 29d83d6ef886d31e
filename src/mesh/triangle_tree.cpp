#include "curvesup/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace curvesup {

namespace {
constexpr Index kLeafSize = 4;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double box_distance2(const Vec3& p, const Vec3& low, const Vec3& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

bool box_meets_ray(const Vec3& origin, const Vec3& inverse, const Vec3& low, const Vec3& high, double t_min, double t_max) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isinf(inverse[axis])) {
      if (origin[axis] < low[axis] || origin[axis] > high[axis]) return false;
      continue;
    }
    double t0 = (low[axis] - origin[axis]) * inverse[axis], t1 = (high[axis] - origin[axis]) * inverse[axis];
    if (t0 > t1) std::swap(t0, t1);
    t_min = std::max(t_min, t0);
    t_max = std::min(t_max, t1);
    if (t_min > t_max) return false;
  }
  return true;
}

// Smallest |t| at which a line is in a box, infinite if it never is.
double box_nearness(const Vec3& origin, const Vec3& inverse, const Vec3& low, const Vec3& high) {
  double from = -kInfinity, to = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    double t0 = (low[axis] - origin[axis]) * inverse[axis], t1 = (high[axis] - origin[axis]) * inverse[axis];
    if (std::isinf(inverse[axis])) {
      const bool between = origin[axis] >= low[axis] && origin[axis] <= high[axis];
      t0 = between ? -kInfinity : kInfinity;
      t1 = kInfinity;
    }
    from = std::max(from, std::min(t0, t1));
    to = std::min(to, std::max(t0, t1));
  }
  return from > to ? kInfinity : std::max({from, -to, 0.0});
}

// Moeller-Trumbore, edges included.
bool ray_triangle(const Vec3& origin, const Vec3& direction, const std::array<Vec3, 3>& c, double& t) {
  const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0];
  const Vec3 h = direction.cross(e2);
  const double det = e1.dot(h);
  if (det == 0.0) return false;
  const Vec3 s = origin - c[0];
  const double u = s.dot(h) / det;
  if (u < 0.0 || u > 1.0) return false;
  const Vec3 q = s.cross(e1);
  const double v = direction.dot(q) / det;
  if (v < 0.0 || u + v > 1.0) return false;
  t = e2.dot(q) / det;
  return true;
}
}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
  corners_.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) corners_.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
  order_.resize(corners_.size());
  std::iota(order_.begin(), order_.end(), 0);
  if (corners_.empty()) return;
  nodes_.reserve(2 * corners_.size() / kLeafSize + 2);
  nodes_.emplace_back();
  build(0, 0, static_cast<Index>(order_.size()));
}

void TriangleTree::build(Index node, Index begin, Index end) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  Vec3 centre_low = low, centre_high = high;
  for (Index i = begin; i < end; ++i) {
    const auto& c = corners_[order_[i]];
    const Vec3 a = c[0].cwiseMin(c[1]).cwiseMin(c[2]), b = c[0].cwiseMax(c[1]).cwiseMax(c[2]);
    low = low.cwiseMin(a);
    high = high.cwiseMax(b);
    const Vec3 centre = a + b;
    centre_low = centre_low.cwiseMin(centre);
    centre_high = centre_high.cwiseMax(centre);
  }
  nodes_[node].low = low;
  nodes_[node].high = high;
  if (end - begin <= kLeafSize) {
    nodes_[node].first = begin;
    nodes_[node].count = end - begin;
    return;
  }
  int axis = 0;
  (centre_high - centre_low).maxCoeff(&axis);
  const Index middle = begin + (end - begin) / 2;
  const auto centre = [&](Index t) {
    const auto& c = corners_[t];
    return std::min({c[0][axis], c[1][axis], c[2][axis]}) + std::max({c[0][axis], c[1][axis], c[2][axis]});
  };
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](Index a, Index b) {
    const double ca = centre(a), cb = centre(b);
    return ca != cb ? ca < cb : a < b;
  });
  const Index left = static_cast<Index>(nodes_.size());
  nodes_.emplace_back();
  nodes_.emplace_back();
  nodes_[node].first = left;
  nodes_[node].count = 0;
  build(left, begin, middle);
  build(left + 1, middle, end);
}

std::optional<TriangleTree::Nearest> TriangleTree::nearest(const Vec3& p, double max_distance) const {
  if (nodes_.empty()) return std::nullopt;
  Nearest best;
  double best2 = max_distance * max_distance;
  std::array<Index, 64> stack;
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (box_distance2(p, node.low, node.high) > best2) continue;
    if (node.count == 0) {
      const double left = box_distance2(p, nodes_[node.first].low, nodes_[node.first].high);
      const double right = box_distance2(p, nodes_[node.first + 1].low, nodes_[node.first + 1].high);
      const bool left_first = left <= right;
      stack[top++] = node.first + (left_first ? 1 : 0);
      stack[top++] = node.first + (left_first ? 0 : 1);
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      const Index triangle = order_[i];
      const auto& c = corners_[triangle];
      const Vec3 q = closest_point_on_triangle(p, c[0], c[1], c[2]);
      const double d2 = (q - p).squaredNorm();
      if (d2 < best2 || (d2 == best2 && (best.triangle == kNone || triangle < best.triangle))) {
        best2 = d2;
        best.triangle = triangle;
        best.point = q;
      }
    }
  }
  if (best.triangle == kNone) return std::nullopt;
  best.distance = std::sqrt(best2);
  return best;
}

std::optional<TriangleTree::Hit> TriangleTree::first_hit(const Vec3& origin, const Vec3& direction, double t_min,
                                                         double t_max) const {
  if (nodes_.empty()) return std::nullopt;
  const Vec3 inverse = direction.cwiseInverse();
  Hit best;
  best.t = t_max;
  std::array<Index, 64> stack;
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (!box_meets_ray(origin, inverse, node.low, node.high, t_min, best.t)) continue;
    if (node.count == 0) {
      stack[top++] = node.first;
      stack[top++] = node.first + 1;
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      double t = 0.0;
      const Index triangle = order_[i];
      if (!ray_triangle(origin, direction, corners_[triangle], t) || t < t_min || t > best.t) continue;
      if (t < best.t || best.triangle == kNone || triangle < best.triangle) best = {triangle, t};
    }
  }
  if (best.triangle == kNone) return std::nullopt;
  return best;
}

std::optional<TriangleTree::Hit> TriangleTree::nearest_hit(const Vec3& origin, const Vec3& direction, double t_max) const {
  if (nodes_.empty()) return std::nullopt;
  const Vec3 inverse = direction.cwiseInverse();
  Hit best;
  double reach = t_max;
  struct Entry {
    double nearness;  // smallest |t| in the node's box
    Index node;
  };
  const auto entry = [&](Index node) {
    return Entry{box_nearness(origin, inverse, nodes_[node].low, nodes_[node].high), node};
  };
  std::array<Entry, 64> stack;
  int top = 0;
  stack[top++] = entry(0);
  while (top > 0) {
    const auto [nearness, visited] = stack[--top];
    if (nearness > reach) continue;
    const Node& node = nodes_[visited];
    if (node.count == 0) {
      Entry near = entry(node.first), far = entry(node.first + 1);
      if (far.nearness < near.nearness) std::swap(near, far);
      stack[top++] = far;
      stack[top++] = near;
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      double t = 0.0;
      const Index triangle = order_[i];
      if (!ray_triangle(origin, direction, corners_[triangle], t) || std::abs(t) > reach) continue;
      const bool equal = best.triangle != kNone && std::abs(t) == reach;
      if (equal && ((t < 0.0) != (best.t < 0.0) ? best.t < 0.0 : triangle > best.triangle)) continue;
      best = {triangle, t};
      reach = std::abs(t);
    }
  }
  if (best.triangle == kNone) return std::nullopt;
  return best;
}

void TriangleTree::overlapping(const Vec3& low, const Vec3& high, const std::function<void(Index)>& visit) const {
  if (nodes_.empty()) return;
  const auto meets = [&](const Vec3& a, const Vec3& b) {
    return (a.array() <= high.array()).all() && (b.array() >= low.array()).all();
  };
  std::array<Index, 64> stack;
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[stack[--top]];
    if (!meets(node.low, node.high)) continue;
    if (node.count == 0) {
      stack[top++] = node.first;
      stack[top++] = node.first + 1;
      continue;
    }
    for (Index i = node.first; i < node.first + node.count; ++i) {
      const auto& c = corners_[order_[i]];
      if (meets(c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2]))) visit(order_[i]);
    }
  }
}

}  // namespace curvesup
