#include "motion/deposit.h"

#include <algorithm>
#include <cmath>

namespace curvesup {
namespace {

constexpr float kFloatError = 1e-3f;  // mm, of a centre in single precision
constexpr double kNoGap = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostTogether = 32;  // poses of the head that are looked at together
constexpr double kTogether_mm = 4.0, kTogether_rad = 0.15;
constexpr std::size_t kFewNear = 256;  // samples that poses together look at; with more, each looks for its own
constexpr double kTimeScale = 2.0;     // of the whole print over the part's longest side, for what lies together

// The bits of a number below 65536, three apart.
std::uint64_t spread(double value) {
  auto bits = static_cast<std::uint64_t>(value) & 0xffff;
  bits = (bits | bits << 24) & 0x000000ff000000ffULL;
  bits = (bits | bits << 12) & 0x000f000f000f000fULL;
  bits = (bits | bits << 6) & 0x0303030303030303ULL;
  return (bits | bits << 3) & 0x1111111111111111ULL;
}

template <class Vector>
Point3f single(const Vector& vector) {
  return {static_cast<float>(vector.x()), static_cast<float>(vector.y()), static_cast<float>(vector.z())};
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
    const Vec3 across = 127.0 * points[i].normal;
    const bool laid = i > 0 && points[i].volume_mm3 > 0.0;
    if (!laid && i > 0) continue;
    const int pieces = laid ? std::max(1, static_cast<int>(std::ceil((tips[i] - tips[i - 1]).norm() / spacing_mm_))) : 1;
    for (int s = 1; s <= pieces; ++s) {
      const double t = static_cast<double>(s) / pieces;
      const Vec3 at = laid ? Vec3((1.0 - t) * tips[i - 1] + t * tips[i]) : tips[i];
      loose_.push_back({{static_cast<float>(at.x()), static_cast<float>(at.y()), static_cast<float>(at.z()),
                         first + static_cast<Index>(i)},
                        {static_cast<std::int8_t>(across.x()), static_cast<std::int8_t>(across.y()),
                         static_cast<std::int8_t>(across.z())}});
    }
  }
  own_top_.push_back(top);
  path_end_.push_back(first + static_cast<Index>(points.size()));
}

void Deposit::append(Deposit&& other) {
  const Index shift = path_end_.empty() ? 0 : path_end_.back();
  for (LooseSample& sample : other.loose_) sample.point += shift;
  for (Index& end : other.path_end_) end += shift;
  loose_.insert(loose_.end(), other.loose_.begin(), other.loose_.end());
  own_top_.insert(own_top_.end(), other.own_top_.begin(), other.own_top_.end());
  path_end_.insert(path_end_.end(), other.path_end_.begin(), other.path_end_.end());
  other = Deposit();
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
  for (DepositSamples& leaf : leaves_) {
    for (Index& point : leaf.point) {
      if (point < begin || point >= at) continue;
      const auto path = std::upper_bound(old_ends.begin(), old_ends.end(), point) - old_ends.begin();
      point += shift[static_cast<std::size_t>(path)];
    }
  }
  std::copy(ends.begin(), ends.end(), old_ends.begin());
  std::copy(tops.begin(), tops.end(), own_top_.begin() + static_cast<std::ptrdiff_t>(first));
  find_tops();
  find_earliest();
}

// The loose samples along a Morton curve through space and time.
std::vector<std::uint32_t> Deposit::together() const {
  Vec3 low = loose_[0].position(), high = low;
  for (const Sample& sample : loose_) {
    low = low.cwiseMin(sample.position());
    high = high.cwiseMax(sample.position());
  }
  const double scale = 65535.0 / kTimeScale / std::max(1e-9, (high - low).maxCoeff());
  const double per_point = 65535.0 / path_end_.back();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(loose_.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vec3 cell = scale * (loose_[i].position() - low);
    const double time = per_point * loose_[i].point;
    order[i] = {spread(cell.x()) | spread(cell.y()) << 1 | spread(cell.z()) << 2 | spread(time) << 3,
                static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> samples;
  samples.reserve(order.size());
  for (const auto& [key, sample] : order) samples.push_back(sample);
  return samples;
}

void Deposit::build() {
  samples_ = loose_.size();
  if (loose_.empty()) return;
  const std::vector<std::uint32_t> order = together();
  DepositSamples empty;
  empty.point.fill(kNever);
  leaves_.assign((samples_ + kLeafSamples - 1) / kLeafSamples, empty);
  std::vector<Vec3f> normals(leaves_.size(), Vec3f::Zero());
  for (std::size_t i = 0; i < samples_; ++i) {
    const LooseSample& sample = loose_[order[i]];
    DepositSamples& leaf = leaves_[i / kLeafSamples];
    const std::size_t at = i % kLeafSamples;
    leaf.x[at] = sample.x;
    leaf.y[at] = sample.y;
    leaf.z[at] = sample.z;
    leaf.point[at] = sample.point;
    normals[i / kLeafSamples] += Vec3f(sample.normal[0], sample.normal[1], sample.normal[2]);
  }
  std::vector<LooseSample>().swap(loose_);
  build_nodes(normals);
  find_earliest();
}

void Deposit::build_nodes(std::span<const Vec3f> leaf_normals) {
  std::size_t width = kNodeBoxes, count = 1;  // of the last level; of nodes
  while (width < leaves_.size()) {
    count += width;
    width *= kNodeBoxes;
  }
  nodes_.assign(count, {});
  struct Box {
    Vec3f low = Vec3f::Constant(1e30f), high = Vec3f::Constant(-1e30f), normal = Vec3f::Zero();
    [[nodiscard]] bool empty() const { return low.x() > high.x(); }
    [[nodiscard]] Vec3f middle() const { return 0.5f * (low + high); }
  };
  std::vector<Box> boxes(count + width);
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    Box& box = boxes[count + l];
    for (std::size_t i = 0; i < kLeafSamples && leaves_[l].point[i] != kNever; ++i) {
      const Vec3f at = sample_of(leaves_[l], i).position().cast<float>();
      box.low = box.low.cwiseMin(at);
      box.high = box.high.cwiseMax(at);
    }
    box.normal = leaf_normals[l];
  }
  const auto half_thickness = [&](std::size_t node, const Vec3f& middle, const Vec3f& normal) {
    float most = 0.0f;
    if (node >= count) {
      const DepositSamples& leaf = leaves_[leaf_of(node)];
      for (std::size_t i = 0; i < kLeafSamples && leaf.point[i] != kNever; ++i) {
        most = std::max(most, std::abs(normal.dot(sample_of(leaf, i).position().cast<float>() - middle)));
      }
    } else {
      for (std::size_t j = 0; j < kNodeBoxes; ++j) {
        const Box& box = boxes[kNodeBoxes * node + 1 + j];
        if (box.empty()) continue;
        most = std::max(most, std::abs(normal.dot(box.middle() - middle)) + nodes_[node].reach(j, single(normal)));
      }
    }
    return most + kFloatError;
  };
  for (std::size_t n = count; n-- > 0;) {
    DepositBoxes& node = nodes_[n];
    for (std::size_t j = 0; j < kNodeBoxes; ++j) {
      const std::size_t child = kNodeBoxes * n + 1 + j;
      const Box& box = boxes[child];
      if (box.empty()) continue;
      boxes[n].low = boxes[n].low.cwiseMin(box.low);
      boxes[n].high = boxes[n].high.cwiseMax(box.high);
      boxes[n].normal += box.normal;
      const Vec3f middle = box.middle(), half = 0.5f * (box.high - box.low) + Vec3f::Constant(kFloatError);
      const Vec3f normal = box.normal.norm() > 0.0f ? Vec3f(box.normal.normalized()) : Vec3f(Vec3f::UnitZ());
      node.x[j] = middle.x();
      node.y[j] = middle.y();
      node.z[j] = middle.z();
      node.half_x[j] = half.x();
      node.half_y[j] = half.y();
      node.half_z[j] = half.z();
      node.radius[j] = half.norm() + kFloatError;
      node.normal_x[j] = normal.x();
      node.normal_y[j] = normal.y();
      node.normal_z[j] = normal.z();
      node.half_thickness[j] = half_thickness(child, middle, normal);
    }
  }
}

void Deposit::find_earliest() {
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    for (std::size_t j = 0; j < kNodeBoxes; ++j) {
      const std::size_t child = kNodeBoxes * n + 1 + j;
      Index earliest = kNever;
      if (child < nodes_.size()) {
        earliest = *std::min_element(nodes_[child].earliest.begin(), nodes_[child].earliest.end());
      } else if (leaf_of(child) < leaves_.size()) {
        const auto& points = leaves_[leaf_of(child)].point;
        earliest = *std::min_element(points.begin(), points.end());
      }
      nodes_[n].earliest[j] = earliest;
    }
  }
}

template <class Body, class Visit>
bool Deposit::visit(Index before, const Body& body, const Visit& visit) const {
  if (nodes_.empty()) return false;
  std::array<std::size_t, 80> stack;
  std::array<float, 80> least;  // spare of each
  std::array<float, kLeafSamples> spare;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (node >= nodes_.size()) {
      const DepositSamples& leaf = leaves_[leaf_of(node)];
      body.spare(leaf, before, spare.data());
      for (std::size_t i = 0; i < kLeafSamples; ++i) {
        if (spare[i] < 0.0f && visit(sample_of(leaf, i))) return true;
      }
      continue;
    }
    body.spare(nodes_[node], before, spare.data());
    const std::size_t first = depth;
    for (std::size_t j = 0; j < kNodeBoxes; ++j) {
      if (spare[j] >= 0.0f) continue;
      // What lies deepest comes next.
      std::size_t at = depth++;
      for (; at > first && least[at - 1] < spare[j]; --at) {
        stack[at] = stack[at - 1];
        least[at] = least[at - 1];
      }
      stack[at] = kNodeBoxes * node + 1 + j;
      least[at] = spare[j];
    }
  }
  return false;
}

namespace {

// Heights and radii of points as one pose of the head sees them.
struct HeadView {
  const HeadShape& head;
  const Vec3 &tip, &axis;
  double free_height;

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

// Poses of the head that are near each other, and how far any of them is from one in their middle. It excludes boxes and
// samples of which nothing is nearer to any pose than `clearance` or counts there; spare() is not negative then.
class Deposit::HeadBundle {
 public:
  Index before = 0;

  HeadBundle(const HeadShape& head, const double& clearance, const HeadPose& pose)
      : HeadBundle(head, clearance, pose.tip, pose.axis, 0.0, 0.0, -pose.free_height) {
    before = pose.before;
  }

  HeadBundle(const HeadShape& head, const double& clearance, std::span<const HeadPose> poses)
      : HeadBundle(head, clearance, mean(poses, &HeadPose::tip), mean(poses, &HeadPose::axis).normalized(), poses) {}

  template <class Things>
  void spare(const Things& things, Index before, float* spare) const {
    spare_of(bounds_, static_cast<float>(clearance_), things, before, spare);
  }

 private:
  HeadBundle(const HeadShape& head, const double& clearance, const Vec3& tip, const Vec3& axis, std::span<const HeadPose> poses)
      : HeadBundle(head, clearance, tip, axis, farthest_tip(poses, tip), farthest_axis(poses, axis), highest_rise(poses, tip)) {
    for (const HeadPose& pose : poses) before = std::max(before, pose.before);
  }
  // shift: between tips; turn: between axes, as a chord; rise: of the middle's tip above another's tip plane, less that
  // one's free height.
  HeadBundle(const HeadShape& head, const double& clearance, const Vec3& tip, const Vec3& axis, double shift, double turn, double rise)
      : clearance_(clearance),
        bounds_{.tip = single(tip),
                .axis = single(axis),
                .tip_radius = head.tip_radius(),
                .slope = head.hull_slope(),
                .cosine = head.hull_cosine(),
                .widest = head.widest(),
                .length = static_cast<float>(head.length()),
                .turn = static_cast<float>(turn),
                .rise = static_cast<float>(rise) + kMargin_mm,
                // 1.05: an angle over its chord; distances change no more than a point is moved.
                .swing = 1.05f * static_cast<float>(turn),
                .apart = static_cast<float>(shift * (1.0 + 1.05 * turn)) + kMargin_mm} {}

  static Vec3 mean(std::span<const HeadPose> poses, Vec3 HeadPose::* of) {
    Vec3 sum = Vec3::Zero();
    for (const HeadPose& pose : poses) sum += pose.*of;
    return sum / static_cast<double>(poses.size());
  }
  static double farthest_tip(std::span<const HeadPose> poses, const Vec3& tip) {
    double farthest = 0.0;
    for (const HeadPose& pose : poses) farthest = std::max(farthest, (pose.tip - tip).norm());
    return farthest;
  }
  static double farthest_axis(std::span<const HeadPose> poses, const Vec3& axis) {
    double farthest = 0.0;
    for (const HeadPose& pose : poses) farthest = std::max(farthest, (pose.axis - axis).norm());
    return farthest;
  }
  static double highest_rise(std::span<const HeadPose> poses, const Vec3& tip) {
    double highest = -1e300;
    for (const HeadPose& pose : poses) highest = std::max(highest, (tip - pose.tip).dot(pose.axis) - pose.free_height);
    return highest;
  }

  const double& clearance_;  // may shrink while a search goes on
  HeadBounds bounds_;
};

bool Deposit::touches_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                           double clearance, Index before, Contact* contact) const {
  const HeadView view{head, tip, axis, free_height};
  return visit(before, HeadBundle(head, clearance, HeadPose{tip, axis, free_height, before}), [&](const Sample& sample) {
    const double distance = view.distance(sample.position(), clearance);
    if (distance >= clearance) return false;
    if (contact) *contact = {sample.point, sample.position(), clearance - distance};
    return true;
  });
}

double Deposit::head_gap(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height, double most,
                         Index before) const {
  const HeadView view{head, tip, axis, free_height};
  double gap = most;
  visit(before, HeadBundle(head, gap, HeadPose{tip, axis, free_height, before}), [&](const Sample& sample) {
    gap = std::min(gap, view.distance(sample.position(), gap));
    return false;
  });
  return gap;
}

void Deposit::contacts_of_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                               double clearance, Index before, std::vector<Index>& points) const {
  const HeadView view{head, tip, axis, free_height};
  visit(before, HeadBundle(head, clearance, HeadPose{tip, axis, free_height, before}), [&](const Sample& sample) {
    if (view.distance(sample.position(), clearance) < clearance) points.push_back(sample.point);
    return false;
  });
}

void Deposit::touches_head(const HeadShape& head, std::span<const HeadPose> poses, double clearance,
                           std::span<char> touches) const {
  std::vector<Sample> near;
  for (std::size_t begin = 0, end; begin < poses.size(); begin = end) {
    const HeadPose& first = poses[begin];
    for (end = begin + 1; end < poses.size() && end - begin < kMostTogether; ++end) {
      if ((poses[end].tip - first.tip).squaredNorm() > kTogether_mm * kTogether_mm) break;
      if ((poses[end].axis - first.axis).squaredNorm() > kTogether_rad * kTogether_rad) break;
    }
    const HeadBundle bundle(head, clearance, poses.subspan(begin, end - begin));
    near.clear();
    visit(bundle.before, bundle, [&](const Sample& sample) {
      near.push_back(sample);
      return false;
    });
    for (std::size_t i = begin; i < end; ++i) {
      touches[i] = 0;
      const HeadView view{head, poses[i].tip, poses[i].axis, poses[i].free_height};
      for (const Sample& sample : near) {
        if (sample.point >= poses[i].before || view.distance(sample.position(), clearance) >= clearance) continue;
        touches[i] = 1;
        break;
      }
    }
  }
}

void Deposit::head_gaps(const HeadShape& head, std::span<const HeadPose> poses, double most,
                        std::span<double> gaps) const {
  std::vector<Sample> near;
  const HeadBundle bundle(head, most, poses);
  const bool many = visit(bundle.before, bundle, [&](const Sample& sample) {
    near.push_back(sample);
    return near.size() > kFewNear;
  });
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const HeadPose& pose = poses[i];
    gaps[i] = most;
    if (many) {
      gaps[i] = head_gap(head, pose.tip, pose.axis, pose.free_height, most, pose.before);
      continue;
    }
    const HeadView view{head, pose.tip, pose.axis, pose.free_height};
    for (const Sample& sample : near) {
      if (sample.point < pose.before) gaps[i] = std::min(gaps[i], view.distance(sample.position(), gaps[i]));
    }
  }
}

class Deposit::Capsule {
 public:
  Capsule(const Vec3& from, const Vec3& to, double far)
      : bounds_{.from = single(from),
                .along = single(to - from),
                .inverse = 1.0f / std::max(1e-9f, static_cast<float>((to - from).squaredNorm())),
                .reach = static_cast<float>(far) + kMargin_mm} {}

  template <class Things>
  void spare(const Things& things, Index before, float* spare) const {
    spare_of(bounds_, things, before, spare);
  }

 private:
  CapsuleBounds bounds_;
};

bool Deposit::touches_capsule(const Vec3& a, const Vec3& b, double radius, double clearance, Index before,
                              Contact* contact) const {
  if (std::min(a.z(), b.z()) - radius - clearance > top_before(before)) return false;
  return visit(before, Capsule(a, b, radius + clearance), [&](const Sample& sample) {
    const double distance = distance_to_segment(sample.position(), a, b) - radius;
    if (distance >= clearance) return false;
    if (contact) *contact = {sample.point, sample.position(), clearance - distance};
    return true;
  });
}

double Deposit::top_before(Index before) const {
  const auto path = std::lower_bound(path_end_.begin(), path_end_.end(), before) - path_end_.begin();
  if (top_.empty()) return 0.0;
  return top_[std::min<std::size_t>(path, top_.size() - 1)];
}

}  // namespace curvesup
