#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace curvesup {

// Frame of the whole program: millimetres, z up, platform at z = 0.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

// Index of a mesh element in its flat array; kNone marks "there is none".
using Index = std::int32_t;
inline constexpr Index kNone = -1;

// What a tet, a layer or a path is made of. The values are those of the written files.
enum class Material : std::uint8_t { model = 0, support = 1 };
inline constexpr int kMaterialCount = 2;

}  // namespace curvesup
