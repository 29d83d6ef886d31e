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
constexpr double kSubstep_m = 0.02, kSubstep_rad = 0.1;

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

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
    std::array<Vec3, 6> axis, origin;
    Vec3 wrist;
    ArmFrame tool;
  };

  [[nodiscard]] State at(const Joints& joints) const {
    State state;
    Mat3 rotation = Mat3::Identity();
    Vec3 position = Vec3::Zero();
    for (std::size_t i = 0; i < 6; ++i) {
      state.axis[i] = rotation.col(2);
      state.origin[i] = position;
      const double c = std::cos(joints[i]), s = std::sin(joints[i]);
      const Vec3 x = c * rotation.col(0) + s * rotation.col(1);
      const Vec3 y = c * rotation.col(1) - s * rotation.col(0);
      const Vec3 z = rotation.col(2);
      position += arm_.dh[i].d_m * z + arm_.dh[i].a_m * x;
      rotation.col(0) = x;
      rotation.col(1) = cosine_[i] * y + sine_[i] * z;
      rotation.col(2) = cosine_[i] * z - sine_[i] * y;
      if (i == 4) state.wrist = position;
    }
    state.tool.position = position + rotation * tcp_.position;
    state.tool.rotation = rotation * tcp_.rotation;
    return state;
  }

  // Newton steps from `joints`, where the links are in `state`, to `target`; false when they do not arrive.
  bool solve(const ArmFrame& target, Joints& joints, State& state) const {
    for (int step = 0; step < 12; ++step) {
      if (step > 0) state = at(joints);
      Vector6 error;
      error.head<3>() = target.position - state.tool.position;
      error.tail<3>() = small_turn(target.rotation * state.tool.rotation.transpose());
      if (error.cwiseAbs().maxCoeff() < kConverged) return true;
      Matrix6 jacobian;
      for (int i = 0; i < 6; ++i) {
        const auto k = static_cast<std::size_t>(i);
        jacobian.col(i).head<3>() = state.axis[k].cross(state.tool.position - state.origin[k]);
        jacobian.col(i).tail<3>() = state.axis[k];
      }
      Vector6 turn = jacobian.partialPivLu().solve(error);
      const double largest = turn.cwiseAbs().maxCoeff();
      if (!(largest < 1e6)) return false;
      if (largest > 0.3) turn *= 0.3 / largest;
      for (int i = 0; i < 6; ++i) joints[static_cast<std::size_t>(i)] += turn[i];
    }
    return false;
  }

  [[nodiscard]] double metric(const Joints& joints, const Vec3& wrist) const {
    const double d4 = std::abs(arm_.dh[3].d_m);
    const double shoulder = (std::hypot(wrist.x(), wrist.y()) - d4) / d4;
    return std::min({std::abs(std::sin(joints[4])), std::abs(std::sin(joints[2])), shoulder});
  }

 private:
  // Exact for small turns in the first order that matters here, and of the right direction for large ones.
  static Vec3 small_turn(const Mat3& r) {
    const Vec3 doubled(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
    const double cosine = 0.5 * (r.trace() - 1.0);
    if (cosine > 0.999) return 0.5 * doubled;
    return rotation_vector_from(r);
  }

  const Arm& arm_;
  ArmFrame tcp_;
  std::array<double, 6> sine_, cosine_;
};

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
      if (move.kind == RobotMove::Kind::process && i > 0) check_print(part_.moves[i - 1], before, move);
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
    const Vec3 turn = rotation_vector_from(from.rotation.transpose() * target.rotation);
    const int pieces = 1 + static_cast<int>(std::max(way.norm() / kSubstep_m, turn.norm() / kSubstep_rad));
    for (int i = 1; i <= pieces; ++i) {
      const double share = static_cast<double>(i) / pieces;
      const ArmFrame next = i == pieces ? target : ArmFrame{from.rotation * rotation_from(share * turn), from.position + share * way};
      if (links_.solve(next, joints, state_)) continue;
      part_.findings.fail(Rule::inverse_kinematics, place_, "no joints bring the tool there from the pose before");
      return false;
    }
    return true;
  }

  bool take_joints(RobotMove& move, Joints& joints) {
    joints = move.joints;
    state_ = links_.at(joints);
    const ArmFrame reached = state_.tool;
    if (!move.has_pose) {
      move.pose = {reached.position, rotation_vector_from(reached.rotation)};
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

  void check_print(const RobotMove& from, const Joints& before, const RobotMove& move) {
    const Arm& arm = machine_.arm;
    const double step = largest_difference(before, move.reached);
    part_.findings.at_most(Rule::joint_step, step, arm.max_joint_step_rad, place_, "a joint jumps");
    const double seconds = planned_length_m(from.pose, move.pose, machine_.speeds.rotation_rad_per_m) / std::max(move.v, 1e-9);
    double ratio = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
      const double turned = std::max(0.0, std::abs(move.reached[i] - before[i]) - kJointRounding);
      ratio = std::max(ratio, turned / std::max(seconds, 1e-9) / (arm.max_joint_speed_deg_s[i] * kDegree));
    }
    part_.findings.at_most(Rule::joint_speed, ratio, arm.joint_speed_fraction * 1.005, place_, "a joint turns too fast at the stated speed");
    const double metric = links_.metric(move.reached, state_.wrist);
    part_.findings.at_least(Rule::singularity, metric, arm.min_singularity_metric - 1e-5, place_, "too near to a singularity");
  }

  RobotPart& part_;
  const Machine& machine_;
  LinkChain links_;
  LinkChain::State state_;  // at the joints reached last
  Place place_{part_.file, 0};
};

double turn_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// A chain of printing moves: first - 1 is where the nozzle stands, last - 1 the last of them.
class ChainCheck {
 public:
  ChainCheck(RobotPart& part, const Machine& machine, EmittedFigures& figures) : part_(part), machine_(machine), figures_(figures) {}

  void run(std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const RobotMove& move = part_.moves[i];
      place_.line = move.line;
      check_move(part_.moves[i - 1], move);
      if (move.r == 0.0) continue;
      if (i + 1 < last) check_blend(i);
      if (i + 1 == last) fail(Rule::stops, "a blend where the arm has to stop");
    }
  }

 private:
  void fail(Rule rule, std::string_view what) { part_.findings.fail(rule, place_, what); }

  void check_move(const RobotMove& from, const RobotMove& move) {
    const Vec3 way = move.pose.position_m - from.pose.position_m;
    const double length = way.norm();
    figures_.print_mm += 1000.0 * length;
    part_.findings.expect(1000.0 * length >= machine_.tolerances.min_segment_mm * 0.998 - 1e-3, Rule::spacing, place_, "waypoints too near");
    const Vec3 &rv = move.pose.rotation_vector, &rv_before = from.pose.rotation_vector;
    if (rv.norm() > 2.0 * std::numbers::pi + 1e-6) fail(Rule::rotation_alias, "a rotation vector beyond a whole turn");
    const double change = (rv - rv_before).norm();
    const double geodesic = rotation_vector_from(rotation_from(rv_before).transpose() * rotation_from(rv)).norm();
    // The first move of a chain comes from a travel that the controller did not plan together with it.
    part_.findings.expect(change <= 1.6 * geodesic + 1e-3, Rule::rotation_alias, place_, "the rotation vector changes to another of its aliases");
    if (length > 0.0) figures_.max_rotation_rad_per_m = std::max(figures_.max_rotation_rad_per_m, change / length);
    const double excess = change / machine_.speeds.rotation_rad_per_m - length;
    if (excess > 1e-6 && !move.marked) fail(Rule::rotation_marks, "a move that the controller's rotation rule slows is not marked");
    if (excess < -1e-6 && move.marked) fail(Rule::rotation_marks, "a mark on a move that does not turn much");
  }

  void check_blend(std::size_t i) {
    const RobotMove &from = part_.moves[i - 1], &move = part_.moves[i], &to = part_.moves[i + 1];
    const Vec3 in = move.pose.position_m - from.pose.position_m, out = to.pose.position_m - move.pose.position_m;
    const double length = out.norm(), nearest = std::min(in.norm(), length);
    const bool apart = move.r + to.r < length && move.r <= 0.45 * nearest + 1e-6 && (from.kind != move.kind || from.r + move.r < in.norm());
    part_.findings.expect(apart, Rule::blend_overlap, place_, "the blend reaches into that of a neighbour");
    part_.findings.expect(1000.0 * move.r >= machine_.tolerances.min_blend_mm * 0.4 - 1e-3 || move.r >= 1e-4, Rule::blend_overlap, place_,
                          "a blend too small to be taken");
    const double turn = turn_between(in, out);
    part_.findings.at_most(Rule::turns, turn / kDegree, machine_.tolerances.max_blend_turn.degrees() + 0.1, place_, "a blend at a reversal");
    const double cut = 1000.0 * move.r * std::tan(turn / 4.0);
    part_.findings.at_most(Rule::corner_cut, cut, machine_.tolerances.corner_mm + 1e-3, place_, "the blend cuts the corner too far");
    if (turn < 1e-3) return;
    const double radius = move.r / std::tan(turn / 2.0);
    const double speed = std::max(feed(from, move), feed(move, to));
    part_.findings.at_most(Rule::blend_speed, speed / std::sqrt(move.a * radius), 1.02, place_, "the blend is too narrow for the speed");
  }

  // Speed along the way: below v where v was raised for the controller's rotation rule.
  [[nodiscard]] double feed(const RobotMove& from, const RobotMove& to) const {
    const double length = (to.pose.position_m - from.pose.position_m).norm();
    return to.v * length / std::max(planned_length_m(from.pose, to.pose, machine_.speeds.rotation_rad_per_m), 1e-12);
  }

  RobotPart& part_;
  const Machine& machine_;
  EmittedFigures& figures_;
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

ArmFrame tool_frame_at(const Arm& arm, const Pose& tcp, const Joints& joints) { return LinkChain(arm, tcp).at(joints).tool; }

std::array<Vec3, 5> link_points_at(const Arm& arm, const Joints& joints) {
  const auto state = LinkChain(arm, Pose{}).at(joints);
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
