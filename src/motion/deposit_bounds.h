#pragma once

#include <array>
#include <cstddef>

#include "curvesup/core/types.h"

namespace curvesup {

// What a body must look at of a Deposit, eight boxes or sixteen samples at a time, in single precision. Each function fills
// `spare`: how much nearer a thing could come before it matters. It is not negative where nothing of it matters, be it that
// nothing of it is laid before the point `before`.

constexpr std::size_t kNodeBoxes = 8, kLeafSamples = 16;
constexpr float kMargin_mm = 2e-3f;  // of all that is worked out in single precision, for parts up to a metre

struct Point3f {
  float x = 0.0f, y = 0.0f, z = 0.0f;
};

// Eight boxes, the spheres around them, the slabs across their layers that hold what is in them, the earliest points.
struct DepositBoxes {
  template <class Value>
  using Row = std::array<Value, kNodeBoxes>;
  Row<float> x{}, y{}, z{}, half_x{}, half_y{}, half_z{}, radius{};
  Row<float> normal_x{}, normal_y{}, normal_z{}, half_thickness{};
  Row<Index> earliest;

  // How far what is in one of them reaches from its middle in a direction, a unit vector.
  [[nodiscard]] float reach(std::size_t box, const Point3f& direction) const;
};

// Samples next to each other.
struct DepositSamples {
  template <class Value>
  using Row = std::array<Value, kLeafSamples>;
  Row<float> x{}, y{}, z{};
  Row<Index> point;
};

// Poses of the head that are near each other: one in their middle, and how far any of them is from it.
struct HeadBounds {
  Point3f tip, axis;
  float tip_radius, slope, cosine, widest, length;  // of the least cone around the head
  float turn;   // between axes, as a chord
  float rise;   // of the middle's tip above another's tip plane, less the height up to which nothing counts there
  float swing;  // that axes turn a thing by, over its distance from the tip
  float apart;  // that tips bring it nearer
};
void spare_of(const HeadBounds& head, float clearance, const DepositBoxes& boxes, Index before, float* __restrict spare);
void spare_of(const HeadBounds& head, float clearance, const DepositSamples& samples, Index before, float* __restrict spare);

// A capsule.
struct CapsuleBounds {
  Point3f from, along;
  float inverse;  // of the squared length
  float reach;    // radius and clearance
};
void spare_of(const CapsuleBounds& capsule, const DepositBoxes& boxes, Index before, float* __restrict spare);
void spare_of(const CapsuleBounds& capsule, const DepositSamples& samples, Index before, float* __restrict spare);

}  // namespace curvesup
