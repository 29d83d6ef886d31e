#include "motion/deposit_bounds.h"

#include <cmath>

namespace curvesup {
namespace {

constexpr float kRounded = 1e-3f;   // of the sine of an angle whose cosine is in single precision
constexpr float kNearAxis = 1.0f;   // mm, where a direction from the axis is not known well enough
constexpr float kRelative = 1e-4f;  // of such a direction

// In a form that becomes one instruction for eight.
inline float larger(float a, float b) { return a > b ? a : b; }
inline float smaller(float a, float b) { return a < b ? a : b; }
inline float dot(float x, float y, float z, const Point3f& with) { return x * with.x + y * with.y + z * with.z; }

[[gnu::always_inline]] inline float reach_of(const DepositBoxes& boxes, std::size_t i, const Point3f& direction) {
  const float box = boxes.half_x[i] * std::abs(direction.x) + boxes.half_y[i] * std::abs(direction.y) +
                    boxes.half_z[i] * std::abs(direction.z);
  const float cosine = dot(boxes.normal_x[i], boxes.normal_y[i], boxes.normal_z[i], direction);
  // Rounding takes up to 7e-4 from the sine of a small angle.
  const float sine = std::sqrt(larger(1.0f - cosine * cosine, 0.0f)) + kRounded;
  return smaller(box, boxes.half_thickness[i] * std::abs(cosine) + boxes.radius[i] * sine);
}

[[gnu::always_inline]] inline float capsule_distance(const CapsuleBounds& capsule, float px, float py, float pz) {
  const float x = px - capsule.from.x, y = py - capsule.from.y, z = pz - capsule.from.z;
  const float t = smaller(larger(dot(x, y, z, capsule.along) * capsule.inverse, 0.0f), 1.0f);
  const float dx = x - t * capsule.along.x, dy = y - t * capsule.along.y, dz = z - t * capsule.along.z;
  return std::sqrt(dx * dx + dy * dy + dz * dz) - capsule.reach;
}

}  // namespace

float DepositBoxes::reach(std::size_t box, const Point3f& direction) const { return reach_of(*this, box, direction); }

__attribute__((target_clones("avx2", "default"))) void spare_of(const HeadBounds& head, float clearance,
                                                                const DepositBoxes& boxes, Index before, float* __restrict spare) {
  const HeadBounds h = head;
  for (std::size_t i = 0; i < kNodeBoxes; ++i) {
    const float x = boxes.x[i] - h.tip.x, y = boxes.y[i] - h.tip.y, z = boxes.z[i] - h.tip.z;
    const float radius = boxes.radius[i], height = dot(x, y, z, h.axis);
    const float far = std::sqrt(x * x + y * y + z * z) + radius, along = reach_of(boxes, i, h.axis);
    // How far it lies below all that counts.
    const float below = -(height + along + h.rise + far * h.turn);
    const float ax = x - height * h.axis.x, ay = y - height * h.axis.y, az = z - height * h.axis.z;
    const float aside = std::sqrt(ax * ax + ay * ay + az * az);
    // The distance from the hull's flank grows fastest along its normal; being convex, it is nowhere in the box less than
    // that slope says.
    const float inverse = h.cosine / larger(aside, kNearAxis), sine = h.cosine * h.slope;
    const float normal = std::abs(ax * inverse - sine * h.axis.x) * boxes.half_x[i] +
                         std::abs(ay * inverse - sine * h.axis.y) * boxes.half_y[i] +
                         std::abs(az * inverse - sine * h.axis.z) * boxes.half_z[i] + kRelative * radius;
    const float flank = (aside - h.tip_radius - h.slope * height) * h.cosine - (aside > kNearAxis ? normal : radius);
    const float gap = larger(larger(flank, -height - along), larger(aside - h.widest - radius, height - h.length - along));
    const float least = larger(below, gap - h.apart - h.swing * far - clearance);
    spare[i] = boxes.earliest[i] < before ? least : 0.0f;
  }
}

__attribute__((target_clones("avx2", "default"))) void spare_of(const HeadBounds& head, float clearance,
                                                                const DepositSamples& samples, Index before, float* __restrict spare) {
  const HeadBounds h = head;
  for (std::size_t i = 0; i < kLeafSamples; ++i) {
    const float x = samples.x[i] - h.tip.x, y = samples.y[i] - h.tip.y, z = samples.z[i] - h.tip.z;
    const float height = dot(x, y, z, h.axis), far = std::sqrt(x * x + y * y + z * z);
    const float below = -(height + h.rise + far * h.turn);
    const float ax = x - height * h.axis.x, ay = y - height * h.axis.y, az = z - height * h.axis.z;
    const float aside = std::sqrt(ax * ax + ay * ay + az * az);
    const float flank = (aside - h.tip_radius - h.slope * height) * h.cosine;
    const float gap = larger(larger(flank, -height), larger(aside - h.widest, height - h.length));
    const float least = larger(below, gap - h.apart - h.swing * far - clearance);
    spare[i] = samples.point[i] < before ? least : 0.0f;
  }
}

__attribute__((target_clones("avx2", "default"))) void spare_of(const CapsuleBounds& capsule, const DepositBoxes& boxes,
                                                                Index before, float* __restrict spare) {
  const CapsuleBounds c = capsule;
  for (std::size_t i = 0; i < kNodeBoxes; ++i) {
    const float least = capsule_distance(c, boxes.x[i], boxes.y[i], boxes.z[i]) - boxes.radius[i];
    spare[i] = boxes.earliest[i] < before ? least : 0.0f;
  }
}

__attribute__((target_clones("avx2", "default"))) void spare_of(const CapsuleBounds& capsule, const DepositSamples& samples,
                                                                Index before, float* __restrict spare) {
  const CapsuleBounds c = capsule;
  for (std::size_t i = 0; i < kLeafSamples; ++i) {
    const float least = capsule_distance(c, samples.x[i], samples.y[i], samples.z[i]);
    spare[i] = samples.point[i] < before ? least : 0.0f;
  }
}

}  // namespace curvesup
