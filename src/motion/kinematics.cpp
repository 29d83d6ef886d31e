#include "curvesup/motion/kinematics.h"

#include <cmath>
#include <numbers>

namespace curvesup {
namespace {

constexpr double kPi = std::numbers::pi;

double wrapped(double angle) {
  while (angle > kPi) angle -= 2.0 * kPi;
  while (angle <= -kPi) angle += 2.0 * kPi;
  return angle;
}

// The least turn that leads from one angle to another.
double turn_between(double from, double to) {
  const double turn = to - from;
  return std::abs(turn) <= kPi ? turn : std::remainder(turn, 2.0 * kPi);
}

struct Turn {
  double cosine, sine;
};

// Twists of links are right angles, nearly always.
Turn twist_of(double angle) {
  if (angle == 0.0) return {1.0, 0.0};
  if (std::abs(angle) == 0.5 * kPi) return {0.0, angle > 0.0 ? 1.0 : -1.0};
  return {std::cos(angle), std::sin(angle)};
}

// The two shoulder angles for a wrist centre; false when the centre lies inside the cylinder of radius d4.
bool shoulder_angles(const Arm& arm, const Vec3& wrist_centre, double angles[2]) {
  const double radius = std::hypot(wrist_centre.x(), wrist_centre.y());
  const double d4 = arm.dh[3].d_m;
  if (radius < std::abs(d4)) return false;
  const double direction = std::atan2(wrist_centre.y(), wrist_centre.x());
  const double opening = std::acos(std::clamp(d4 / radius, -1.0, 1.0));
  angles[0] = direction + opening + 0.5 * kPi;
  angles[1] = direction - opening + 0.5 * kPi;
  return true;
}

struct WristAngles {
  double q5 = 0.0, q6 = 0.0;
};

// Frame 1's z axis seen from the flange is (s5 c6, -s5 s6, c5).
WristAngles wrist_angles(const Frame& flange, double q1, bool flipped) {
  const Vec3 axis = flange.linear().transpose() * Vec3(std::sin(q1), -std::cos(q1), 0.0);
  const double sine = std::hypot(axis.x(), axis.y());
  WristAngles angles;
  angles.q5 = std::atan2(flipped ? -sine : sine, axis.z());
  if (sine > 1e-9) angles.q6 = flipped ? std::atan2(axis.y(), -axis.x()) : std::atan2(-axis.y(), axis.x());
  return angles;
}

// Joints 2, 3, 4 as a planar chain of two bones in frame 1, whose x axis is level and whose y axis is the base's z.
bool planar_chain(const Arm& arm, const Frame& flange, const WristAngles& wrist, double q1, bool elbow,
                  Joints& joints) {
  const double c1 = std::cos(q1), s1 = std::sin(q1);
  const Vec3 axis_5 = -std::sin(wrist.q6) * flange.linear().col(0) - std::cos(wrist.q6) * flange.linear().col(1);
  const Vec3 end = flange.translation() - arm.dh[5].d_m * flange.linear().col(2) - arm.dh[4].d_m * axis_5;
  const double a2 = arm.dh[1].a_m, a3 = arm.dh[2].a_m;
  const double x = c1 * end.x() + s1 * end.y(), y = end.z() - arm.dh[0].d_m;
  double cosine = (x * x + y * y - a2 * a2 - a3 * a3) / (2.0 * a2 * a3);
  if (std::abs(cosine) > 1.0 + 1e-12) return false;
  cosine = std::clamp(cosine, -1.0, 1.0);
  const double q3 = elbow ? -std::acos(cosine) : std::acos(cosine);
  const double q2 = std::atan2(y, x) - std::atan2(a3 * std::sin(q3), a2 + a3 * cosine);
  const double q4 = std::atan2(c1 * axis_5.x() + s1 * axis_5.y(), -axis_5.z()) - q2 - q3;
  joints = {wrapped(q1), wrapped(q2), wrapped(q3), wrapped(q4), wrapped(wrist.q5), wrapped(wrist.q6)};
  return true;
}

}  // namespace

Frame forward_kinematics(const Arm& arm, const Joints& joints) { return link_frames(arm, joints)[5]; }

std::array<Frame, 6> link_frames(const Arm& arm, const Joints& joints) {
  std::array<Frame, 6> frames;
  Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ(), origin = Vec3::Zero();
  for (int i = 0; i < 6; ++i) {
    const double c = std::cos(joints[i]), s = std::sin(joints[i]);
    const Turn twist = twist_of(arm.dh[i].alpha_rad);
    const Vec3 along = c * x + s * y, across = c * y - s * x;
    origin += arm.dh[i].a_m * along + arm.dh[i].d_m * z;
    x = along;
    y = twist.cosine * across + twist.sine * z;
    z = twist.cosine * z - twist.sine * across;
    frames[i].linear().col(0) = x;
    frames[i].linear().col(1) = y;
    frames[i].linear().col(2) = z;
    frames[i].translation() = origin;
    frames[i].makeAffine();
  }
  return frames;
}

IkSolutions inverse_kinematics(const Arm& arm, const Frame& flange) {
  IkSolutions solutions;
  double shoulder[2];
  const Vec3 wrist_centre = flange.translation() - arm.dh[5].d_m * flange.linear().col(2);
  if (!shoulder_angles(arm, wrist_centre, shoulder)) return solutions;
  for (int s = 0; s < 2; ++s) {
    for (int w = 0; w < 2; ++w) {
      const WristAngles wrist = wrist_angles(flange, shoulder[s], w == 1);
      for (int e = 0; e < 2; ++e) {
        if (!planar_chain(arm, flange, wrist, shoulder[s], e == 1, solutions.joints[solutions.count])) continue;
        solutions.branch[solutions.count++] = 4 * s + 2 * w + e;
      }
    }
  }
  return solutions;
}

bool inverse_kinematics(const Arm& arm, const Frame& flange, int branch, Joints& joints) {
  double shoulder[2];
  const Vec3 wrist_centre = flange.translation() - arm.dh[5].d_m * flange.linear().col(2);
  if (!shoulder_angles(arm, wrist_centre, shoulder)) return false;
  const double q1 = shoulder[branch >> 2];
  return planar_chain(arm, flange, wrist_angles(flange, q1, (branch & 2) != 0), q1, (branch & 1) != 0, joints);
}

bool has_closed_form(const Arm& arm) {
  constexpr double kAlpha[6] = {kPi / 2, 0, 0, kPi / 2, -kPi / 2, 0};
  for (int i = 0; i < 6; ++i) {
    if (std::abs(arm.dh[i].alpha_rad - kAlpha[i]) > 1e-9) return false;
    const bool bone = i == 1 || i == 2;
    if (bone ? (arm.dh[i].a_m == 0.0 || arm.dh[i].d_m != 0.0) : arm.dh[i].a_m != 0.0) return false;
  }
  return arm.dh[3].d_m > 0.0;
}

Matrix6 jacobian(const Arm& arm, const Joints& joints) {
  const std::array<Frame, 6> frames = link_frames(arm, joints);
  const Vec3 tip = frames[5].translation();
  Matrix6 columns;
  Vec3 axis = Vec3::UnitZ(), origin = Vec3::Zero();
  for (int i = 0; i < 6; ++i) {
    columns.col(i) << axis.cross(tip - origin), axis;
    axis = frames[i].linear().col(2);
    origin = frames[i].translation();
  }
  return columns;
}

double singularity_metric(const Arm& arm, const Joints& joints) {
  const Vec3 wrist = link_frames(arm, joints)[4].translation();
  const double d4 = std::abs(arm.dh[3].d_m);
  const double shoulder = (std::hypot(wrist.x(), wrist.y()) - d4) / d4;
  return std::min({std::abs(std::sin(joints[4])), std::abs(std::sin(joints[2])), shoulder});
}

Mat3 rotation_of(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-15) return Mat3::Identity();
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

Frame to_frame(const Pose& pose) {
  Frame frame;
  frame.linear() = rotation_of(pose.rotation_vector);
  frame.translation() = pose.position_m;
  frame.makeAffine();
  return frame;
}

Pose to_pose(const Frame& frame) {
  const Eigen::AngleAxisd turn(Mat3(frame.linear()));
  return {frame.translation(), turn.angle() * turn.axis()};
}

Vec3 rotation_vector_near(const Mat3& rotation, const Vec3& near) {
  const Eigen::AngleAxisd turn(rotation);
  const Vec3 canonical = turn.angle() * turn.axis();
  const Vec3 alias = (turn.angle() - 2.0 * kPi) * turn.axis();
  return (alias - near).squaredNorm() < (canonical - near).squaredNorm() ? alias : canonical;
}

Mat3 least_rotation_to(const Vec3& axis) {
  if (axis.z() < -1.0 + 1e-12) return Eigen::AngleAxisd(kPi, Vec3::UnitX()).toRotationMatrix();
  const double x = axis.x(), y = axis.y(), z = axis.z(), f = 1.0 / (1.0 + z);
  Mat3 rotation;
  rotation << 1.0 - x * x * f, -x * y * f, x,  //
      -x * y * f, 1.0 - y * y * f, y,          //
      -x, -y, z;
  return rotation;
}

double largest_joint_step(const Joints& from, const Joints& to) {
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(turn_between(from[i], to[i])));
  return largest;
}

Joints unwrapped_near(const Joints& joints, const Joints& near) {
  Joints result;
  for (int i = 0; i < 6; ++i) result[i] = near[i] + turn_between(near[i], joints[i]);
  return result;
}

}  // namespace curvesup
