#include "motion/arm_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/angle_between.h"

namespace curvesup {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kComfort = 0.35;     // singularity metric above which a posture costs nothing
constexpr double kKeyTurn = 0.15;     // rad of axis turn between key waypoints
constexpr double kMostKeyStep = 0.9;  // rad that a joint may turn between key waypoints
constexpr double kForbidden = 1e300;
constexpr int kBranches = 8;
constexpr int kRefinements = 6;
constexpr std::size_t kSweptTogether = 64;  // waypoints whose links are looked at together

double discomfort(double metric) {
  const double lack = std::max(0.0, kComfort - metric);
  return 40.0 * lack * lack;
}

// Key waypoints with every posture there, and the cheapest way to each.
class PostureGraph {
 public:
  PostureGraph(const Cell& cell, const Deposit* obstacles, std::span<const DraftPoint> drafts,
               const MotionOptions& options, const ArmState& before)
      : cell_(cell), obstacles_(obstacles), drafts_(drafts), before_(before), yaws_(yaw_values(options.yaw_samples)) {
    std::sort(yaws_.begin(), yaws_.end());
    states_ = static_cast<int>(yaws_.size()) * kBranches;
  }

  // Extends the cheapest ways over the keys from `first` on; ends before the first key that no way reaches.
  // Returns how many keys were passed; `fault` says why it ended.
  std::size_t sweep(const std::vector<std::size_t>& keys, std::size_t first, bool from_state, ArmFault* fault) {
    cost_.clear();
    parent_.clear();
    first_ = first;
    std::vector<Joints> joints(states_), previous(states_);
    std::size_t passed = 0;
    for (std::size_t k = first; k < keys.size(); ++k, ++passed) {
      cost_.resize((passed + 1) * states_, kForbidden);
      parent_.resize((passed + 1) * states_, -1);
      const DraftPoint& draft = drafts_[keys[k]];
      double length = 0.0;
      for (std::size_t i = k > first ? keys[k - 1] + 1 : keys[k] + 1; i <= keys[k]; ++i) {
        length += (drafts_[i].tip - drafts_[i - 1].tip).norm();
      }
      ArmFault least = ArmFault::reach;
      bool any = false;
      for (std::size_t y = 0; y < yaws_.size(); ++y) {
        std::array<Posture, kBranches> postures;
        const int found_postures = inverse_kinematics(
            cell_.machine().arm, cell_.flange_frame(draft.tip, draft.axis, yaws_[y]), postures);
        for (int i = 0; i < found_postures; ++i) {
          const Posture& posture = postures[static_cast<std::size_t>(i)];
          const ArmFault found = cell_.arm_fault(posture);
          if (found != ArmFault::none) {
            if (least == ArmFault::reach) least = found;
            continue;
          }
          const int state = static_cast<int>(y) * kBranches + posture.branch;
          joints[state] = posture.joints;
          const double own = discomfort(posture.singularity) * (0.5 + length) + 0.002 * yaws_[y] * yaws_[y];
          const double way = passed == 0 ? start_cost(state, joints[state], from_state)
                                         : arrive(passed, state, joints[state], previous, length);
          if (way >= kForbidden || touches(joints[state], draft.point)) continue;
          cost_[passed * states_ + state] = way + own;
          any = true;
        }
      }
      if (!any) {
        if (fault) *fault = least;
        break;
      }
      previous.swap(joints);
    }
    return passed;
  }

  // States of the cheapest way over the first `count` keys of the last sweep.
  std::vector<int> trace(std::size_t count) const {
    std::vector<int> states(count);
    const auto last = cost_.begin() + static_cast<std::ptrdiff_t>((count - 1) * states_);
    int state = static_cast<int>(std::min_element(last, last + states_) - last);
    for (std::size_t k = count; k-- > 0;) {
      states[k] = state;
      state = parent_[k * states_ + state];
    }
    return states;
  }

  [[nodiscard]] double yaw(int state) const { return yaws_[state / kBranches]; }
  [[nodiscard]] static int branch(int state) { return state % kBranches; }

 private:
  bool touches(const Joints& joints, Index before) const {
    return obstacles_ && touching_link(cell_, *obstacles_, joints, before, cell_.machine().tolerances.clearance_mm);
  }

  double start_cost(int state, const Joints& joints, bool from_state) const {
    if (!from_state || !before_.known) return 0.0;
    return 0.5 * std::abs(yaw(state) - before_.yaw) + 0.5 * largest_joint_step(before_.joints, joints);
  }

  double arrive(std::size_t key, int state, const Joints& joints, const std::vector<Joints>& previous, double length) {
    const int y = state / kBranches, b = branch(state);
    const double rate = cell_.machine().tolerances.max_yaw_rate_deg_mm * kPi / 180.0;
    const double spacing = yaws_.size() > 1 ? yaws_[1] - yaws_[0] : 1.0;
    const int most = std::min(3, static_cast<int>(rate * length / spacing));
    double best = kForbidden;
    for (int d = -most; d <= most; ++d) {
      if (y + d < 0 || y + d >= static_cast<int>(yaws_.size())) continue;
      const int from = (y + d) * kBranches + b;
      const double so_far = cost_[(key - 1) * states_ + from];
      if (so_far >= kForbidden) continue;
      const double step = largest_joint_step(previous[from], joints);
      if (step > kMostKeyStep) continue;
      const double turn = d * spacing;
      const double way = so_far + 2.0 * turn * turn / std::max(length, 0.5) + 0.2 * step;
      if (way < best) {
        best = way;
        parent_[key * states_ + state] = from;
      }
    }
    return best;
  }

  const Cell& cell_;
  const Deposit* obstacles_;
  std::span<const DraftPoint> drafts_;
  const ArmState& before_;
  std::vector<double> yaws_;
  int states_ = 0;
  std::size_t first_ = 0;
  std::vector<double> cost_;
  std::vector<int> parent_;
};

// Postures of all waypoints of [begin, end] for yaws given at keys; false at the first waypoint that has none.
bool fill_section(const Cell& cell, std::span<const DraftPoint> drafts, std::size_t begin, std::size_t end,
                  const std::vector<double>& yaws, int branch, ArmSection& section, std::size_t& failed) {
  section.branch = branch;
  section.points.clear();
  for (std::size_t i = begin; i <= end; ++i) {
    ArmPoint point{drafts[i], yaws[i - begin], {}};
    if (cell.solve(point.draft.tip, point.draft.axis, point.yaw, branch, point.joints) != ArmFault::none) {
      failed = i;
      return false;
    }
    if (!section.points.empty() && largest_joint_step(section.points.back().joints, point.joints) > kMostKeyStep) {
      failed = i;
      return false;
    }
    section.points.push_back(point);
  }
  return true;
}

std::vector<std::size_t> key_waypoints(std::span<const DraftPoint> drafts, double spacing) {
  std::vector<std::size_t> keys = {0};
  double length = 0.0, turn = 0.0;
  for (std::size_t i = 1; i < drafts.size(); ++i) {
    length += (drafts[i].tip - drafts[i - 1].tip).norm();
    turn += angle_between(drafts[i].axis, drafts[i - 1].axis);
    if (length < spacing && turn < kKeyTurn && i + 1 < drafts.size()) continue;
    keys.push_back(i);
    length = turn = 0.0;
  }
  return keys;
}

// The posture at a waypoint when it is comfortable.
bool comfortable(const Cell& cell, const DraftPoint& draft, int branch, double yaw, Posture& posture) {
  return cell.solve(draft.tip, draft.axis, yaw, branch, posture) == ArmFault::none && posture.singularity >= kComfort;
}

bool keys_comfortable(const Cell& cell, std::span<const DraftPoint> drafts, const std::vector<std::size_t>& keys,
                      int branch, double yaw) {
  Posture posture;
  for (const std::size_t key : keys) {
    if (!comfortable(cell, drafts[key], branch, yaw, posture)) return false;
  }
  return true;
}

// Turns of the head, nearest to the one before first, that one itself at their head.
std::vector<double> yaws_from(int yaw_samples, double before) {
  std::vector<double> yaws = yaw_values(yaw_samples);
  std::stable_sort(yaws.begin(), yaws.end(),
                   [&](double a, double b) { return std::abs(a - before) < std::abs(b - before); });
  yaws.insert(yaws.begin(), before);
  return yaws;
}

// The path as the arm stands before, or with its head turned as little as serves.
std::optional<ArmSection> keep_posture(const Cell& cell, std::span<const DraftPoint> drafts,
                                       const std::vector<std::size_t>& keys, int yaw_samples, const ArmState& before) {
  if (!before.known) return std::nullopt;
  for (const double yaw : yaws_from(yaw_samples, before.yaw)) {
    if (!keys_comfortable(cell, drafts, keys, before.branch, yaw)) continue;
    if (auto section = hold_posture(cell, nullptr, drafts, before.branch, yaw)) return section;
  }
  return std::nullopt;
}

// Yaw of every waypoint, linear in path length between the keys `states` belong to.
std::vector<double> interpolate_yaws(std::span<const DraftPoint> drafts, const std::vector<std::size_t>& keys,
                                     std::size_t first, const std::vector<double>& key_yaws) {
  std::vector<double> yaws = {key_yaws[0]};
  for (std::size_t k = 1; k < key_yaws.size(); ++k) {
    const std::size_t from = keys[first + k - 1], to = keys[first + k];
    double length = 0.0, passed = 0.0;
    for (std::size_t i = from + 1; i <= to; ++i) length += (drafts[i].tip - drafts[i - 1].tip).norm();
    for (std::size_t i = from + 1; i <= to; ++i) {
      passed += (drafts[i].tip - drafts[i - 1].tip).norm();
      const double t = length > 0.0 ? passed / length : 1.0;
      yaws.push_back((1.0 - t) * key_yaws[k - 1] + t * key_yaws[k]);
    }
  }
  return yaws;
}

// Whether a joint turns too far in a segment that is long enough to be divided.
bool to_divide(const Cell& cell, const ArmPoint& from, const ArmPoint& to) {
  return (to.draft.tip - from.draft.tip).norm() >= 2.02 * cell.machine().tolerances.min_segment_mm &&
         largest_joint_step(from.joints, to.joints) > 0.95 * cell.machine().arm.max_joint_step_rad;
}

// The waypoints strictly between two, appended in order, so that no joint turns too far in one segment. They lie on the
// segment; each takes its share of volume and duration.
void divide_segment(const Cell& cell, int branch, const ArmPoint& from, ArmPoint& to, std::vector<ArmPoint>& result) {
  if (!to_divide(cell, from, to)) return;
  ArmPoint middle;
  middle.draft.tip = 0.5 * (from.draft.tip + to.draft.tip);
  middle.draft.axis = (from.draft.axis + to.draft.axis).normalized();
  middle.draft.normal = (from.draft.normal + to.draft.normal).normalized();
  middle.yaw = 0.5 * (from.yaw + to.yaw);
  if (cell.solve(middle.draft.tip, middle.draft.axis, middle.yaw, branch, middle.joints) != ArmFault::none) return;
  middle.draft.volume_mm3 = to.draft.volume_mm3 = 0.5 * to.draft.volume_mm3;
  middle.draft.duration_s = to.draft.duration_s = 0.5 * to.draft.duration_s;
  divide_segment(cell, branch, from, middle, result);
  result.push_back(middle);
  divide_segment(cell, branch, middle, to, result);
}

// Divides the segments of a section in which a joint would turn too far.
void insert_waypoints(const Cell& cell, ArmSection& section) {
  const auto divided = [&](const ArmPoint& from, const ArmPoint& to) { return to_divide(cell, from, to); };
  if (std::adjacent_find(section.points.begin(), section.points.end(), divided) == section.points.end()) return;
  std::vector<ArmPoint> result;
  result.reserve(section.points.size());
  for (ArmPoint& point : section.points) {
    if (!result.empty()) divide_segment(cell, section.branch, ArmPoint(result.back()), point, result);
    result.push_back(point);
  }
  section.points = std::move(result);
}

// Makes the joints of a section continuous and shifts each by whole turns into its limits, near `before`. Returns the
// first waypoint from which on no shift serves, or the number of waypoints.
std::size_t unwrap_section(const Cell& cell, ArmSection& section, const ArmState& before) {
  constexpr double kTurn = 2.0 * kPi;
  for (std::size_t i = 1; i < section.points.size(); ++i) {
    section.points[i].joints = unwrapped_near(section.points[i].joints, section.points[i - 1].joints);
  }
  Joints shift{};
  for (int j = 0; j < 6; ++j) {
    double low = 1e300, high = -1e300;
    for (const ArmPoint& point : section.points) {
      low = std::min(low, point.joints[j]);
      high = std::max(high, point.joints[j]);
    }
    double best = 1e300;
    for (int turns = -3; turns <= 3; ++turns) {
      if (low + turns * kTurn < cell.limit_low(j) || high + turns * kTurn > cell.limit_high(j)) continue;
      const double start = section.points[0].joints[j] + turns * kTurn;
      const double distance = std::abs(start - (before.known ? before.joints[j] : 0.0));
      if (distance < best) best = distance, shift[j] = turns * kTurn;
    }
    if (best < 1e300) continue;
    for (std::size_t i = 1; i < section.points.size(); ++i) {
      low = std::min(i == 1 ? section.points[0].joints[j] : low, section.points[i].joints[j]);
      high = std::max(i == 1 ? section.points[0].joints[j] : high, section.points[i].joints[j]);
      if (high - low > cell.limit_high(j) - cell.limit_low(j) - kTurn) return std::max<std::size_t>(1, i - 1);
    }
  }
  for (ArmPoint& point : section.points) {
    for (int j = 0; j < 6; ++j) point.joints[j] += shift[j];
  }
  return section.points.size();
}

// Where the first segment turns a joint too far and is too short to be divided (a crease of the layer), the first waypoint
// takes a posture nearer to the second's: the arm gets there by a travel. The layer's normal is taken from between the two
// as well, since the segment lies on the crease's other side.
void ease_start(const Cell& cell, ArmSection& section) {
  if (section.points.size() < 2) return;
  ArmPoint& start = section.points[0];
  const ArmPoint& next = section.points[1];
  const double step = largest_joint_step(start.joints, next.joints), most = cell.machine().arm.max_joint_step_rad;
  if (step <= most) return;
  const double lean = cell.machine().tolerances.max_tilt_deviation.radians();
  for (double share = 1.0 - 0.9 * most / step; share < 1.0; share += 0.25 * most / step) {
    ArmPoint eased = start;
    eased.draft.normal = ((1.0 - share) * start.draft.normal + share * next.draft.normal).normalized();
    eased.draft.axis = limited_axis(((1.0 - share) * start.draft.axis + share * next.draft.axis).normalized(),
                                    eased.draft.normal, lean);
    eased.yaw = (1.0 - share) * start.yaw + share * next.yaw;
    if (cell.solve(eased.draft.tip, eased.draft.axis, eased.yaw, section.branch, eased.joints) != ArmFault::none) return;
    if (largest_joint_step(eased.joints, next.joints) > 0.98 * most) continue;
    start = eased;
    return;
  }
}

// The first waypoint, but not the second, that a joint would jump to; else the number of waypoints.
std::size_t first_jump(const Cell& cell, const ArmSection& section) {
  const double most = cell.machine().arm.max_joint_step_rad;
  for (std::size_t i = 2; i < section.points.size(); ++i) {
    if (largest_joint_step(section.points[i - 1].joints, section.points[i].joints) > most) return i;
  }
  return section.points.size();
}

// Moves of a program's part that a section may have: what gates, travel and the frame of a part take stays free.
double most_moves(const ProgramLimits& limits) {
  constexpr double kFree = 0.25, kMoveBytes = 180.0, kFrameBytes = 4000.0;
  const double by_bytes = ((1.0 - kFree) * static_cast<double>(limits.max_bytes_per_part) - kFrameBytes) / kMoveBytes;
  return std::max(20.0, std::min((1.0 - kFree) * limits.max_moves_per_part, by_bytes));
}

// The waypoints that `most` moves of a program reach. A slow segment becomes several of them, since no move may last longer
// than gates lie apart.
std::size_t within_moves(const Cell& cell, const ArmSection& section, double most) {
  const double longest_s = 0.5 * cell.machine().link.gate_interval_s;
  double moves = 0.0;
  for (std::size_t i = 1; i < section.points.size(); ++i) {
    const ArmPoint &from = section.points[i - 1], &to = section.points[i];
    double duration = to.draft.duration_s;
    for (int j = 0; j < 6; ++j) duration = std::max(duration, std::abs(to.joints[j] - from.joints[j]) / cell.joint_speed(j));
    moves += std::max(1.0, std::ceil(duration / longest_s));
    if (moves > most) return std::max<std::size_t>(i, 2);
  }
  return section.points.size();
}

// Appends a section, cut where a joint would jump, where joints would run out of their range or programs would grow too long.
void append_section(const Cell& cell, ArmSection section, ArmState& state, std::vector<ArmSection>& sections) {
  insert_waypoints(cell, section);
  const double most = most_moves(cell.machine().program);
  while (!section.points.empty()) {
    ease_start(cell, section);
    ArmSection head = section;
    head.points.resize(std::min(first_jump(cell, section), within_moves(cell, section, most)));
    for (std::size_t fits; (fits = unwrap_section(cell, head, state)) < head.points.size();)
      head.points.resize(fits + 1);
    if (head.points.size() < 2 && section.points.size() > 1) head.points.resize(2, section.points[1]);
    const std::size_t used = head.points.size();
    const ArmPoint& last = head.points.back();
    state = {true, last.yaw, head.branch, last.joints};
    sections.push_back(std::move(head));
    if (used >= section.points.size()) break;
    section.points.erase(section.points.begin(), section.points.begin() + static_cast<std::ptrdiff_t>(used - 1));
    section.points[0].draft.volume_mm3 = section.points[0].draft.duration_s = 0.0;
  }
}

// Whether forearm or wrist touch something at some waypoints; they lie together, so most often none can.
bool links_touch(const Cell& cell, const Deposit& obstacles, std::span<const ArmPoint> points, const PostureBoxes& boxes) {
  const double clearance = cell.machine().tolerances.clearance_mm;
  const auto touched = [&](const Cell::Capsule& link) {
    return obstacles.touches_capsule(link.a, link.b, link.radius, clearance, points.back().draft.point);
  };
  const auto links = cell.links(boxes);
  if (std::none_of(links.begin(), links.end(), touched)) return false;
  return std::any_of(points.begin(), points.end(), [&](const ArmPoint& point) {
    return touching_link(cell, obstacles, point.joints, point.draft.point, clearance) != nullptr;
  });
}

}  // namespace

Index ArmSection::last_point(Index before) const {
  const auto last = std::find_if(points.rbegin(), points.rend(), [](const ArmPoint& point) { return point.draft.point != kNone; });
  return last == points.rend() ? before : last->draft.point;
}

const char* touching_link(const Cell& cell, const Deposit& deposit, const Joints& joints, Index before,
                          double clearance, Contact* contact) {
  for (const Cell::Capsule& link : cell.links(joints)) {
    if (deposit.touches_capsule(link.a, link.b, link.radius, clearance, before, contact)) return link.name;
  }
  return nullptr;
}

std::optional<double> held_yaw(const Cell& cell, std::span<const DraftPoint> drafts, const MotionOptions& options,
                               double yaw_before, int branch) {
  const std::vector<std::size_t> keys = key_waypoints(drafts, options.key_spacing_mm);
  if (keys_comfortable(cell, drafts, keys, branch, yaw_before)) return yaw_before;
  for (const double yaw : yaws_from(options.yaw_samples, yaw_before)) {
    if (keys_comfortable(cell, drafts, keys, branch, yaw)) return yaw;
  }
  return std::nullopt;
}

std::optional<ArmSection> hold_posture(const Cell& cell, const Deposit* obstacles, std::span<const DraftPoint> drafts,
                                       int branch, double yaw) {
  ArmSection section;
  section.branch = branch;
  section.points.reserve(drafts.size());
  PostureBoxes boxes;  // of the last waypoints
  std::size_t first = 0;
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    Posture posture;
    if (!comfortable(cell, drafts[i], branch, yaw, posture)) return std::nullopt;
    if (i > 0 && largest_joint_step(section.points.back().joints, posture.joints) > 0.5 * kMostKeyStep) return std::nullopt;
    section.points.push_back({drafts[i], yaw, posture.joints});
    if (!obstacles) continue;
    boxes.add(posture);
    if (i - first + 1 < kSweptTogether && i + 1 < drafts.size()) continue;
    if (links_touch(cell, *obstacles, std::span(section.points).subspan(first), boxes)) return std::nullopt;
    boxes = {};
    first = i + 1;
  }
  return section;
}

ArmPath cut_section(const Cell& cell, ArmSection section, const ArmState& before) {
  ArmPath path;
  ArmState state = before;
  append_section(cell, std::move(section), state, path.sections);
  return path;
}

ArmPath plan_arm_path(const Cell& cell, const Deposit* obstacles, std::span<const DraftPoint> drafts,
                      const MotionOptions& options, const ArmState& before) {
  ArmPath path;
  ArmState state = before;
  std::vector<std::size_t> keys = key_waypoints(drafts, options.key_spacing_mm);
  if (auto kept = obstacles ? std::nullopt : keep_posture(cell, drafts, keys, options.yaw_samples, before)) {
    return cut_section(cell, std::move(*kept), before);
  }
  std::size_t first = 0;
  int refined = 0;
  while (first + 1 < keys.size() || (first == 0 && keys.size() == 1)) {
    PostureGraph graph(cell, obstacles, drafts, options, state);
    ArmFault fault = ArmFault::none;
    const std::size_t passed = graph.sweep(keys, first, true, &fault);
    const bool whole = first + passed == keys.size();
    if (passed == 0 || (passed == 1 && !whole)) {
      const std::size_t stuck = first + passed;
      // A finer division may get past a fast turn; a pose without posture stays one.
      if (passed == 1 && keys[stuck] > keys[first] + 1 && refined++ < kRefinements) {
        keys.insert(keys.begin() + static_cast<std::ptrdiff_t>(stuck), (keys[first] + keys[stuck]) / 2);
        continue;
      }
      path.unreachable = drafts[keys[stuck]].point;
      path.fault = fault;
      return path;
    }
    const std::vector<int> states = graph.trace(passed);
    std::vector<double> key_yaws;
    for (const int s : states) key_yaws.push_back(graph.yaw(s));
    ArmSection section;
    std::size_t failed = 0;
    const std::size_t begin = keys[first], end = keys[first + passed - 1];
    if (!fill_section(cell, drafts, begin, end, interpolate_yaws(drafts, keys, first, key_yaws),
                      PostureGraph::branch(states[0]), section, failed)) {
      const auto at = std::lower_bound(keys.begin(), keys.end(), failed);
      if ((at != keys.end() && *at == failed) || refined++ >= 200) {
        path.unreachable = drafts[failed].point;
        path.fault = ArmFault::singular;
        return path;
      }
      keys.insert(at, failed);
      continue;
    }
    if (first > 0) section.points[0].draft.volume_mm3 = section.points[0].draft.duration_s = 0.0;
    append_section(cell, std::move(section), state, path.sections);
    first += passed - 1;
  }
  return path;
}

}  // namespace curvesup
