#include "motion/nozzle_axis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curvesup {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kKeySpacing = 2.0;  // mm between points at which tilt is chosen
constexpr double kKeyTurn = 0.12;    // rad of axis turn between them
constexpr int kAzimuths = 8;
constexpr double kLevelStep = 7.5 * kPi / 180.0;
constexpr int kFiner = 3;   // where the coarse directions have left a contact
constexpr int kWindow = 4;  // keys around a fault that may tilt, times the number of levels over 4
constexpr double kFaultCost = 1e6;
constexpr double kBetween = 0.1;    // of the cost at a point, half way to its neighbour
constexpr double kTightCost = 1e3;  // of standing at no distance from what is printed

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

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
  }

  std::vector<AxisFault> run() {
    std::vector<char> free(keys_.size(), 1);
    bool any = false;
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      free[k] = allowed(k, axes_[keys_[k]], nullptr);
      any = any || !free[k];
    }
    if (!any) {
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

  bool allowed(std::size_t key, const Vec3& axis, AxisFault* fault) {
    const std::size_t i = keys_[key];
    const Index before = before_[i];
    const Tolerances& tolerances = cell_.machine().tolerances;
    if (fault) fault->point = first_point_ + static_cast<Index>(i);
    if (options_.avoid_collisions) {
      if (!cell_.head_above_table(tips_[i], axis)) return false;
      if (deposit_.touches_head(cell_.head(), tips_[i], axis, free_height(points_[i]), tolerances.clearance_mm, before,
                                fault ? &fault->contact : nullptr)) {
        return false;
      }
    }
    if (reachable(cell_, tips_[i], axis, options_.yaw_samples, hint_, fault ? &fault->arm : nullptr)) return true;
    if (fault) fault->reach = true;
    return false;
  }

  double tight_cost(std::size_t i, const Vec3& tip, const Vec3& axis) const {
    const double wanted = cell_.machine().tolerances.clearance_mm;
    const double gap = deposit_.head_gap(cell_.head(), tip, axis, free_height(points_[i]), wanted, before_[i]);
    if (gap < 0.0) return kFaultCost * (1.0 - gap);
    return gap < wanted ? kTightCost * (1.0 - gap / wanted) : 0.0;
  }

  // What it costs to lack clearance, or reach, there.
  double lack_cost(std::size_t key, const Vec3& axis) {
    const std::size_t i = keys_[key];
    double cost = 0.0;
    if (options_.avoid_collisions) {
      if (!cell_.head_above_table(tips_[i], axis)) return 2.0 * kFaultCost;
      cost = tight_cost(i, tips_[i], axis);
      if (between_ && i > 0) cost += kBetween * tight_cost(i, 0.5 * (tips_[i - 1] + tips_[i]), axis);
      if (between_ && i + 1 < tips_.size()) cost += kBetween * tight_cost(i, 0.5 * (tips_[i] + tips_[i + 1]), axis);
    }
    return reachable(cell_, tips_[i], axis, options_.yaw_samples, hint_) ? cost : 2.0 * kFaultCost;
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

  void plan_window(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<Vec3> axis(count * states_);
    std::vector<double> cost(count * states_);
    std::vector<int> parent(count * states_, 0);
    const double rate = cell_.machine().tolerances.max_tilt_rate_deg_mm * kPi / 180.0;
    for (std::size_t k = 0; k < count; ++k) {
      const double length = begin + k > 0 ? std::max(0.1, spacing(begin + k)) : kKeySpacing;
      for (int s = 0; s < states_; ++s) {
        const std::size_t slot = k * states_ + s;
        axis[slot] = candidate(begin + k, s);
        const double deviation = angle_between(axis[slot], points_[keys_[begin + k]].normal);
        const double own = deviation * deviation * length + lack_cost(begin + k, axis[slot]);
        double best = k == 0 ? 0.0 : 1e300;
        for (int from = 0; k > 0 && from < states_; ++from) {
          const std::size_t before = slot - s - states_ + from;
          const double turn = angle_between(axis[before], axis[slot]);
          const double natural = angle_between(axes_[keys_[begin + k - 1]], axes_[keys_[begin + k]]);
          const double excess = std::max(0.0, turn - std::max(natural, rate * length));
          const double step = cost[before] + 0.5 * turn * turn / length + 100.0 * excess;
          if (step < best) {
            best = step;
            parent[slot] = from;
          }
        }
        cost[slot] = best + own;
      }
    }
    int state = static_cast<int>(std::min_element(cost.end() - states_, cost.end()) - (cost.end() - states_));
    offsets_.resize(keys_.size(), Vec3::Zero());
    for (std::size_t k = count; k-- > 0;) {
      offsets_[begin + k] = axis[k * states_ + state] - axes_[keys_[begin + k]];
      state = parent[k * states_ + state];
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
      if (near[k] && !allowed(k, axes_[keys_[k]], &fault)) faults.push_back(fault);
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
