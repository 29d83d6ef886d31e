#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "curvesup/motion/machine.h"

// What is read from emitted text, in as little room as its digits need: a print has millions of moves.
namespace curvesup::emitted {

// Three numbers in units of their last decimal.
template <int kDecimals>
class PackedVec {
 public:
  PackedVec() = default;
  PackedVec(const Vec3& v) {
    for (int i = 0; i < 3; ++i) units_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(std::lrint(std::clamp(v[i] / kUnit, -2e9, 2e9)));
  }
  operator Vec3() const { return vec(); }
  [[nodiscard]] Vec3 vec() const { return kUnit * Vec3(units_[0], units_[1], units_[2]); }

 private:
  static_assert(kDecimals == 4 || kDecimals == 6 || kDecimals == 7);
  static constexpr double kUnit = kDecimals == 4 ? 1e-4 : kDecimals == 6 ? 1e-6 : 1e-7;
  std::array<std::int32_t, 3> units_{};
};

// A pose of seven and six decimals.
struct PackedPose {
  PackedVec<7> position_m;
  PackedVec<6> rotation_vector;

  PackedPose() = default;
  PackedPose(const Pose& pose) : position_m(pose.position_m), rotation_vector(pose.rotation_vector) {}
  operator Pose() const { return {position_m, rotation_vector}; }
};

// Joints to 5e-7 rad.
class PackedJoints {
 public:
  PackedJoints() = default;
  PackedJoints(const Joints& joints) {
    for (std::size_t i = 0; i < 6; ++i) angle_[i] = static_cast<float>(joints[i]);
  }
  double operator[](std::size_t i) const { return static_cast<double>(angle_[i]); }
  operator Joints() const {
    Joints joints;
    for (std::size_t i = 0; i < 6; ++i) joints[i] = static_cast<double>(angle_[i]);
    return joints;
  }

 private:
  std::array<float, 6> angle_{};
};

}  // namespace curvesup::emitted
