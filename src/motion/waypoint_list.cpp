#include <cmath>

#include "curvesup/motion/motion.h"

namespace curvesup {
namespace {

constexpr double kPerMillimetre = 1e6, kPerMetre = 1e9;    // nanometres
constexpr double kPerRadian = 268435456.0;                 // 2^28: up to 8 radians
constexpr double kPerUnit = 1073741824.0;                  // 2^30, of a unit vector

template <class From, std::size_t N>
std::array<std::int32_t, N> to_integers(const From& values, double scale) {
  std::array<std::int32_t, N> integers;
  for (std::size_t i = 0; i < N; ++i) integers[i] = static_cast<std::int32_t>(std::lround(values[i] * scale));
  return integers;
}

Vec3 to_vector(const std::array<std::int32_t, 3>& integers, double scale) {
  return Vec3(integers[0] / scale, integers[1] / scale, integers[2] / scale);
}

}  // namespace

WaypointList::Packed WaypointList::pack(const Waypoint& waypoint) {
  Packed packed;
  packed.tip = to_integers<Vec3, 3>(waypoint.tip_mm, kPerMillimetre);
  packed.position = to_integers<Vec3, 3>(waypoint.pose.position_m, kPerMetre);
  packed.rotation = to_integers<Vec3, 3>(waypoint.pose.rotation_vector, kPerRadian);
  packed.axis = to_integers<Vec3, 3>(waypoint.axis, kPerUnit);
  packed.joints = to_integers<Joints, 6>(waypoint.joints, kPerRadian);
  packed.volume = static_cast<float>(waypoint.volume_mm3);
  packed.speed = static_cast<float>(waypoint.speed_mm_s);
  packed.duration = static_cast<float>(waypoint.duration_s);
  packed.blend = static_cast<float>(waypoint.blend_mm);
  packed.point = waypoint.point;
  packed.rotation_limited = waypoint.rotation_limited;
  return packed;
}

Waypoint WaypointList::operator[](std::size_t i) const {
  const Packed& packed = packed_[i];
  Waypoint waypoint;
  waypoint.tip_mm = to_vector(packed.tip, kPerMillimetre);
  waypoint.axis = to_vector(packed.axis, kPerUnit);
  waypoint.pose = {to_vector(packed.position, kPerMetre), to_vector(packed.rotation, kPerRadian)};
  for (std::size_t j = 0; j < 6; ++j) waypoint.joints[j] = packed.joints[j] / kPerRadian;
  waypoint.volume_mm3 = packed.volume;
  waypoint.speed_mm_s = packed.speed;
  waypoint.duration_s = packed.duration;
  waypoint.blend_mm = packed.blend;
  waypoint.point = packed.point;
  waypoint.rotation_limited = packed.rotation_limited;
  return waypoint;
}

void WaypointList::set(std::size_t i, const Waypoint& waypoint) { packed_[i] = pack(waypoint); }

void WaypointList::push_back(const Waypoint& waypoint) { packed_.push_back(pack(waypoint)); }

}  // namespace curvesup
