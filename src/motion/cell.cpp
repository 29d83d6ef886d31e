#include "motion/cell.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace curvesup {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kTipHeight = 1.0;  // the first millimetre of the nozzle may dip below a platform it prints on

}  // namespace

Joints radians(const Joints& degrees) {
  Joints result;
  for (int i = 0; i < 6; ++i) result[i] = degrees[i] * std::numbers::pi / 180.0;
  return result;
}

const char* describe(ArmFault fault) {
  switch (fault) {
    case ArmFault::none:
      return "reachable";
    case ArmFault::reach:
      return "out of the arm's reach at every turn of the head";
    case ArmFault::limit:
      return "beyond a joint limit at every turn of the head";
    case ArmFault::singular:
      return "too near a singularity at every turn of the head";
    case ArmFault::table:
      return "a link would touch the table at every turn of the head";
  }
  return "";
}

Cell::Cell(const Machine& machine)
    : machine_(machine),
      head_(machine.tool),
      platform_(to_frame(machine.platform.pose)),
      platform_inverse_(platform_.inverse(Eigen::Isometry)),
      tcp_(to_frame(machine.tool.tcp)),
      tcp_inverse_(tcp_.inverse(Eigen::Isometry)) {
  const double degree = std::numbers::pi / 180.0;
  for (int i = 0; i < 6; ++i) {
    low_[i] = (machine.arm.joint_min_deg[i] + machine.arm.joint_margin_deg) * degree;
    high_[i] = (machine.arm.joint_max_deg[i] - machine.arm.joint_margin_deg) * degree;
    speed_[i] = machine.arm.max_joint_speed_deg_s[i] * machine.arm.joint_speed_fraction * degree;
  }
}

Frame Cell::tcp_frame(const Vec3& tip_mm, const Vec3& axis, double yaw) const {
  Mat3 in_platform;
  const double c = std::cos(yaw), s = std::sin(yaw);
  const Mat3 least = least_rotation_to(axis);
  in_platform.col(0) = c * least.col(0) + s * least.col(1);
  in_platform.col(1) = c * least.col(1) - s * least.col(0);
  in_platform.col(2) = least.col(2);
  Frame tcp = Frame::Identity();
  tcp.linear().noalias() = platform_.linear() * in_platform;
  tcp.translation() = platform_.translation() + 1e-3 * (platform_.linear() * tip_mm);
  return tcp;
}

Frame Cell::flange_frame(const Vec3& tip_mm, const Vec3& axis, double yaw) const {
  const Frame tcp = tcp_frame(tip_mm, axis, yaw);
  Frame flange = Frame::Identity();
  flange.linear().noalias() = tcp.linear() * tcp_inverse_.linear();
  flange.translation() = tcp.translation() + tcp.linear() * tcp_inverse_.translation();
  return flange;
}

void Cell::tip_of(const Joints& joints, Vec3& tip_mm, Vec3& axis) const {
  const Frame tcp = platform_inverse_ * forward_kinematics(machine_.arm, joints) * tcp_;
  tip_mm = 1e3 * tcp.translation();
  axis = tcp.linear().col(2);
}

bool Cell::within_limits(const Joints& joints) const {
  for (int i = 0; i < 6; ++i) {
    if (joints[i] >= low_[i] && joints[i] <= high_[i]) continue;
    const double up = joints[i] + kTurn * std::ceil((low_[i] - joints[i]) / kTurn);
    if (up > high_[i]) return false;
  }
  return true;
}

ArmFault Cell::fault_at(double singularity, const std::array<Vec3, 5>& origins) const {
  if (singularity < machine_.arm.min_singularity_metric) return ArmFault::singular;
  const Vec3 up = platform_.linear().col(2);
  const auto height = [&](int frame) { return 1e3 * up.dot(origins[frame - 1] - platform_.translation()); };
  const double table = machine_.platform.table_clearance_mm;
  const ArmBody& body = machine_.arm.body;
  if (std::min(height(1), height(2)) < table + body.forearm_radius_mm) return ArmFault::table;
  if (std::min({height(3), height(4), height(5)}) < table + body.wrist_radius_mm) return ArmFault::table;
  return ArmFault::none;
}

ArmFault Cell::arm_fault(const Joints& joints, double* metric) const {
  if (!within_limits(joints)) return ArmFault::limit;
  const std::array<Frame, 6> frames = link_frames(machine_.arm, joints);
  const double d4 = std::abs(machine_.arm.dh[3].d_m);
  const Vec3 wrist = frames[4].translation();
  const double value = std::min(
      {std::abs(std::sin(joints[4])), std::abs(std::sin(joints[2])), (std::hypot(wrist.x(), wrist.y()) - d4) / d4});
  if (metric) *metric = value;
  return fault_at(value, {frames[1].translation(), frames[2].translation(), frames[3].translation(),
                          frames[4].translation(), frames[5].translation()});
}

ArmFault Cell::arm_fault(const Posture& posture) const {
  if (!within_limits(posture.joints)) return ArmFault::limit;
  return fault_at(posture.singularity, posture.origins);
}

ArmFault Cell::solve(const Vec3& tip_mm, const Vec3& axis, double yaw, int branch, Posture& posture) const {
  if (!inverse_kinematics(machine_.arm, flange_frame(tip_mm, axis, yaw), branch, posture)) return ArmFault::reach;
  return arm_fault(posture);
}

ArmFault Cell::solve(const Vec3& tip_mm, const Vec3& axis, double yaw, int branch, Joints& joints) const {
  Posture posture;
  const ArmFault fault = solve(tip_mm, axis, yaw, branch, posture);
  if (fault != ArmFault::reach) joints = posture.joints;
  return fault;
}

std::array<Cell::Capsule, 4> Cell::links_between(const std::array<Vec3, 5>& origins) const {
  const auto at = [&](std::size_t i) { return Vec3(1e3 * (platform_.linear().transpose() * (origins[i] - platform_.translation()))); };
  const ArmBody& body = machine_.arm.body;
  return {{{at(0), at(1), body.forearm_radius_mm, "forearm"},
           {at(1), at(2), body.wrist_radius_mm, "first wrist"},
           {at(2), at(3), body.wrist_radius_mm, "second wrist"},
           {at(3), at(4), body.wrist_radius_mm, "third wrist"}}};
}

std::array<Cell::Capsule, 4> Cell::links(const Joints& joints) const {
  const std::array<Frame, 6> frames = link_frames(machine_.arm, joints);
  return links_between({frames[1].translation(), frames[2].translation(), frames[3].translation(),
                        frames[4].translation(), frames[5].translation()});
}

std::array<Cell::Capsule, 4> Cell::links(const PostureBoxes& postures) const {
  std::array<Vec3, 5> middles;
  std::array<double, 5> reach_mm;
  for (std::size_t i = 0; i < middles.size(); ++i) {
    middles[i] = postures.origins[i].center();
    reach_mm[i] = 500.0 * postures.origins[i].diagonal().norm();
  }
  std::array<Capsule, 4> links = links_between(middles);
  // Between its ends a link strays no farther than they do.
  for (std::size_t i = 0; i < links.size(); ++i) links[i].radius += std::max(reach_mm[i], reach_mm[i + 1]);
  return links;
}

bool Cell::head_above_table(const Vec3& tip_mm, const Vec3& axis) const {
  return head_.lowest_z(tip_mm, axis, kTipHeight) >= machine_.platform.table_clearance_mm;
}

}  // namespace curvesup
