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

// The flange, and what the two shoulder angles follow from.
struct Target {
  Vec3 position, x, y, z;
  Vec3 wrist_centre;
  double radius = 0.0;         // of the wrist centre about the base axis
  double cosine = 0.0, sine = 0.0;    // of its direction
  double opening_c = 0.0, opening_s = 0.0;  // of the angle between it and the shoulder's
};

// False when the wrist centre lies inside the cylinder of radius d4.
bool target_of(const Arm& arm, const Frame& flange, Target& target) {
  target.position = flange.translation();
  target.x = flange.linear().col(0);
  target.y = flange.linear().col(1);
  target.z = flange.linear().col(2);
  target.wrist_centre = target.position - arm.dh[5].d_m * target.z;
  const double d4 = arm.dh[3].d_m;
  target.radius = std::sqrt(target.wrist_centre.head<2>().squaredNorm());
  if (target.radius < std::abs(d4) || target.radius == 0.0) return false;
  target.cosine = target.wrist_centre.x() / target.radius;
  target.sine = target.wrist_centre.y() / target.radius;
  target.opening_c = d4 / target.radius;
  target.opening_s = std::sqrt(std::max(0.0, 1.0 - target.opening_c * target.opening_c));
  return true;
}

// Sine and cosine come before every angle: no angle is taken apart again.
bool posture_of(const Arm& arm, const Target& target, int branch, Posture& posture) {
  const bool other_shoulder = (branch & 4) != 0, flipped = (branch & 2) != 0, elbow = (branch & 1) != 0;
  // q1 is a quarter turn past direction + opening, or direction - opening.
  const double open = other_shoulder ? -target.opening_s : target.opening_s;
  const double s1 = target.cosine * target.opening_c - target.sine * open;
  const double c1 = -(target.sine * target.opening_c + target.cosine * open);
  // Frame 1's z axis (s1, -c1, 0) seen from the flange is (s5 c6, -s5 s6, c5).
  const auto from_flange = [&](const Vec3& axis) { return s1 * axis.x() - c1 * axis.y(); };
  const double ax = from_flange(target.x), ay = from_flange(target.y), c5 = from_flange(target.z);
  const double s5 = std::sqrt(ax * ax + ay * ay);
  double c6 = 1.0, s6 = 0.0;
  if (s5 > 1e-9) {
    c6 = (flipped ? -ax : ax) / s5;
    s6 = (flipped ? ay : -ay) / s5;
  }
  // Joints 2, 3, 4 as a planar chain of two bones in frame 1, whose x axis is level and whose y axis is the base's z.
  const Vec3 axis_5 = -s6 * target.x - c6 * target.y;
  const Vec3 end = target.wrist_centre - arm.dh[4].d_m * axis_5;
  const double a2 = arm.dh[1].a_m, a3 = arm.dh[2].a_m;
  const double x = c1 * end.x() + s1 * end.y(), y = end.z() - arm.dh[0].d_m;
  const double squared = x * x + y * y;
  double c3 = (squared - a2 * a2 - a3 * a3) / (2.0 * a2 * a3);
  if (std::abs(c3) > 1.0 + 1e-12) return false;
  c3 = std::clamp(c3, -1.0, 1.0);
  const double s3 = (elbow ? -1.0 : 1.0) * std::sqrt(1.0 - c3 * c3);
  const double along = a2 + a3 * c3, across = a3 * s3;
  double c2 = 1.0, s2 = 0.0;
  if (squared > 0.0) {
    c2 = (x * along + y * across) / squared;
    s2 = (y * along - x * across) / squared;
  }
  const double q2 = std::atan2(s2, c2), q3 = std::atan2(s3, c3);
  const double q4 = std::atan2(c1 * axis_5.x() + s1 * axis_5.y(), -axis_5.z()) - q2 - q3;
  posture.joints = {std::atan2(s1, c1), q2, q3, wrapped(q4), std::atan2(flipped ? -s5 : s5, c5), std::atan2(s6, c6)};
  posture.branch = branch;
  posture.origins = {Vec3(a2 * c2 * c1, a2 * c2 * s1, arm.dh[0].d_m + a2 * s2),
                     end - arm.dh[3].d_m * Vec3(s1, -c1, 0.0), end, target.wrist_centre, target.position};
  const double d4 = std::abs(arm.dh[3].d_m);
  posture.singularity = std::min({s5, std::abs(s3), (target.radius - d4) / d4});
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
  std::array<Posture, 8> postures;
  IkSolutions solutions;
  solutions.count = inverse_kinematics(arm, flange, postures);
  for (int i = 0; i < solutions.count; ++i) {
    solutions.joints[i] = postures[i].joints;
    solutions.branch[i] = postures[i].branch;
  }
  return solutions;
}

int inverse_kinematics(const Arm& arm, const Frame& flange, std::array<Posture, 8>& postures) {
  Target target;
  if (!target_of(arm, flange, target)) return 0;
  int count = 0;
  for (int branch = 0; branch < 8; ++branch) count += posture_of(arm, target, branch, postures[count]);
  return count;
}

bool inverse_kinematics(const Arm& arm, const Frame& flange, int branch, Posture& posture) {
  Target target;
  return target_of(arm, flange, target) && posture_of(arm, target, branch, posture);
}

bool inverse_kinematics(const Arm& arm, const Frame& flange, int branch, Joints& joints) {
  Posture posture;
  if (!inverse_kinematics(arm, flange, branch, posture)) return false;
  joints = posture.joints;
  return true;
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
