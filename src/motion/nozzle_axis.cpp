#include "motion/nozzle_axis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/angle_between.h"

namespace curvesup {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kKeySpacing = 2.0;  // mm between points at which tilt is chosen
constexpr double kKeyTurn = 0.12;    // rad of axis turn between them
constexpr int kAzimuths = 8;
constexpr double kLevelStep = 7.5 * kPi / 180.0;
constexpr int kFiner = 3;   // where the coarse directions have left a contact
constexpr double kAlike = 15.0 * kPi / 180.0;
constexpr int kWindow = 4;  // keys around a fault that may tilt, times the number of levels over 4
constexpr double kFaultCost = 1e6;
constexpr double kBetween = 0.1;    // of the cost at a point, half way to its neighbour
constexpr double kTightCost = 1e3;  // of standing at no distance from what is printed

// Chooses tilts at the key points of one path.
class TiltPlanner {
 public:
  TiltPlanner(const Cell& cell, const Deposit& deposit, Index first_point, std::span<const PathPoint> points,
              std::span<const Vec3> tips, std::span<const Index> before, const MotionOptions& options,
              std::span<const Index> extra_keys, std::span<Vec3> axes, std::span<char> known_free)
      : cell_(cell),
        deposit_(deposit),
        first_point_(first_point),
        points_(points),
        tips_(tips),
        before_(before),
        options_(options),
        axes_(axes),
        known_free_(known_free),
        between_(!extra_keys.empty()) {
    keys_ = key_points(tips, axes, extra_keys);
    const double most = cell.machine().tolerances.max_tilt_deviation.radians();
    levels_ = static_cast<int>(std::ceil(most / kLevelStep));
    window_ = static_cast<std::size_t>(kWindow * std::max(1, levels_ / 4));
    if (between_) {
      levels_ *= kFiner;
      azimuths_ *= kFiner;
    }
    states_ = 1 + levels_ * azimuths_;
    alike_ = alike_states();
  }

  std::vector<AxisFault> run() {
    const std::vector<char> free = free_keys();
    if (std::find(free.begin(), free.end(), 0) == free.end()) {
      for (const std::size_t key : keys_) known_free_[key] = options_.avoid_collisions;
      return {};
    }
    if (levels_ > 0) {
      for (const auto& [begin, end] : windows(free)) plan_window(begin, end);
      apply_offsets();
    }
    return remaining_faults(free);
  }

 private:
  struct Window {
    std::size_t begin, end;  // keys
  };

  // Marks the keys at which the head is free and reached as it stands.
  std::vector<char> free_keys() {
    std::vector<char> touches(keys_.size(), 0), free(keys_.size(), 1);
    if (options_.avoid_collisions) {
      std::vector<Deposit::HeadPose> poses;
      for (const std::size_t i : keys_) poses.push_back({tips_[i], axes_[i], free_height(points_[i]), before_[i]});
      deposit_.touches_head(cell_.head(), poses, cell_.machine().tolerances.clearance_mm, touches);
    }
    for (std::size_t k = 0; k < keys_.size(); ++k) free[k] = !touches[k] && stands(k, axes_[keys_[k]], nullptr);
    return free;
  }

  bool allowed(std::size_t key, const Vec3& axis, AxisFault& fault) {
    const std::size_t i = keys_[key];
    fault.point = first_point_ + static_cast<Index>(i);
    const double clearance = cell_.machine().tolerances.clearance_mm;
    return (!options_.avoid_collisions || !deposit_.touches_head(cell_.head(), tips_[i], axis, free_height(points_[i]),
                                                                 clearance, before_[i], &fault.contact)) &&
           stands(key, axis, &fault);
  }

  // Whether the arm reaches a key, its head above the table.
  bool stands(std::size_t key, const Vec3& axis, AxisFault* fault) {
    const Vec3& tip = tips_[keys_[key]];
    if (options_.avoid_collisions && !cell_.head_above_table(tip, axis)) return false;
    if (reachable(cell_, tip, axis, options_.yaw_samples, hint_, fault ? &fault->arm : nullptr)) return true;
    if (fault) fault->reach = true;
    return false;
  }

  double tight_cost(double gap) const {
    const double wanted = cell_.machine().tolerances.clearance_mm;
    if (gap < 0.0) return kFaultCost * (1.0 - gap);
    return gap < wanted ? kTightCost * (1.0 - gap / wanted) : 0.0;
  }

  // What it costs to lack clearance, or reach, at a key with each of some axes.
  void add_lack_costs(std::size_t key, std::span<const Vec3> axes, std::span<double> costs) {
    if (options_.avoid_collisions) {
      for (const std::vector<int>& states : alike_) add_tight_costs(key, states, axes, costs);
    }
    for (std::size_t s = 0; s < axes.size(); ++s) {
      if (!stands(key, axes[s], nullptr)) costs[s] = 2.0 * kFaultCost;
    }
  }

  void add_tight_costs(std::size_t key, const std::vector<int>& states, std::span<const Vec3> axes,
                       std::span<double> costs) const {
    const std::size_t i = keys_[key];
    const double free = free_height(points_[i]);
    std::vector<Deposit::HeadPose> poses;
    const auto add_poses = [&](const Vec3& tip) {
      for (const int s : states) poses.push_back({tip, axes[static_cast<std::size_t>(s)], free, before_[i]});
    };
    add_poses(tips_[i]);
    if (between_ && i > 0) add_poses(0.5 * (tips_[i - 1] + tips_[i]));
    if (between_ && i + 1 < tips_.size()) add_poses(0.5 * (tips_[i] + tips_[i + 1]));
    std::vector<double> gaps(poses.size());
    deposit_.head_gaps(cell_.head(), poses, cell_.machine().tolerances.clearance_mm, gaps);
    for (std::size_t p = 0; p < poses.size(); ++p) {
      const auto state = static_cast<std::size_t>(states[p % states.size()]);
      costs[state] += (p < states.size() ? 1.0 : kBetween) * tight_cost(gaps[p]);
    }
  }

  // Runs of keys around those that are not free as they stand.
  std::vector<Window> windows(const std::vector<char>& free) const {
    const std::size_t reach = window_;
    std::vector<Window> result;
    for (std::size_t k = 0; k < free.size(); ++k) {
      if (free[k]) continue;
      const std::size_t begin = k > reach ? k - reach : 0, end = std::min(free.size(), k + reach + 1);
      if (!result.empty() && begin <= result.back().end) {
        result.back().end = end;
      } else {
        result.push_back({begin, end});
      }
    }
    return result;
  }

  Vec3 candidate(std::size_t key, int state) const {
    const Vec3& axis = axes_[keys_[key]];
    if (state == 0) return axis;
    const double most = cell_.machine().tolerances.max_tilt_deviation.radians();
    const double tilt = most * ((state - 1) / azimuths_ + 1) / levels_;
    const double azimuth = 2.0 * kPi * ((state - 1) % azimuths_) / azimuths_;
    const Mat3 frame = least_rotation_to(axis);
    // Azimuth 0 tilts the axis towards vertical.
    Vec3 up = Vec3::UnitZ() - axis.z() * axis;
    up = up.norm() > 1e-6 ? Vec3(up.normalized()) : Vec3(frame.col(0));
    const Vec3 side = axis.cross(up);
    const Vec3 tilted = std::cos(tilt) * axis + std::sin(tilt) * (std::cos(azimuth) * up + std::sin(azimuth) * side);
    return limited_axis(tilted.normalized(), points_[keys_[key]].normal, most);
  }

  double spacing(std::size_t key) const {
    double length = 0.0;
    for (std::size_t i = keys_[key - 1] + 1; i <= keys_[key]; ++i) length += (tips_[i] - tips_[i - 1]).norm();
    return length;
  }

  // States whose axes are near each other, about kAlike apart.
  std::vector<std::vector<int>> alike_states() const {
    const int levels = std::max(1, static_cast<int>(kAlike / kLevelStep * (between_ ? kFiner : 1)));
    const int azimuths = std::max(1, azimuths_ / kAzimuths);
    const int bands = (levels_ + levels - 1) / levels, sectors = (azimuths_ + azimuths - 1) / azimuths;
    std::vector<std::vector<int>> groups(1 + static_cast<std::size_t>(bands * sectors));
    groups[0] = {0};
    for (int s = 1; s < states_; ++s) {
      const int band = (s - 1) / azimuths_ / levels, sector = (s - 1) % azimuths_ / azimuths;
      groups[1 + static_cast<std::size_t>(band * sectors + sector)].push_back(s);
    }
    return groups;
  }

  void plan_window(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin, states = static_cast<std::size_t>(states_);
    std::vector<Vec3> axis(count * states);
    std::vector<double> cost(count * states);
    std::vector<int> parent(count * states, 0);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t key = begin + k, row = k * states;
      const double length = key > 0 ? std::max(0.1, spacing(key)) : kKeySpacing;
      const std::span<Vec3> axes = std::span(axis).subspan(row, states);
      std::vector<double> own(states, 0.0);
      for (std::size_t s = 0; s < states; ++s) axes[s] = candidate(key, static_cast<int>(s));
      add_lack_costs(key, axes, own);
      for (std::size_t s = 0; s < states; ++s) {
        const double deviation = angle_between(axes[s], points_[keys_[key]].normal);
        cost[row + s] = deviation * deviation * length + own[s];
      }
      if (k == 0) continue;
      const auto both = [&](auto& values) { return std::span(values).subspan(row - states, 2 * states); };
      add_way_costs(key, length, both(axis), both(cost), std::span(parent).subspan(row, states));
    }
    int state = static_cast<int>(std::min_element(cost.end() - states_, cost.end()) - (cost.end() - states_));
    offsets_.resize(keys_.size(), Vec3::Zero());
    for (std::size_t k = count; k-- > 0;) {
      offsets_[begin + k] = axis[k * states + static_cast<std::size_t>(state)] - axes_[keys_[begin + k]];
      state = parent[k * states + static_cast<std::size_t>(state)];
    }
  }

  // Adds what it costs at least to come to each state of a key from those of the key before; `axis` and `cost` hold the
  // states of both, `parent` gets the one to come from: the first of the cheapest.
  void add_way_costs(std::size_t key, double length, std::span<const Vec3> axis, std::span<double> cost,
                     std::span<int> parent) const {
    const std::size_t states = parent.size();
    const auto cost_of = [&](int state) { return cost[static_cast<std::size_t>(state)]; };
    const double rate = cell_.machine().tolerances.max_tilt_rate_deg_mm * kPi / 180.0;
    const double free_turn = std::max(angle_between(axes_[keys_[key - 1]], axes_[keys_[key]]), rate * length);
    const auto way_cost = [&](double so_far, double turn) {
      return so_far + 0.5 * turn * turn / length + 100.0 * std::max(0.0, turn - free_turn);
    };
    std::vector<int> cheapest(states);
    std::iota(cheapest.begin(), cheapest.end(), 0);
    std::stable_sort(cheapest.begin(), cheapest.end(), [&](int a, int b) { return cost_of(a) < cost_of(b); });
    for (std::size_t s = 0; s < states; ++s) {
      double best = std::numeric_limits<double>::infinity();
      for (const int from : cheapest) {
        const double so_far = cost_of(from);
        if (so_far > best) break;
        const Vec3 &before = axis[static_cast<std::size_t>(from)], &behind = axis[states + s];
        // A turn is never less than its chord.
        if (way_cost(so_far, (1.0 - 1e-9) * (behind - before).norm()) > best) continue;
        const double way = way_cost(so_far, angle_between(before, behind));
        if (way > best || (way == best && from > parent[s])) continue;
        best = way;
        parent[s] = from;
      }
      cost[states + s] += best;
    }
  }

  // Offsets of the key axes, linear in arc length between keys.
  void apply_offsets() {
    if (offsets_.empty()) return;
    const double most = cell_.machine().tolerances.max_tilt_deviation.radians();
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      const std::size_t from = k == 0 ? 0 : keys_[k - 1], to = keys_[k];
      const double length = k == 0 ? 0.0 : spacing(k);
      double passed = 0.0;
      for (std::size_t i = from + (k > 0); i <= to; ++i) {
        if (i > from) passed += (tips_[i] - tips_[i - 1]).norm();
        const double t = length > 0.0 ? passed / length : 1.0;
        const Vec3 offset = k == 0 ? offsets_[0] : Vec3((1.0 - t) * offsets_[k - 1] + t * offsets_[k]);
        if (offset.squaredNorm() > 0.0) axes_[i] = limited_axis((axes_[i] + offset).normalized(), points_[i].normal, most);
      }
    }
  }

  std::vector<AxisFault> remaining_faults(const std::vector<char>& was_free) {
    std::vector<AxisFault> faults;
    const std::size_t reach = window_;
    std::vector<char> near(was_free.size(), 0);
    for (std::size_t k = 0; k < was_free.size(); ++k) {
      if (was_free[k]) continue;
      for (std::size_t j = k > reach ? k - reach : 0; j < std::min(was_free.size(), k + reach + 1); ++j) near[j] = 1;
    }
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      AxisFault fault;
      if (near[k] && !allowed(k, axes_[keys_[k]], fault)) faults.push_back(fault);
    }
    return faults;
  }

  const Cell& cell_;
  const Deposit& deposit_;
  Index first_point_;
  std::span<const PathPoint> points_;
  std::span<const Vec3> tips_;
  std::span<const Index> before_;
  const MotionOptions& options_;
  std::span<Vec3> axes_;
  std::span<char> known_free_;
  bool between_;  // poses half way to the neighbouring points count too
  std::vector<std::size_t> keys_;
  std::vector<Vec3> offsets_;
  std::size_t window_ = 0;
  int levels_ = 0, azimuths_ = kAzimuths, states_ = 1;
  std::vector<std::vector<int>> alike_;
  ReachHint hint_;
};

}  // namespace

Vec3 limited_axis(const Vec3& axis, const Vec3& centre, double limit) {
  const double chord = (axis - centre).squaredNorm();
  if (chord <= 1.0 && 1.1 * chord <= limit * limit) return axis;  // an angle up to a radian is 1.048 of its chord at most
  const double angle = angle_between(axis, centre);
  if (angle <= limit) return axis;
  const Vec3 across = (axis - axis.dot(centre) * centre).normalized();
  return (std::cos(limit) * centre + std::sin(limit) * across).normalized();
}

std::vector<Vec3> directions_around(const Vec3& axis, double most) {
  constexpr int kLevels = 6, kTurns = 24;
  const Mat3 frame = least_rotation_to(axis);
  std::vector<Vec3> directions = {axis};
  for (int level = 1; level <= kLevels; ++level) {
    const double tilt = most * level / kLevels;
    for (int turn = 0; turn < kTurns; ++turn) {
      const double azimuth = 2.0 * kPi * turn / kTurns;
      directions.push_back(frame * Vec3(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), std::cos(tilt)));
    }
  }
  return directions;
}

std::vector<std::size_t> key_points(std::span<const Vec3> tips, std::span<const Vec3> axes,
                                    std::span<const Index> extra) {
  std::vector<std::size_t> keys = {0};
  std::size_t next = 0;
  double length = 0.0, turn = 0.0;
  for (std::size_t i = 1; i < tips.size(); ++i) {
    length += (tips[i] - tips[i - 1]).norm();
    turn += (axes[i] - axes[i - 1]).norm();
    while (next < extra.size() && extra[next] < static_cast<Index>(i)) ++next;
    const bool wanted = next < extra.size() && extra[next] == static_cast<Index>(i);
    if (length < kKeySpacing && turn < kKeyTurn && i + 1 < tips.size() && !wanted) continue;
    keys.push_back(i);
    length = turn = 0.0;
  }
  return keys;
}

double free_height(const PathPoint& point) { return std::max(0.3, 2.0 * point.tip_offset_mm); }

std::vector<double> yaw_values(int samples) {
  const int side = std::max(0, (samples - 1) / 2);
  const double step = 2.0 * kPi / std::max(1, samples);
  std::vector<double> values = {0.0};
  for (int i = 1; i <= side; ++i) {
    values.push_back(i * step);
    values.push_back(-i * step);
  }
  return values;
}

bool reachable(const Cell& cell, const Vec3& tip, const Vec3& axis, int yaw_samples, ReachHint& hint, ArmFault* fault) {
  Joints joints;
  if (cell.solve(tip, axis, hint.yaw, hint.branch, joints) == ArmFault::none) return true;
  ArmFault least = ArmFault::reach;
  for (const double yaw : yaw_values(yaw_samples)) {
    std::array<Posture, 8> postures;
    const int count = inverse_kinematics(cell.machine().arm, cell.flange_frame(tip, axis, yaw), postures);
    for (int i = 0; i < count; ++i) {
      const Posture& posture = postures[static_cast<std::size_t>(i)];
      const ArmFault found = cell.arm_fault(posture);
      if (found == ArmFault::none) {
        hint = {yaw, posture.branch};
        return true;
      }
      if (least == ArmFault::reach) least = found;
    }
  }
  if (fault) *fault = least;
  return false;
}

// The axis follows its normal at no more than the allowed rate, once from the path's start and once from its end; the
// mean of both turns no faster and lags on neither side.
void smooth_axes(std::span<const PathPoint> points, std::span<const Vec3> tips, const Tolerances& tolerances,
                 std::span<Vec3> axes) {
  const double rate = tolerances.max_tilt_rate_deg_mm * kPi / 180.0;
  const double most = tolerances.max_tilt_deviation.radians();
  const std::size_t count = points.size();
  if (count == 0) return;
  const auto reach = [&](std::size_t a, std::size_t b) { return rate * (tips[a] - tips[b]).norm(); };
  axes[0] = points[0].normal;
  for (std::size_t i = 1; i < count; ++i) axes[i] = limited_axis(points[i].normal, axes[i - 1], reach(i, i - 1));
  Vec3 back = points[count - 1].normal;
  for (std::size_t i = count; i-- > 0;) {
    if (i + 1 < count) back = limited_axis(points[i].normal, back, reach(i, i + 1));
    const Vec3 mean = axes[i] + back;
    if (mean.norm() > 1e-6) axes[i] = mean.normalized();
    axes[i] = limited_axis(axes[i], points[i].normal, most);
  }
}

std::vector<AxisFault> tilt_axes(const Cell& cell, const Deposit& deposit, Index first_point,
                                 std::span<const PathPoint> points, std::span<const Vec3> tips,
                                 std::span<const Index> before, const MotionOptions& options,
                                 std::span<const Index> extra_keys, std::span<Vec3> axes, std::span<char> known_free) {
  return TiltPlanner(cell, deposit, first_point, points, tips, before, options, extra_keys, axes, known_free).run();
}

}  // namespace curvesup
