#include "motion/deposit.h"

#include <algorithm>
#include <cmath>

namespace curvesup {
namespace {

constexpr double kNoGap = std::numeric_limits<double>::infinity();

std::uint64_t spread(std::uint64_t value) {
  value &= 0x1fffff;
  value = (value | value << 32) & 0x1f00000000ffffULL;
  value = (value | value << 16) & 0x1f0000ff0000ffULL;
  value = (value | value << 8) & 0x100f00f00f00f00fULL;
  value = (value | value << 4) & 0x10c30c30c30c30c3ULL;
  value = (value | value << 2) & 0x1249249249249249ULL;
  return value;
}

double distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double squared = along.squaredNorm();
  const double t = squared > 0.0 ? std::clamp((point - a).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (point - a - t * along).norm();
}

}  // namespace

Deposit::Deposit(std::span<const Path> paths, std::span<const PathPoint> points, std::span<const Vec3> tips,
                 double spacing_mm) {
  double top = 0.0;
  for (const Path& path : paths) {
    for (Index i = path.first_point; i < path.first_point + path.point_count; ++i) {
      top = std::max(top, tips[i].z());
      const bool laid = i > path.first_point && points[i].volume_mm3 > 0.0;
      const int pieces =
          laid ? std::max(1, static_cast<int>(std::ceil((tips[i] - tips[i - 1]).norm() / spacing_mm))) : 1;
      if (!laid && i > path.first_point) continue;
      for (int s = 1; s <= pieces; ++s) {
        const double t = static_cast<double>(s) / pieces;
        samples_.push_back({laid ? Vec3((1.0 - t) * tips[i - 1] + t * tips[i]) : tips[i], i});
      }
    }
    top_.push_back(top);
    path_end_.push_back(path.first_point + path.point_count);
  }
  build();
}

void Deposit::build() {
  if (samples_.empty()) return;
  Vec3 low = samples_[0].position, high = low;
  for (const Sample& sample : samples_) {
    low = low.cwiseMin(sample.position);
    high = high.cwiseMax(sample.position);
  }
  const double scale = 2097151.0 / std::max(1e-9, (high - low).maxCoeff());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Vec3 cell = scale * (samples_[i].position - low);
    order[i] = {spread(static_cast<std::uint64_t>(cell.x())) | spread(static_cast<std::uint64_t>(cell.y())) << 1 |
                    spread(static_cast<std::uint64_t>(cell.z())) << 2,
                static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<Sample> sorted;
  sorted.reserve(samples_.size());
  for (const auto& [code, i] : order) sorted.push_back(samples_[i]);
  samples_ = std::move(sorted);

  leaves_ = 1;
  while (leaves_ * kLeafSize < samples_.size()) leaves_ *= 2;
  nodes_.assign(2 * leaves_, {});
  std::vector<Vec3> lows(2 * leaves_, Vec3::Constant(1e300)), highs(2 * leaves_, Vec3::Constant(-1e300));
  for (std::size_t node = 2 * leaves_ - 1; node >= 1; --node) {
    if (node >= leaves_) {
      const std::size_t begin = (node - leaves_) * kLeafSize, end = std::min(begin + kLeafSize, samples_.size());
      for (std::size_t i = begin; i < end; ++i) {
        lows[node] = lows[node].cwiseMin(samples_[i].position);
        highs[node] = highs[node].cwiseMax(samples_[i].position);
        nodes_[node].earliest = std::min(nodes_[node].earliest, samples_[i].point);
      }
    } else {
      lows[node] = lows[2 * node].cwiseMin(lows[2 * node + 1]);
      highs[node] = highs[2 * node].cwiseMax(highs[2 * node + 1]);
      nodes_[node].earliest = std::min(nodes_[2 * node].earliest, nodes_[2 * node + 1].earliest);
    }
    if (lows[node].x() > highs[node].x()) continue;
    nodes_[node].centre = 0.5 * (lows[node] + highs[node]);
    nodes_[node].radius = 0.5 * (highs[node] - lows[node]).norm();
  }
}

template <class Excluded, class Gap>
bool Deposit::search(Index before, double clearance, const Excluded& excluded, const Gap& gap, Contact* contact) const {
  if (samples_.empty()) return false;
  std::size_t stack[64];
  int depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (nodes_[node].earliest >= before || excluded(nodes_[node].centre, nodes_[node].radius)) continue;
    if (node < leaves_) {
      stack[depth++] = 2 * node + 1;
      stack[depth++] = 2 * node;
      continue;
    }
    const std::size_t begin = (node - leaves_) * kLeafSize, end = std::min(begin + kLeafSize, samples_.size());
    for (std::size_t i = begin; i < end; ++i) {
      if (samples_[i].point >= before) continue;
      const double distance = gap(samples_[i].position);
      if (distance >= clearance) continue;
      if (contact) *contact = {samples_[i].point, samples_[i].position, clearance - distance};
      return true;
    }
  }
  return false;
}

bool Deposit::touches_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                           double clearance, Index before, Contact* contact) const {
  const auto split = [&](const Vec3& point, double& height, double& radius) {
    const Vec3 offset = point - tip;
    height = offset.dot(axis);
    radius = std::sqrt(std::max(0.0, offset.squaredNorm() - height * height));
  };
  const auto excluded = [&](const Vec3& centre, double extent) {
    double height, radius;
    split(centre, height, radius);
    return height + extent <= free_height || head.distance_bound(height, radius) - extent >= clearance;
  };
  const auto gap = [&](const Vec3& point) {
    double height, radius;
    split(point, height, radius);
    if (height <= free_height || head.distance_bound(height, radius) >= clearance) return kNoGap;
    return head.distance(height, radius);
  };
  return search(before, clearance, excluded, gap, contact);
}

bool Deposit::touches_capsule(const Vec3& a, const Vec3& b, double radius, double clearance, Index before,
                              Contact* contact) const {
  const auto gap = [&](const Vec3& point) { return distance_to_segment(point, a, b) - radius; };
  const auto excluded = [&](const Vec3& centre, double extent) { return gap(centre) - extent >= clearance; };
  return search(before, clearance, excluded, gap, contact);
}

double Deposit::top_before(Index before) const {
  const auto path = std::lower_bound(path_end_.begin(), path_end_.end(), before) - path_end_.begin();
  if (top_.empty()) return 0.0;
  return top_[std::min<std::size_t>(path, top_.size() - 1)];
}

}  // namespace curvesup
