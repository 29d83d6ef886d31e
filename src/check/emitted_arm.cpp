#include "check/emitted_arm.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

namespace curvesup::emitted {

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kConverged = 1e-9;         // m, rad
constexpr double kTextRounding = 1e-5;      // m, rad: of a pose that six rounded joints bring about
constexpr double kJointRounding = 4e-6;     // rad: two poses of seven and six decimals
constexpr double kSubstep_m = 0.02, kSubstep_rad = 0.1, kSubstepCosine = 0.995005;  // of 0.1 rad

// Six equations, each with its right side as the seventh number; the eighth fills registers.
using Equation = Eigen::Matrix<double, 8, 1>;
using Equations = std::array<Equation, 6>;

// Elimination with the largest pivot of each column; false when there is none. The solution is where the right sides were.
bool eliminate(Equations& rows) {
  for (std::size_t k = 0; k < 6; ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < 6; ++i) {
      if (std::abs(rows[i][column]) > std::abs(rows[pivot][column])) pivot = i;
    }
    if (!(std::abs(rows[pivot][column]) > 1e-12)) return false;
    if (pivot != k) std::swap(rows[pivot], rows[k]);
    const double inverse = 1.0 / rows[k][column];
    for (std::size_t i = k + 1; i < 6; ++i) rows[i] -= rows[i][column] * inverse * rows[k];
  }
  for (std::size_t k = 6; k-- > 0;) {
    for (std::size_t j = k + 1; j < 6; ++j) rows[k][6] -= rows[k][static_cast<Eigen::Index>(j)] * rows[j][6];
    rows[k][6] /= rows[k][static_cast<Eigen::Index>(k)];
  }
  return true;
}

}  // namespace

// The chain of links with what does not change worked out once.
class LinkChain {
 public:
  LinkChain(const Arm& arm, const Pose& tcp) : arm_(arm), tcp_(frame_of(tcp)) {
    for (std::size_t i = 0; i < 6; ++i) {
      sine_[i] = std::sin(arm.dh[i].alpha_rad);
      cosine_[i] = std::cos(arm.dh[i].alpha_rad);
    }
  }

  // Axes and origins of the joints, the wrist centre, and the tool's frame.
  struct State {
    std::array<double, 6> cosine, sine;  // of the joints
    std::array<Vec3, 6> axis, origin;
    Vec3 wrist;
    ArmFrame tool;
  };

  [[nodiscard]] State at(const Joints& joints) const {
    State state;
    for (std::size_t i = 0; i < 6; ++i) {
      state.cosine[i] = std::cos(joints[i]);
      state.sine[i] = std::sin(joints[i]);
    }
    place(state);
    return state;
  }

  // Newton steps from `joints`, where the links are in `state`, to `target`; false when they do not arrive.
  bool solve(const ArmFrame& target, Joints& joints, State& state) const {
    for (int step = 0; step < 12; ++step) {
      const Vec3 way = target.position - state.tool.position, turn = small_turn(state.tool.rotation, target.rotation);
      if (std::max(way.cwiseAbs().maxCoeff(), turn.cwiseAbs().maxCoeff()) < kConverged) return true;
      Equations rows;
      for (std::size_t c = 0; c < 6; ++c) {
        const auto xyz = static_cast<Eigen::Index>(c % 3);
        rows[c].tail<2>() << (c < 3 ? way : turn)[xyz], 0.0;
      }
      for (std::size_t i = 0; i < 6; ++i) {
        const auto column = static_cast<Eigen::Index>(i);
        const Vec3 lever = state.axis[i].cross(state.tool.position - state.origin[i]);
        for (std::size_t c = 0; c < 3; ++c) {
          rows[c][column] = lever[static_cast<Eigen::Index>(c)];
          rows[3 + c][column] = state.axis[i][static_cast<Eigen::Index>(c)];
        }
      }
      if (!eliminate(rows)) return false;
      double largest = 0.0;
      for (const Equation& row : rows) largest = std::max(largest, std::abs(row[6]));
      if (!(largest < 1e6)) return false;
      const double share = largest > 0.3 ? 0.3 / largest : 1.0;
      for (std::size_t i = 0; i < 6; ++i) turn_joint(i, share * rows[i][6], joints, state);
      place(state);
    }
    return false;
  }

  [[nodiscard]] double metric(const State& state) const {
    const double d4 = std::abs(arm_.dh[3].d_m);
    const double shoulder = (std::sqrt(state.wrist.x() * state.wrist.x() + state.wrist.y() * state.wrist.y()) - d4) / d4;
    return std::min({std::abs(state.sine[4]), std::abs(state.sine[2]), shoulder});
  }

 private:
  // Axes and frames from the cosines and sines of the joints.
  void place(State& state) const {
    Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ(), position = Vec3::Zero();
    for (std::size_t i = 0; i < 6; ++i) {
      state.axis[i] = z;
      state.origin[i] = position;
      const double c = state.cosine[i], s = state.sine[i];
      const Vec3 along = c * x + s * y, across = c * y - s * x;
      position += arm_.dh[i].d_m * z + arm_.dh[i].a_m * along;
      x = along;
      y = cosine_[i] * across + sine_[i] * z;
      z = cosine_[i] * z - sine_[i] * across;
      if (i == 4) state.wrist = position;
    }
    Mat3 rotation;
    rotation << x, y, z;
    state.tool.position = position + rotation * tcp_.position;
    state.tool.rotation = rotation * tcp_.rotation;
  }

  // Small turns, as from one waypoint to the next, by the first terms of the series: exact to the last digit.
  static void turn_joint(std::size_t i, double by, Joints& joints, State& state) {
    joints[i] += by;
    if (std::abs(by) > 0.02) {
      state.cosine[i] = std::cos(joints[i]);
      state.sine[i] = std::sin(joints[i]);
      return;
    }
    const double b2 = by * by;
    const double sine = by * (1.0 - b2 / 6.0 * (1.0 - b2 / 20.0 * (1.0 - b2 / 42.0))), less = 0.5 * b2 * (1.0 - b2 / 12.0 * (1.0 - b2 / 30.0));
    const double c = state.cosine[i], s = state.sine[i];
    state.cosine[i] = c - (c * less + s * sine);
    state.sine[i] = s - (s * less - c * sine);
  }

  // From one frame to the other. Exact for small turns in the first order that matters here, and of the right direction
  // for large ones.
  static Vec3 small_turn(const Mat3& from, const Mat3& to) {
    const double cosine = 0.5 * (from.cwiseProduct(to).sum() - 1.0);
    if (cosine <= 0.999) return rotation_vector_from(to * from.transpose());
    return 0.5 * (from.col(0).cross(to.col(0)) + from.col(1).cross(to.col(1)) + from.col(2).cross(to.col(2)));
  }

  const Arm& arm_;
  ArmFrame tcp_;
  std::array<double, 6> sine_, cosine_;
};

namespace {

double largest_difference(const Joints& a, const Joints& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < 6; ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

class ArmCheck {
 public:
  ArmCheck(RobotPart& part, const Machine& machine) : part_(part), machine_(machine), links_(machine.arm, part.tcp) {}

  void run() {
    bool known = false;
    Joints joints{};
    for (std::size_t i = 0; i < part_.moves.size(); ++i) {
      RobotMove& move = part_.moves[i];
      place_.line = move.line;
      const Joints before = joints;
      known = take(move, known, joints);
      move.reached = joints;
      move.solved = known;
      if (!known) continue;
      check_limits(joints);
      if (move.kind == RobotMove::Kind::process && i > 0) check_print(part_.moves[i - 1], before, move, joints);
    }
  }

 private:
  // Moves `joints` to the target; false when they are unknown behind it.
  bool take(RobotMove& move, bool known, Joints& joints) {
    if (move.kind == RobotMove::Kind::joint) return take_joints(move, joints);
    if (!known) {
      part_.findings.fail(Rule::inverse_kinematics, place_, "the joints before a straight move are not known");
      return false;
    }
    const ArmFrame target = frame_of(move.pose), from = state_.tool;
    const Vec3 way = target.position - from.position;
    const bool near = way.squaredNorm() < kSubstep_m * kSubstep_m && from.rotation.cwiseProduct(target.rotation).sum() > 1.0 + 2.0 * kSubstepCosine;
    if (near ? links_.solve(target, joints, state_) : follow(from, target, joints)) return true;
    part_.findings.fail(Rule::inverse_kinematics, place_, "no joints bring the tool there from the pose before");
    return false;
  }

  // A long way, piece by piece.
  bool follow(const ArmFrame& from, const ArmFrame& target, Joints& joints) {
    const Vec3 way = target.position - from.position;
    const Vec3 turn = rotation_vector_from(from.rotation.transpose() * target.rotation);
    const int pieces = 1 + static_cast<int>(std::max(way.norm() / kSubstep_m, turn.norm() / kSubstep_rad));
    for (int i = 1; i <= pieces; ++i) {
      const double share = static_cast<double>(i) / pieces;
      const ArmFrame next = i == pieces ? target : ArmFrame{from.rotation * rotation_from(share * turn), from.position + share * way};
      if (!links_.solve(next, joints, state_)) return false;
    }
    return true;
  }

  bool take_joints(RobotMove& move, Joints& joints) {
    joints = part_.joints[next_joints_++];
    state_ = links_.at(joints);
    const ArmFrame reached = state_.tool;
    if (!move.has_pose) {
      move.pose = Pose{reached.position, rotation_vector_from(reached.rotation)};
      return true;
    }
    const ArmFrame target = frame_of(move.pose);
    const double apart = (reached.position - target.position).norm();
    const double turned = rotation_vector_from(reached.rotation.transpose() * target.rotation).norm();
    part_.findings.expect(apart < kTextRounding && turned < kTextRounding, Rule::part_start, place_,
                          "the seed of the inverse kinematics does not reach the pose");
    if (links_.solve(target, joints, state_)) return true;
    part_.findings.fail(Rule::inverse_kinematics, place_, "no joints reach the pose from its seed");
    return false;
  }

  void check_limits(const Joints& joints) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double low = machine_.arm.joint_min_deg[i] + machine_.arm.joint_margin_deg;
      const double high = machine_.arm.joint_max_deg[i] - machine_.arm.joint_margin_deg;
      const double degrees = joints[i] / kDegree;
      part_.findings.expect(degrees >= low - 1e-4 && degrees <= high + 1e-4, Rule::joint_limits, place_, "a joint beyond its limit and margin");
    }
  }

  void check_print(const RobotMove& from, const Joints& before, const RobotMove& move, const Joints& joints) {
    const Arm& arm = machine_.arm;
    part_.findings.at_most(Rule::joint_step, largest_difference(before, joints), arm.max_joint_step_rad, place_, "a joint jumps");
    const double way = planned_length_m(from.pose, move.pose, machine_.speeds.rotation_rad_per_m);
    const double seconds = std::max(1e-9, way / std::max(static_cast<double>(move.v), 1e-9));
    double ratio = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double turned = std::max(0.0, std::abs(joints[i] - before[i]) - kJointRounding);
      ratio = std::max(ratio, turned / (seconds * arm.max_joint_speed_deg_s[i] * kDegree));
    }
    part_.findings.at_most(Rule::joint_speed, ratio, arm.joint_speed_fraction * 1.005, place_, "a joint turns too fast at the stated speed");
    part_.findings.at_least(Rule::singularity, links_.metric(state_), arm.min_singularity_metric - 1e-5, place_, "too near to a singularity");
  }

  RobotPart& part_;
  const Machine& machine_;
  LinkChain links_;
  LinkChain::State state_;  // at the joints reached last
  std::size_t next_joints_ = 0;
  Place place_{part_.file, 0};
};

// A chain of printing moves: first - 1 is where the nozzle stands, last - 1 the last of them.
class ChainCheck {
 public:
  ChainCheck(RobotPart& part, const Machine& machine, EmittedFigures& figures) : part_(part), machine_(machine), figures_(figures) {}

  void run(std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const RobotMove& move = part_.moves[i];
      place_.line = move.line;
      check_move(part_.moves[i - 1], move);
      if (move.r == 0.0f) continue;
      if (i + 1 < last) check_blend(i);
      if (i + 1 == last) fail(Rule::stops, "a blend where the arm has to stop");
    }
  }

 private:
  void fail(Rule rule, std::string_view what) { part_.findings.fail(rule, place_, what); }

  void check_move(const RobotMove& from, const RobotMove& move) {
    const double length = (move.pose.position_m.vec() - from.pose.position_m.vec()).norm();
    figures_.print_mm += 1000.0 * length;
    part_.findings.expect(1000.0 * length >= machine_.tolerances.min_segment_mm * 0.998 - 1e-3, Rule::spacing, place_, "waypoints too near");
    const Vec3 rv = move.pose.rotation_vector, rv_before = from.pose.rotation_vector;
    const double change = (rv - rv_before).norm();
    check_alias(rv_before, rv, change);
    if (length > 0.0) figures_.max_rotation_rad_per_m = std::max(figures_.max_rotation_rad_per_m, change / length);
    const double excess = change / machine_.speeds.rotation_rad_per_m - length;
    if (excess > 1e-6 && !move.marked) fail(Rule::rotation_marks, "a move that the controller's rotation rule slows is not marked");
    if (excess < -1e-6 && move.marked) fail(Rule::rotation_marks, "a mark on a move that does not turn much");
  }

  // The first move of a chain comes from a travel that the controller did not plan together with it.
  void check_alias(const Vec3& before, const Vec3& now, double change) {
    // Below a quarter turn, changes of a rotation vector are at most 1.12 times the turn between the rotations.
    if (std::max(before.squaredNorm(), now.squaredNorm()) < 1.5 * 1.5) return;
    if (now.norm() > 2.0 * std::numbers::pi + 1e-6) fail(Rule::rotation_alias, "a rotation vector beyond a whole turn");
    const double geodesic = rotation_vector_from(rotation_from(before).transpose() * rotation_from(now)).norm();
    part_.findings.expect(change <= 1.6 * geodesic + 1e-3, Rule::rotation_alias, place_, "the rotation vector changes to another of its aliases");
  }

  void check_blend(std::size_t i) {
    const RobotMove &from = part_.moves[i - 1], &move = part_.moves[i], &to = part_.moves[i + 1];
    const Vec3 here = move.pose.position_m;
    const Vec3 in = here - from.pose.position_m.vec(), out = to.pose.position_m.vec() - here;
    const double length = out.norm(), before = in.norm(), nearest = std::min(before, length), r = static_cast<double>(move.r);
    const bool apart = r + static_cast<double>(to.r) < length && r <= 0.45 * nearest + 1e-6 &&
                       (from.kind != move.kind || static_cast<double>(from.r) + r < before);
    part_.findings.expect(apart, Rule::blend_overlap, place_, "the blend reaches into that of a neighbour");
    part_.findings.expect(1000.0 * r >= machine_.tolerances.min_blend_mm * 0.4 - 1e-3 || r >= 0.99999e-4, Rule::blend_overlap, place_,
                          "a blend too small to be taken");
    // Tangents of half and of a quarter of the turn.
    const double half = in.cross(out).norm() / std::max(before * length + in.dot(out), 1e-300), quarter = half / (1.0 + std::sqrt(1.0 + half * half));
    if (half > sharpest_) {
      sharpest_ = half;
      part_.findings.at_most(Rule::turns, 2.0 * std::atan(half) / kDegree, machine_.tolerances.max_blend_turn.degrees() + 0.1, place_, "a blend at a reversal");
    }
    part_.findings.at_most(Rule::corner_cut, 1000.0 * r * quarter, machine_.tolerances.corner_mm + 1e-3, place_, "the blend cuts the corner too far");
    if (half < 5e-4) return;
    const double speed = std::max(feed(from, move), feed(move, to));
    part_.findings.at_most(Rule::blend_speed, speed / std::sqrt(static_cast<double>(move.a) * r / half), 1.02, place_, "the blend is too narrow for the speed");
  }

  // Speed along the way: below v where v was raised for the controller's rotation rule.
  [[nodiscard]] double feed(const RobotMove& from, const RobotMove& to) const {
    const double v = static_cast<double>(to.v);
    if (!to.marked) return v;
    const double length = (to.pose.position_m.vec() - from.pose.position_m.vec()).norm();
    return v * length / std::max(planned_length_m(from.pose, to.pose, machine_.speeds.rotation_rad_per_m), 1e-12);
  }

  RobotPart& part_;
  const Machine& machine_;
  EmittedFigures& figures_;
  double sharpest_ = -1.0;  // tangent of half the turn
  Place place_{part_.file, 0};
};

}  // namespace

Mat3 rotation_from(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-12) return Mat3::Identity();
  const Vec3 k = rotation_vector / angle;
  const double c = std::cos(angle), s = std::sin(angle);
  Mat3 cross;
  cross << 0.0, -k.z(), k.y(), k.z(), 0.0, -k.x(), -k.y(), k.x(), 0.0;
  return c * Mat3::Identity() + s * cross + (1.0 - c) * k * k.transpose();
}

Vec3 rotation_vector_from(const Mat3& r) {
  const Vec3 doubled(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
  const double sine = 0.5 * doubled.norm(), cosine = 0.5 * (r.trace() - 1.0);
  const double angle = std::atan2(sine, cosine);
  if (sine > 1e-6) return angle / (2.0 * sine) * doubled;
  if (cosine > 0.0) return 0.5 * doubled;
  // Half a turn: the axis is the column of R + 1 that is longest.
  Eigen::Index column = 0;
  (r + Mat3::Identity()).colwise().norm().maxCoeff(&column);
  return angle * (r + Mat3::Identity()).col(column).normalized();
}

ArmFrame frame_of(const Pose& pose) { return {rotation_from(pose.rotation_vector), pose.position_m}; }

Vec3 tool_axis(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-12) return Vec3::UnitZ();
  const Vec3 k = rotation_vector / angle;
  const double c = std::cos(angle), s = std::sin(angle);
  return Vec3(s * k.y(), -s * k.x(), c) + (1.0 - c) * k.z() * k;
}

ArmLinks::ArmLinks(const Arm& arm) : chain_(std::make_unique<LinkChain>(arm, Pose{})) {}
ArmLinks::~ArmLinks() = default;

ArmFrame ArmLinks::tool(const Joints& joints, const Pose& tcp) const {
  const ArmFrame flange = chain_->at(joints).tool, frame = frame_of(tcp);
  return {flange.rotation * frame.rotation, flange.position + flange.rotation * frame.position};
}

std::array<Vec3, 5> ArmLinks::points(const Joints& joints) const {
  const auto state = chain_->at(joints);
  return {state.origin[2], state.origin[3], state.origin[4], state.origin[5], state.tool.position};
}

double planned_length_m(const Pose& from, const Pose& to, double rotation_rad_per_m) {
  return std::max((to.position_m - from.position_m).norm(), (to.rotation_vector - from.rotation_vector).norm() / rotation_rad_per_m);
}

void check_arm(RobotPart& part, const Machine& machine) { ArmCheck(part, machine).run(); }

void check_chains(RobotPart& part, const Machine& machine, EmittedFigures& figures) {
  ChainCheck check(part, machine, figures);
  std::size_t first = 0;
  bool printing = false;
  const auto close = [&](std::size_t last) {
    if (printing && first > 0) check.run(first, last);
    printing = false;
  };
  std::size_t moves = 0;
  for (const RobotEvent& event : part.events) {
    if (event.kind == RobotEvent::Kind::move) {
      const bool process = part.moves[moves].kind == RobotMove::Kind::process;
      if (!process) close(moves);
      if (process && !printing) {
        first = moves;
        printing = true;
      }
      ++moves;
    } else if (event.kind != RobotEvent::Kind::output && event.kind != RobotEvent::Kind::set_gate) {
      close(moves);
    }
  }
  close(moves);
}

}  // namespace curvesup::emitted
