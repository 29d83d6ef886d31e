#pragma once

#include <string>

#include "curvesup/motion/kinematics.h"
#include "motion/deposit.h"
#include "motion/head_shape.h"

namespace curvesup {

// Why the arm cannot take a pose; `none` when it can.
enum class ArmFault : std::uint8_t { none, reach, limit, singular, table };
[[nodiscard]] const char* describe(ArmFault fault);

// Boxes around the origins of several postures.
struct PostureBoxes {
  std::array<Eigen::AlignedBox3d, 5> origins;
  void add(const Posture& posture) {
    for (std::size_t i = 0; i < origins.size(); ++i) origins[i].extend(posture.origins[i]);
  }
};

// The machine with everything that follows from it: frames of poses, limits in radians, bodies.
class Cell {
 public:
  explicit Cell(const Machine& machine);

  [[nodiscard]] const Machine& machine() const { return machine_; }
  [[nodiscard]] const HeadShape& head() const { return head_; }

  // TCP in the base frame for a tip and nozzle axis in the platform frame; yaw turns the head about the axis, from the
  // least rotation that takes z to the axis.
  [[nodiscard]] Frame tcp_frame(const Vec3& tip_mm, const Vec3& axis, double yaw) const;
  [[nodiscard]] Frame flange_frame(const Vec3& tip_mm, const Vec3& axis, double yaw) const;
  // Tip and axis in the platform frame that some joints bring about.
  void tip_of(const Joints& joints, Vec3& tip_mm, Vec3& axis) const;

  // Joint limits with margin (some whole turn fits), singularity, links above the table. `metric` gets the singularity
  // metric.
  [[nodiscard]] ArmFault arm_fault(const Joints& joints, double* metric = nullptr) const;
  [[nodiscard]] ArmFault arm_fault(const Posture& posture) const;
  // The fault of the branch at a pose, with its joints.
  [[nodiscard]] ArmFault solve(const Vec3& tip_mm, const Vec3& axis, double yaw, int branch, Posture& posture) const;
  [[nodiscard]] ArmFault solve(const Vec3& tip_mm, const Vec3& axis, double yaw, int branch, Joints& joints) const;

  // Bodies of forearm and wrist as segments with radius, platform frame, millimetres.
  struct Capsule {
    Vec3 a, b;
    double radius;
    const char* name;
  };
  [[nodiscard]] std::array<Capsule, 4> links(const Joints& joints) const;
  // Capsules that hold those of several postures.
  [[nodiscard]] std::array<Capsule, 4> links(const PostureBoxes& postures) const;

  // Head against the platform plane.
  [[nodiscard]] bool head_above_table(const Vec3& tip_mm, const Vec3& axis) const;

  [[nodiscard]] double limit_low(int joint) const { return low_[joint]; }
  [[nodiscard]] double limit_high(int joint) const { return high_[joint]; }
  [[nodiscard]] double joint_speed(int joint) const { return speed_[joint]; }  // that printing may use, rad/s

 private:
  Machine machine_;
  HeadShape head_;
  [[nodiscard]] bool within_limits(const Joints& joints) const;
  [[nodiscard]] ArmFault fault_at(double singularity, const std::array<Vec3, 5>& origins) const;

  [[nodiscard]] std::array<Capsule, 4> links_between(const std::array<Vec3, 5>& origins) const;

  Frame platform_, platform_inverse_, tcp_, tcp_inverse_;
  Joints low_, high_, speed_;
};

[[nodiscard]] Joints radians(const Joints& degrees);

}  // namespace curvesup
