#pragma once

#include <vector>

#include "motion/cell.h"
#include "motion/deposit.h"
#include "motion/placed_paths.h"

namespace curvesup {

// Where on its way along a path the head touches the table or what is laid before.
class HeadLook {
 public:
  // Both must outlive this; the deposit may grow and be put in another order.
  HeadLook(const Cell& cell, const Deposit& deposit) : cell_(cell), deposit_(deposit) {}

  // The head on its way from one point to another.
  struct OpenPose {
    Vec3 tip, axis;
    Index from, point;
  };

  [[nodiscard]] static Deposit::HeadPose pose(const PlacedPaths& placed, const Vec3& tip, const Vec3& axis, Index point);

  // Where the head does touch something: among waypoints that are not known to be free, and halves of the way to them
  // where it is long or the axis turns, since waypoints may come to lie there.
  [[nodiscard]] std::vector<OpenPose> touching_poses(const PlacedPaths& placed, std::size_t p) const;
  // Marks the points of a path at and between which that is so.
  [[nodiscard]] std::vector<char> touching_points(const PlacedPaths& placed, std::size_t p) const;
  // Adds the points around such poses; false when none is new.
  bool add_touching_keys(const PlacedPaths& placed, std::size_t p, std::vector<Index>& keys) const;
  // Whether each such place would be free, at some allowed tilt, from as high as it may be.
  [[nodiscard]] bool raise_may_help(const PlacedPaths& placed, std::size_t p) const;

  bool is_free(const PlacedPaths& placed, const Vec3& tip, const Vec3& axis, Index point, Contact* contact) const;

 private:
  [[nodiscard]] std::vector<OpenPose> open_poses(const PlacedPaths& placed, std::size_t p) const;

  const Cell& cell_;
  const Deposit& deposit_;
};

}  // namespace curvesup
