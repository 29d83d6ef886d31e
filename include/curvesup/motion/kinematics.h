#pragma once

#include <Eigen/Geometry>
#include <span>

#include "curvesup/motion/machine.h"

namespace curvesup {

// Frames of an arm: metres, in the base frame.
using Frame = Eigen::Isometry3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Up to eight ways in which the arm reaches a flange frame. branch[i] of a solution says which of the two shoulder (bit
// 2), wrist (bit 1) and elbow (bit 0) postures it is; a branch number keeps its meaning along a continuous motion that
// meets no singularity. Joints lie in (-pi, pi].
struct IkSolutions {
  int count = 0;
  std::array<Joints, 8> joints;
  std::array<int, 8> branch{};
};

// A solution with what its geometry tells besides.
struct Posture {
  Joints joints{};
  int branch = 0;
  std::array<Vec3, 5> origins;  // of the frames behind joints 2 to 6: elbow, wrist, ..., flange
  double singularity = 0.0;     // see singularity_metric()
};

// Flange frame of a Denavit-Hartenberg chain.
[[nodiscard]] Frame forward_kinematics(const Arm& arm, const Joints& joints);
// Frames 1..6 behind each joint; frames[5] is the flange.
[[nodiscard]] std::array<Frame, 6> link_frames(const Arm& arm, const Joints& joints);

// Closed form for arms of the UR family (alpha = 90, 0, 0, 90, -90, 0 degrees; a only at links 2 and 3; d at 1, 4, 5,
// 6). Solutions are independent of joint limits. At a wrist singularity joint 6 is chosen as 0. Empty when out of
// reach.
[[nodiscard]] IkSolutions inverse_kinematics(const Arm& arm, const Frame& flange);
// The solution of one branch; false when there is none.
[[nodiscard]] bool inverse_kinematics(const Arm& arm, const Frame& flange, int branch, Joints& joints);
// The same with the posture; solutions of all branches, in ascending order of branches: returns how many.
[[nodiscard]] bool inverse_kinematics(const Arm& arm, const Frame& flange, int branch, Posture& posture);
[[nodiscard]] int inverse_kinematics(const Arm& arm, const Frame& flange, std::array<Posture, 8>& postures);
// True when the arm's table has the form that the closed form needs.
[[nodiscard]] bool has_closed_form(const Arm& arm);

// Geometric Jacobian of the flange: twist (linear m, angular rad; base frame) per joint rad.
[[nodiscard]] Matrix6 jacobian(const Arm& arm, const Joints& joints);

// min(|sin q5|, |sin q3|, (hypot of the wrist centre in x, y - d4) / d4): 0 at a wrist, elbow or shoulder singularity.
[[nodiscard]] double singularity_metric(const Arm& arm, const Joints& joints);

[[nodiscard]] Frame to_frame(const Pose& pose);
[[nodiscard]] Pose to_pose(const Frame& frame);
// The rotation vector of `rotation` that is nearest to `near` among its aliases of angle up to 2 pi.
[[nodiscard]] Vec3 rotation_vector_near(const Mat3& rotation, const Vec3& near);
// Rotation by a rotation vector.
[[nodiscard]] Mat3 rotation_of(const Vec3& rotation_vector);
// The rotation by the least angle that takes z to the unit vector `axis`.
[[nodiscard]] Mat3 least_rotation_to(const Vec3& axis);

// Distance that the fastest joint turns, each difference taken around the circle.
[[nodiscard]] double largest_joint_step(const Joints& from, const Joints& to);
// `joints` with each angle moved by whole turns to lie nearest to `near`.
[[nodiscard]] Joints unwrapped_near(const Joints& joints, const Joints& near);

}  // namespace curvesup
