#include "curvesup/motion/kinematics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace curvesup {
namespace {

Arm ur10e() {
  Arm arm;
  arm.model = "UR10e";
  const double a[6] = {0, -0.6127, -0.57155, 0, 0, 0}, d[6] = {0.1807, 0, 0, 0.17415, 0.11985, 0.11655};
  for (int i = 0; i < 6; ++i) arm.dh[i].a_m = a[i], arm.dh[i].d_m = d[i];
  return arm;
}

double angle_between(const Mat3& a, const Mat3& b) { return Eigen::AngleAxisd(Mat3(a.transpose() * b)).angle(); }

Joints random_joints(std::mt19937& random) {
  std::uniform_real_distribution<double> angle(-3.1, 3.1);
  Joints joints;
  for (double& q : joints) q = angle(random);
  return joints;
}

TEST(Kinematics, GoldenFlangeFramesOfUr5e) {
  const Arm arm;
  EXPECT_LT((forward_kinematics(arm, Joints{}).translation() - Vec3(-0.8172, -0.2329, 0.0628)).norm(), 1e-12);
  const Frame frame = forward_kinematics(arm, {0.3, -1.4, 1.6, -1.8, -1.5, 0.2});
  EXPECT_LT((frame.translation() - Vec3(-0.492727, -0.299325, 0.407001)).norm(), 1e-6);
  Mat3 rotation;
  rotation << -.101123, .994850, -.006921, .992035, .100307, -.076185, -.075099, -.014570, -.997070;
  EXPECT_LT((frame.linear() - rotation).norm(), 2e-6);
}

TEST(Kinematics, EverySolutionReproducesTheFlangeAndTheGeneratingJointsAreAmongThem) {
  std::mt19937 random(1);
  for (const Arm& arm : {Arm{}, ur10e()}) {
    ASSERT_TRUE(has_closed_form(arm));
    for (int trial = 0; trial < 2000; ++trial) {
      const Joints joints = random_joints(random);
      if (singularity_metric(arm, joints) < 1e-3) continue;
      const Frame flange = forward_kinematics(arm, joints);
      const IkSolutions solutions = inverse_kinematics(arm, flange);
      ASSERT_GE(solutions.count, 2);
      double nearest = 1.0;
      for (int i = 0; i < solutions.count; ++i) {
        const Frame again = forward_kinematics(arm, solutions.joints[i]);
        EXPECT_LT((again.translation() - flange.translation()).norm(), 1e-9);
        EXPECT_LT((again.linear() - flange.linear()).norm(), 1e-9);
        nearest = std::min(nearest, largest_joint_step(solutions.joints[i], joints));
        Joints single;
        ASSERT_TRUE(inverse_kinematics(arm, flange, solutions.branch[i], single));
        EXPECT_EQ(single, solutions.joints[i]);
        for (int j = 0; j < i; ++j) EXPECT_GT(largest_joint_step(solutions.joints[i], solutions.joints[j]), 1e-6);
      }
      EXPECT_LT(nearest, 1e-6) << "trial " << trial;
    }
  }
}

TEST(Kinematics, BranchKeepsItsMeaningAlongAMotion) {
  const Arm arm;
  const Joints start = {0.3, -1.4, 1.6, -1.8, -1.5, 0.2};
  const Frame from = forward_kinematics(arm, start);
  const IkSolutions first = inverse_kinematics(arm, from);
  for (int s = 0; s < first.count; ++s) {
    Joints previous = first.joints[s];
    for (int step = 1; step <= 50; ++step) {
      Frame flange = from;
      flange.translation() += Vec3(0.001, -0.0005, 0.0008) * step;
      Joints joints;
      ASSERT_TRUE(inverse_kinematics(arm, flange, first.branch[s], joints));
      EXPECT_LT(largest_joint_step(previous, joints), 0.05);
      previous = joints;
    }
  }
}

TEST(Kinematics, JacobianMatchesFiniteDifferences) {
  std::mt19937 random(2);
  for (const Arm& arm : {Arm{}, ur10e()}) {
    for (int trial = 0; trial < 50; ++trial) {
      const Joints joints = random_joints(random);
      const Frame frame = forward_kinematics(arm, joints);
      const Matrix6 columns = jacobian(arm, joints);
      for (int i = 0; i < 6; ++i) {
        Joints moved = joints;
        moved[i] += 1e-6;
        const Frame next = forward_kinematics(arm, moved);
        const Eigen::AngleAxisd turn(Mat3(next.linear() * frame.linear().transpose()));
        const Vec3 linear = (next.translation() - frame.translation()) / 1e-6;
        const Vec3 angular = turn.angle() * turn.axis() / 1e-6;
        EXPECT_LT((columns.col(i).head<3>() - linear).norm(), 1e-5);
        EXPECT_LT((columns.col(i).tail<3>() - angular).norm(), 1e-4);
      }
    }
  }
}

TEST(Kinematics, SingularityMetricVanishesWhereTheJacobianDoes) {
  const Arm arm;
  EXPECT_LT(singularity_metric(arm, {0.3, -1.4, 1.6, -1.8, 0.0, 0.2}), 1e-12);
  EXPECT_LT(singularity_metric(arm, {0.3, -1.4, 0.0, -1.8, -1.5, 0.2}), 1e-12);
  EXPECT_LT(std::abs(jacobian(arm, {0.3, -1.4, 1.6, -1.8, 0.0, 0.2}).determinant()), 1e-12);
  EXPECT_GT(singularity_metric(arm, {0.3, -1.4, 1.6, -1.8, -1.5, 0.2}), 0.5);
}

TEST(Kinematics, OutOfReachHasNoSolution) {
  Frame far = Frame::Identity();
  far.translation() = Vec3(1.2, 0, 0.2);
  EXPECT_EQ(inverse_kinematics(Arm{}, far).count, 0);
  far.translation() = Vec3(0.05, 0, 0.3 + Arm{}.dh[5].d_m);  // wrist centre inside the shoulder cylinder
  EXPECT_EQ(inverse_kinematics(Arm{}, far).count, 0);
}

TEST(Kinematics, RotationVectorTakesTheAliasNearest) {
  const Mat3 rotation = rotation_of(Vec3(0, 0, 3.1));
  EXPECT_LT((rotation_vector_near(rotation, Vec3(0, 0, 2.9)) - Vec3(0, 0, 3.1)).norm(), 1e-9);
  EXPECT_LT((rotation_vector_near(rotation, Vec3(0, 0, -3.2)) - Vec3(0, 0, 3.1 - 2 * std::numbers::pi)).norm(), 1e-9);
}

TEST(Kinematics, LeastRotationTakesZToTheAxisByTheirAngle) {
  for (const Vec3& raw : {Vec3(0.3, -0.2, 0.9), Vec3(1, 0, 0), Vec3(0.4, 0.5, -0.7), Vec3(0, 0, 1)}) {
    const Vec3 axis = raw.normalized();
    const Mat3 rotation = least_rotation_to(axis);
    EXPECT_LT((rotation.col(2) - axis).norm(), 1e-12);
    EXPECT_LT((rotation * rotation.transpose() - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(angle_between(Mat3::Identity(), rotation), std::acos(axis.z()), 1e-7);
  }
}

}  // namespace
}  // namespace curvesup
