#include "motion/deposit.h"

#include <algorithm>
#include <cmath>

namespace curvesup {
namespace {

constexpr double kFloatError = 1e-3;  // mm, of a centre in single precision
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
                 double spacing_mm)
    : spacing_mm_(spacing_mm) {
  for (const Path& path : paths) {
    const auto first = static_cast<std::size_t>(path.first_point), count = static_cast<std::size_t>(path.point_count);
    add_path(points.subspan(first, count), tips.subspan(first, count));
  }
  finish();
}

void Deposit::add_path(std::span<const PathPoint> points, std::span<const Vec3> tips) {
  const Index first = path_end_.empty() ? 0 : path_end_.back();
  double top = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    top = std::max(top, tips[i].z());
    const bool laid = i > 0 && points[i].volume_mm3 > 0.0;
    if (!laid && i > 0) continue;
    const int pieces = laid ? std::max(1, static_cast<int>(std::ceil((tips[i] - tips[i - 1]).norm() / spacing_mm_))) : 1;
    for (int s = 1; s <= pieces; ++s) {
      const double t = static_cast<double>(s) / pieces;
      const Vec3 at = laid ? Vec3((1.0 - t) * tips[i - 1] + t * tips[i]) : tips[i];
      samples_.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z()),
                          first + static_cast<Index>(i)});
    }
  }
  own_top_.push_back(top);
  path_end_.push_back(first + static_cast<Index>(points.size()));
}

void Deposit::finish() {
  find_tops();
  build();
}

void Deposit::find_tops() {
  top_.resize(own_top_.size());
  double top = 0.0;
  for (std::size_t p = 0; p < own_top_.size(); ++p) top_[p] = top = std::max(top, own_top_[p]);
}

void Deposit::reorder(std::size_t first, std::span<const Index> order) {
  const Index begin = first > 0 ? path_end_[first - 1] : 0;
  const auto old_begin = [&](std::size_t path) { return path > 0 ? path_end_[path - 1] : 0; };
  std::vector<Index> ends(order.size()), shift(order.size());
  std::vector<double> tops(order.size());
  Index at = begin;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t was = first + static_cast<std::size_t>(order[i]);
    shift[static_cast<std::size_t>(order[i])] = at - old_begin(was);
    tops[i] = own_top_[was];
    ends[i] = at += path_end_[was] - old_begin(was);
  }
  const auto old_ends = std::span(path_end_).subspan(first, order.size());
  for (Sample& sample : samples_) {
    if (sample.point < begin || sample.point >= at) continue;
    const auto path = std::upper_bound(old_ends.begin(), old_ends.end(), sample.point) - old_ends.begin();
    sample.point += shift[static_cast<std::size_t>(path)];
  }
  std::copy(ends.begin(), ends.end(), old_ends.begin());
  std::copy(tops.begin(), tops.end(), own_top_.begin() + static_cast<std::ptrdiff_t>(first));
  find_tops();
  find_earliest();
}

void Deposit::build() {
  if (samples_.empty()) return;
  Vec3 low = samples_[0].position(), high = low;
  for (const Sample& sample : samples_) {
    low = low.cwiseMin(sample.position());
    high = high.cwiseMax(sample.position());
  }
  const double scale = 2097151.0 / std::max(1e-9, (high - low).maxCoeff());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    const Vec3 cell = scale * (samples_[i].position() - low);
    order[i] = {spread(static_cast<std::uint64_t>(cell.x())) | spread(static_cast<std::uint64_t>(cell.y())) << 1 |
                    spread(static_cast<std::uint64_t>(cell.z())) << 2,
                static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<Sample> sorted(samples_.size());
  for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = samples_[order[i].second];
  samples_ = std::move(sorted);

  leaves_ = 1;
  while (leaves_ * kLeafSize < samples_.size()) leaves_ *= 2;
  nodes_.assign(2 * leaves_, {});
  std::vector<Eigen::Vector3f> lows(2 * leaves_, Eigen::Vector3f::Constant(1e30f)),
      highs(2 * leaves_, Eigen::Vector3f::Constant(-1e30f));
  for (std::size_t node = 2 * leaves_ - 1; node >= 1; --node) {
    if (node >= leaves_) {
      const std::size_t begin = (node - leaves_) * kLeafSize, end = std::min(begin + kLeafSize, samples_.size());
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3f at(samples_[i].x, samples_[i].y, samples_[i].z);
        lows[node] = lows[node].cwiseMin(at);
        highs[node] = highs[node].cwiseMax(at);
      }
    } else {
      lows[node] = lows[2 * node].cwiseMin(lows[2 * node + 1]);
      highs[node] = highs[2 * node].cwiseMax(highs[2 * node + 1]);
    }
    if (lows[node].x() > highs[node].x()) continue;
    const Vec3 centre = 0.5 * (lows[node] + highs[node]).cast<double>();
    nodes_[node].x = static_cast<float>(centre.x());
    nodes_[node].y = static_cast<float>(centre.y());
    nodes_[node].z = static_cast<float>(centre.z());
    const Vec3 half = 0.5 * (highs[node] - lows[node]).cast<double>() + Vec3::Constant(kFloatError);
    nodes_[node].half_x = static_cast<float>(half.x());
    nodes_[node].half_y = static_cast<float>(half.y());
    nodes_[node].half_z = static_cast<float>(half.z());
    nodes_[node].radius = static_cast<float>(half.norm() + kFloatError);
  }
  find_earliest();
}

void Deposit::find_earliest() {
  for (std::size_t node = nodes_.empty() ? 0 : 2 * leaves_ - 1; node >= 1; --node) {
    Index& earliest = nodes_[node].earliest;
    earliest = std::numeric_limits<Index>::max();
    if (node < leaves_) {
      earliest = std::min(nodes_[2 * node].earliest, nodes_[2 * node + 1].earliest);
      continue;
    }
    const std::size_t begin = (node - leaves_) * kLeafSize, end = std::min(begin + kLeafSize, samples_.size());
    for (std::size_t i = begin; i < end; ++i) earliest = std::min(earliest, samples_[i].point);
  }
}

template <class Excluded, class Visit>
bool Deposit::visit(Index before, const Excluded& excluded, const Visit& visit) const {
  if (samples_.empty()) return false;
  std::size_t stack[64];
  int depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (nodes_[node].earliest >= before || excluded(nodes_[node])) continue;
    if (node < leaves_) {
      stack[depth++] = 2 * node + 1;
      stack[depth++] = 2 * node;
      continue;
    }
    const std::size_t begin = (node - leaves_) * kLeafSize, end = std::min(begin + kLeafSize, samples_.size());
    for (std::size_t i = begin; i < end; ++i) {
      if (samples_[i].point < before && visit(samples_[i])) return true;
    }
  }
  return false;
}

template <class Excluded, class Gap>
bool Deposit::search(Index before, double clearance, const Excluded& excluded, const Gap& gap, Contact* contact) const {
  return visit(before, excluded, [&](const Sample& sample) {
    const Vec3 position = sample.position();
    const double distance = gap(position);
    if (distance >= clearance) return false;
    if (contact) *contact = {sample.point, position, clearance - distance};
    return true;
  });
}

namespace {

// Heights and radii of points as one pose of the head sees them.
struct HeadView {
  const HeadShape& head;
  const Vec3 &tip, &axis;
  double free_height;

  // Nothing in a box of that reach along the axis, within `extent` of its centre, is nearer than `gap`.
  [[nodiscard]] bool excludes(const Vec3& centre, double reach, double extent, double gap) const {
    const double height = (centre - tip).dot(axis);
    if (height + reach <= free_height) return true;
    const double radius = std::sqrt(std::max(0.0, (centre - tip).squaredNorm() - height * height));
    return head.distance_bound(height, radius) - extent >= gap;
  }
  // kNoGap for a point that does not count, or is no nearer than `gap`.
  [[nodiscard]] double distance(const Vec3& point, double gap) const {
    const Vec3 offset = point - tip;
    const double height = offset.dot(axis);
    if (height <= free_height) return kNoGap;
    const double radius = std::sqrt(std::max(0.0, offset.squaredNorm() - height * height));
    if (head.distance_bound(height, radius) >= gap) return kNoGap;
    return head.distance(height, radius);
  }
};

}  // namespace

bool Deposit::touches_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                           double clearance, Index before, Contact* contact) const {
  const HeadView view{head, tip, axis, free_height};
  return search(
      before, clearance,
      [&](const Node& node) { return view.excludes(node.centre(), node.reach(axis), node.radius, clearance); },
      [&](const Vec3& point) { return view.distance(point, clearance); }, contact);
}

double Deposit::head_gap(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height, double most,
                         Index before) const {
  const HeadView view{head, tip, axis, free_height};
  double gap = most;
  visit(
      before, [&](const Node& node) { return view.excludes(node.centre(), node.reach(axis), node.radius, gap); },
      [&](const Sample& sample) {
        gap = std::min(gap, view.distance(sample.position(), gap));
        return false;
      });
  return gap;
}

void Deposit::contacts_of_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                               double clearance, Index before, std::vector<Index>& points) const {
  const HeadView view{head, tip, axis, free_height};
  visit(
      before,
      [&](const Node& node) { return view.excludes(node.centre(), node.reach(axis), node.radius, clearance); },
      [&](const Sample& sample) {
        if (view.distance(sample.position(), clearance) < clearance) points.push_back(sample.point);
        return false;
      });
}

namespace {

constexpr std::size_t kMostTogether = 32;
constexpr double kTogether_mm = 4.0, kTogether_rad = 0.15;

// Poses of the head that are near each other, and how far any of them is from one in their middle.
struct HeadBundle {
  Vec3 tip = Vec3::Zero(), axis = Vec3::UnitZ();
  double shift = 0.0;   // between tips
  double turn = 0.0;    // between axes, as a chord
  double rise = -1e300;  // of the middle's tip above another's tip plane, less that one's free height
  Index before = 0;

  explicit HeadBundle(std::span<const Deposit::HeadPose> poses) {
    tip = 0.5 * (poses.front().tip + poses.back().tip);
    axis = (poses.front().axis + poses.back().axis).normalized();
    for (const Deposit::HeadPose& pose : poses) {
      shift = std::max(shift, (pose.tip - tip).norm());
      turn = std::max(turn, (pose.axis - axis).norm());
      rise = std::max(rise, (tip - pose.tip).dot(pose.axis) - pose.free_height);
      before = std::max(before, pose.before);
    }
  }

  // Nothing within `extent` of `centre`, nor higher than `reach` above it along the axis, touches any of the poses.
  [[nodiscard]] bool clear_of(const Vec3& centre, double extent, double reach, const HeadShape& head,
                              double clearance) const {
    const Vec3 offset = centre - tip;
    const double height = offset.dot(axis), top = height + reach + rise;
    if (top + (offset.lpNorm<1>() + extent) * turn <= 0.0) return true;
    const double squared = offset.squaredNorm(), far = std::sqrt(squared) + extent;
    if (top + far * turn <= 0.0) return true;
    const double radius = std::sqrt(std::max(0.0, squared - height * height));
    // 1.05: an angle over its chord; distances change no more than a point is moved.
    return head.distance_bound(height, radius) - extent - shift - 1.05 * turn * (far + shift) >= clearance;
  }
};

}  // namespace

void Deposit::touches_head(const HeadShape& head, std::span<const HeadPose> poses, double clearance,
                           std::span<char> touches) const {
  std::vector<Sample> near;
  for (std::size_t begin = 0, end; begin < poses.size(); begin = end) {
    const HeadPose& first = poses[begin];
    for (end = begin + 1; end < poses.size() && end - begin < kMostTogether; ++end) {
      if ((poses[end].tip - first.tip).squaredNorm() > kTogether_mm * kTogether_mm) break;
      if ((poses[end].axis - first.axis).squaredNorm() > kTogether_rad * kTogether_rad) break;
    }
    const HeadBundle bundle(poses.subspan(begin, end - begin));
    near.clear();
    visit(
        bundle.before,
        [&](const Node& node) {
          return bundle.clear_of(node.centre(), node.radius, node.reach(bundle.axis), head, clearance);
        },
        [&](const Sample& sample) {
          if (!bundle.clear_of(sample.position(), 0.0, 0.0, head, clearance)) near.push_back(sample);
          return false;
        });
    for (std::size_t i = begin; i < end; ++i) {
      touches[i] = 0;
      for (const Sample& sample : near) {
        if (sample.point >= poses[i].before) continue;
        const Vec3 offset = sample.position() - poses[i].tip;
        const double height = offset.dot(poses[i].axis);
        if (height <= poses[i].free_height) continue;
        const double radius = std::sqrt(std::max(0.0, offset.squaredNorm() - height * height));
        if (head.distance_bound(height, radius) >= clearance || head.distance(height, radius) >= clearance) continue;
        touches[i] = 1;
        break;
      }
    }
  }
}

bool Deposit::touches_capsule(const Vec3& a, const Vec3& b, double radius, double clearance, Index before,
                              Contact* contact) const {
  if (std::min(a.z(), b.z()) - radius - clearance > top_before(before)) return false;
  const auto gap = [&](const Vec3& point) { return distance_to_segment(point, a, b) - radius; };
  const auto excluded = [&](const Node& node) { return gap(node.centre()) - node.radius >= clearance; };
  return search(before, clearance, excluded, gap, contact);
}

double Deposit::top_before(Index before) const {
  const auto path = std::lower_bound(path_end_.begin(), path_end_.end(), before) - path_end_.begin();
  if (top_.empty()) return 0.0;
  return top_[std::min<std::size_t>(path, top_.size() - 1)];
}

}  // namespace curvesup
