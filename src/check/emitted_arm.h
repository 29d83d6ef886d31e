#pragma once

#include "check/emitted_script.h"
#include "curvesup/check/check_output.h"

// The arm behind the programs: forward kinematics from the table of the machine, inverse by Newton steps.
namespace curvesup::emitted {

struct ArmFrame {
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();
};

[[nodiscard]] Mat3 rotation_from(const Vec3& rotation_vector);
// Angle and axis of a rotation, angle in [0, pi].
[[nodiscard]] Vec3 rotation_vector_from(const Mat3& rotation);
[[nodiscard]] ArmFrame frame_of(const Pose& pose);
// The third column of rotation_from(): where the nozzle points from the part.
[[nodiscard]] Vec3 tool_axis(const Vec3& rotation_vector);

// Where the links of an arm are at some joints.
class LinkChain;
class ArmLinks {
 public:
  explicit ArmLinks(const Arm& arm);
  ~ArmLinks();

  [[nodiscard]] ArmFrame tool(const Joints& joints, const Pose& tcp) const;
  // Elbow, the ends of the links behind it, and the flange: origins of the frames behind joints 2 to 6, metres.
  [[nodiscard]] std::array<Vec3, 5> points(const Joints& joints) const;

 private:
  std::unique_ptr<const LinkChain> chain_;
};

// Length over which the controller spreads a printing move: the way, or the turn by its rotation rule; metres.
[[nodiscard]] double planned_length_m(const Pose& from, const Pose& to, double rotation_rad_per_m);

// Fills RobotMove::reached, and the pose of moves to joints. Rules 16 and 17, 18 in part.
void check_arm(RobotPart& part, const Machine& machine);

// Rules 9 to 14 along the chains of printing moves.
void check_chains(RobotPart& part, const Machine& machine, EmittedFigures& figures);

}  // namespace curvesup::emitted
