#include "motion/deposit.h"

#include <algorithm>
#include <cmath>

namespace curvesup {
namespace {

constexpr float kFloatError = 1e-3f;  // mm, of a centre in single precision
constexpr float kMargin_mm = 2e-3f;   // of all that is worked out in single precision, for parts up to a metre
constexpr float kRounded = 1e-3f;      // of the sine of an angle whose cosine is in single precision
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
  for (Leaf& leaf : leaves_) {
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

Deposit::Leaf::Leaf() {
  x.fill(Four::Zero());
  y.fill(Four::Zero());
  z.fill(Four::Zero());
  point.fill(kNever);
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
  leaves_.assign((samples_ + Leaf::kSize - 1) / Leaf::kSize, {});
  std::vector<Vec3f> normals(leaves_.size(), Vec3f::Zero());
  for (std::size_t i = 0; i < samples_; ++i) {
    const LooseSample& sample = loose_[order[i]];
    Leaf& leaf = leaves_[i / Leaf::kSize];
    const std::size_t at = i % Leaf::kSize;
    leaf.x[at / 4][at % 4] = sample.x;
    leaf.y[at / 4][at % 4] = sample.y;
    leaf.z[at / 4][at % 4] = sample.z;
    leaf.point[at] = sample.point;
    normals[i / Leaf::kSize] += Vec3f(sample.normal[0], sample.normal[1], sample.normal[2]);
  }
  std::vector<LooseSample>().swap(loose_);
  build_quads(normals);
  find_earliest();
}

void Deposit::build_quads(std::span<const Vec3f> leaf_normals) {
  std::size_t width = 4, count = 1;  // of the last level; of quads
  while (width < leaves_.size()) {
    count += width;
    width *= 4;
  }
  quads_.assign(count, {});
  struct Box {
    Vec3f low = Vec3f::Constant(1e30f), high = Vec3f::Constant(-1e30f), normal = Vec3f::Zero();
    [[nodiscard]] bool empty() const { return low.x() > high.x(); }
    [[nodiscard]] Vec3f middle() const { return 0.5f * (low + high); }
  };
  std::vector<Box> boxes(count + width);
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    Box& box = boxes[count + l];
    for (std::size_t i = 0; i < Leaf::kSize && leaves_[l].point[i] != kNever; ++i) {
      const Vec3f at = leaves_[l].at(i).position().cast<float>();
      box.low = box.low.cwiseMin(at);
      box.high = box.high.cwiseMax(at);
    }
    box.normal = leaf_normals[l];
  }
  const auto half_thickness = [&](std::size_t node, const Vec3f& middle, const Vec3f& normal) {
    float most = 0.0f;
    if (node >= count) {
      const Leaf& leaf = leaves_[leaf_of(node)];
      for (std::size_t i = 0; i < Leaf::kSize && leaf.point[i] != kNever; ++i) {
        most = std::max(most, std::abs(normal.dot(leaf.at(i).position().cast<float>() - middle)));
      }
    } else {
      const Four reach = quads_[node].reach(normal);
      for (int j = 0; j < 4; ++j) {
        const Box& box = boxes[4 * node + 1 + static_cast<std::size_t>(j)];
        if (!box.empty()) most = std::max(most, std::abs(normal.dot(box.middle() - middle)) + reach[j]);
      }
    }
    return most + kFloatError;
  };
  for (std::size_t q = count; q-- > 0;) {
    for (int j = 0; j < 4; ++j) {
      const std::size_t child = 4 * q + 1 + static_cast<std::size_t>(j);
      const Box& box = boxes[child];
      if (box.empty()) continue;
      boxes[q].low = boxes[q].low.cwiseMin(box.low);
      boxes[q].high = boxes[q].high.cwiseMax(box.high);
      boxes[q].normal += box.normal;
      const Vec3f middle = box.middle(), half = 0.5f * (box.high - box.low) + Vec3f::Constant(kFloatError);
      const Vec3f normal = box.normal.norm() > 0.0f ? Vec3f(box.normal.normalized()) : Vec3f(Vec3f::UnitZ());
      Quad& quad = quads_[q];
      quad.x[j] = middle.x();
      quad.y[j] = middle.y();
      quad.z[j] = middle.z();
      quad.half_x[j] = half.x();
      quad.half_y[j] = half.y();
      quad.half_z[j] = half.z();
      quad.radius[j] = half.norm() + kFloatError;
      quad.normal_x[j] = normal.x();
      quad.normal_y[j] = normal.y();
      quad.normal_z[j] = normal.z();
      quad.half_thickness[j] = half_thickness(child, middle, normal);
    }
  }
}

Deposit::Four Deposit::Quad::reach(const Vec3f& direction) const {
  const Vec3f level = direction.cwiseAbs();
  const Four box = half_x * level.x() + half_y * level.y() + half_z * level.z();
  const Four cosine = normal_x * direction.x() + normal_y * direction.y() + normal_z * direction.z();
  // Rounding takes up to 7e-4 from the sine of a small angle.
  const Four sine = (1.0f - cosine * cosine).max(0.0f).sqrt() + kRounded;
  return box.min(half_thickness * cosine.abs() + radius * sine);
}

void Deposit::find_earliest() {
  for (std::size_t q = quads_.size(); q-- > 0;) {
    for (std::size_t j = 0; j < 4; ++j) {
      const std::size_t child = 4 * q + 1 + j;
      Index earliest = kNever;
      if (child < quads_.size()) {
        earliest = *std::min_element(quads_[child].earliest.begin(), quads_[child].earliest.end());
      } else if (leaf_of(child) < leaves_.size()) {
        const auto& points = leaves_[leaf_of(child)].point;
        earliest = *std::min_element(points.begin(), points.end());
      }
      quads_[q].earliest[j] = earliest;
    }
  }
}

template <class Body, class Visit>
bool Deposit::visit(Index before, const Body& body, const Visit& visit) const {
  if (quads_.empty()) return false;
  std::size_t stack[64];
  float least[64];  // spare of each
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (node < quads_.size()) {
      const Quad& quad = quads_[node];
      const Four spare = body.spare(quad);
      const int first = depth;
      for (int j = 0; j < 4; ++j) {
        if (quad.earliest[static_cast<std::size_t>(j)] >= before || spare[j] >= 0.0f) continue;
        // What lies deepest comes next.
        int at = depth++;
        for (; at > first && least[at - 1] < spare[j]; --at) {
          stack[at] = stack[at - 1];
          least[at] = least[at - 1];
        }
        stack[at] = 4 * node + 1 + static_cast<std::size_t>(j);
        least[at] = spare[j];
      }
      continue;
    }
    const Leaf& leaf = leaves_[leaf_of(node)];
    for (std::size_t group = 0; group < Leaf::kGroups; ++group) {
      const Four spare = body.spare(leaf.x[group], leaf.y[group], leaf.z[group]);
      for (std::size_t j = 0; j < 4; ++j) {
        const std::size_t i = 4 * group + j;
        if (leaf.point[i] < before && spare[static_cast<int>(j)] < 0.0f && visit(leaf.at(i))) return true;
      }
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

  [[nodiscard]] Four spare(const Quad& boxes) const {
    View view(*this, boxes.x, boxes.y, boxes.z);
    const Four along = boxes.reach(axis_), far = view.distance + boxes.radius;
    const Four below = below_of(view.height + along, far);
    if (below.minCoeff() >= 0.0f) return below;
    view.look_aside(*this);
    // The distance from the hull's flank grows fastest along its normal; being convex, it is nowhere in the box less than
    // that slope says.
    const Four inverse = cosine_ / view.radius.max(kNearAxis);
    const Four normal = (view.x * inverse - sine_axis_.x()).abs() * boxes.half_x +
                        (view.y * inverse - sine_axis_.y()).abs() * boxes.half_y +
                        (view.z * inverse - sine_axis_.z()).abs() * boxes.half_z + kRelative * boxes.radius;
    const Four aside = (view.radius > kNearAxis).select(normal, boxes.radius);
    const Four gap = (view.flank(*this) - aside)
                         .max(-view.height - along)
                         .max(view.radius - widest_ - boxes.radius)
                         .max(view.height - length_ - along);
    return below.max(spare_of(far, gap));
  }
  [[nodiscard]] Four spare(const Four& x, const Four& y, const Four& z) const {
    View view(*this, x, y, z);
    const Four below = below_of(view.height, view.distance);
    if (below.minCoeff() >= 0.0f) return below;
    view.look_aside(*this);
    const Four gap = view.flank(*this).max(-view.height).max(view.radius - widest_).max(view.height - length_);
    return below.max(spare_of(view.distance, gap));
  }

 private:
  static constexpr float kNearAxis = 1.0f;    // mm, where a direction from the axis is not known well enough
  static constexpr float kRelative = 1e-4f;   // of such a direction

  HeadBundle(const HeadShape& head, const double& clearance, const Vec3& tip, const Vec3& axis, std::span<const HeadPose> poses)
      : HeadBundle(head, clearance, tip, axis, farthest_tip(poses, tip), farthest_axis(poses, axis), highest_rise(poses, tip)) {
    for (const HeadPose& pose : poses) before = std::max(before, pose.before);
  }
  // shift: between tips; turn: between axes, as a chord; rise: of the middle's tip above another's tip plane, less that
  // one's free height.
  HeadBundle(const HeadShape& head, const double& clearance, const Vec3& tip, const Vec3& axis, double shift, double turn, double rise)
      : clearance_(clearance),
        tip_(tip.cast<float>()),
        axis_(axis.cast<float>()),
        sine_axis_(head.hull_cosine() * head.hull_slope() * axis_),
        tip_radius_(head.tip_radius()),
        slope_(head.hull_slope()),
        cosine_(head.hull_cosine()),
        widest_(head.widest()),
        length_(static_cast<float>(head.length())),
        turn_(static_cast<float>(turn)),
        rise_(static_cast<float>(rise) + kMargin_mm),
        // 1.05: an angle over its chord; distances change no more than a point is moved.
        swing_(1.05f * turn_),
        apart_(static_cast<float>(shift * (1.0 + 1.05 * turn)) + kMargin_mm) {}

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

  // Points as the middle pose sees them: height and distance, then the radius and what leads to them from the axis.
  struct View {
    Four height, x, y, z, radius, distance;
    [[gnu::always_inline]] View(const HeadBundle& bundle, const Four& px, const Four& py, const Four& pz) {
      x = px - bundle.tip_.x();
      y = py - bundle.tip_.y();
      z = pz - bundle.tip_.z();
      height = x * bundle.axis_.x() + y * bundle.axis_.y() + z * bundle.axis_.z();
      distance = (x * x + y * y + z * z).sqrt();
    }
    [[gnu::always_inline]] void look_aside(const HeadBundle& bundle) {
      x -= height * bundle.axis_.x();
      y -= height * bundle.axis_.y();
      z -= height * bundle.axis_.z();
      radius = (x * x + y * y + z * z).sqrt();
    }
    [[gnu::always_inline, nodiscard]] Four flank(const HeadBundle& bundle) const {
      return (radius - bundle.tip_radius_ - bundle.slope_ * height) * bundle.cosine_;
    }
  };

  // How far what is no higher, and no farther from the tip, lies below all that counts.
  [[gnu::always_inline, nodiscard]] Four below_of(const Four& top, const Four& far) const {
    return -(top + rise_ + far * turn_);
  }
  // From the greatest distance from the tip and the least distance from the head.
  [[gnu::always_inline, nodiscard]] Four spare_of(const Four& far, const Four& gap) const {
    return gap - apart_ - swing_ * far - static_cast<float>(clearance_);
  }

  const double& clearance_;  // may shrink while a search goes on
  Vec3f tip_, axis_, sine_axis_;
  float tip_radius_, slope_, cosine_, widest_, length_;
  float turn_, rise_, swing_, apart_;
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
      : a_(from.cast<float>()),
        along_((to - from).cast<float>()),
        inverse_(1.0f / std::max(1e-9f, along_.squaredNorm())),
        reach_(static_cast<float>(far) + kMargin_mm) {}

  [[nodiscard]] Four spare(const Quad& boxes) const { return spare(boxes.x, boxes.y, boxes.z) - boxes.radius; }
  [[nodiscard]] Four spare(const Four& px, const Four& py, const Four& pz) const {
    const Four x = px - a_.x(), y = py - a_.y(), z = pz - a_.z();
    const Four t = ((x * along_.x() + y * along_.y() + z * along_.z()) * inverse_).max(0.0f).min(1.0f);
    return ((x - t * along_.x()).square() + (y - t * along_.y()).square() + (z - t * along_.z()).square()).sqrt() - reach_;
  }

 private:
  Eigen::Vector3f a_, along_;
  float inverse_, reach_;  // of the squared length; radius and clearance
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
