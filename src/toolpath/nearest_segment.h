#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup::toolpath {

// A straight piece of a track on a surface.
struct Segment {
  Vec3 from, along;  // along: to the other end
  Vec3 normal;       // of the surface
  double length, inverse_squared_length;  // the latter 0 of a point

  Segment(const Vec3& start, const Vec3& way, const Vec3& across)
      : from(start), along(way), normal(across), length(way.norm()), inverse_squared_length(length > 1e-12 ? 1.0 / (length * length) : 0.0) {}

  // Of the way along it to the point nearest to a place, 0 to 1.
  [[nodiscard]] double part(const Vec3& place) const { return std::clamp((place - from).dot(along) * inverse_squared_length, 0.0, 1.0); }
  // From the point at that part of the way.
  [[nodiscard]] double squared_distance(const Vec3& place, double at) const { return (place - from - at * along).squaredNorm(); }
  [[nodiscard]] double squared_distance(const Vec3& place) const { return squared_distance(place, part(place)); }
};

// A place on a surface; its normal need not be of unit length.
struct Place {
  Vec3 position, normal;
};

// Cells of a cubic grid. Cells of one slot are not told apart: who looks into one finds some things that are farther off.
class CellSlots {
 public:
  CellSlots(double cell, std::size_t slots) : cell_(cell), mask_(slots - 1) {}  // slots: a power of two

  [[nodiscard]] std::size_t size() const { return mask_ + 1; }

  // Of every cell that the box touches; a slot may come twice.
  template <class Visit>
  void for_box(const Vec3& low, const Vec3& high, const Visit& visit) const {
    const std::int64_t last_x = index(high.x()), last_y = index(high.y()), last_z = index(high.z());
    for (std::int64_t x = index(low.x()); x <= last_x; ++x) {
      for (std::int64_t y = index(low.y()); y <= last_y; ++y) {
        for (std::int64_t z = index(low.z()); z <= last_z; ++z) visit(slot(x, y, z));
      }
    }
  }

 private:
  [[nodiscard]] std::int64_t index(double x) const {
    constexpr double kOrigin = 1 << 20;
    return static_cast<std::int64_t>(x / cell_ + kOrigin);
  }
  [[nodiscard]] std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
    const std::uint64_t key = static_cast<std::uint64_t>(x << 42 | y << 21 | z);
    return ((key ^ key >> 32) * 0x9e3779b97f4a7c15ULL >> 32) & mask_;
  }
  double cell_;
  std::size_t mask_;
};

struct NearestSegment {
  Index id = kNone;  // kNone where there is none
  float squared = 0.0F;  // distance
};

// Segments by where they run.
class SegmentGrid {
 public:
  // `reach`: no place asked for lies much farther from its nearest segment, or the answer takes longer.
  SegmentGrid(std::span<const Segment> segments, double reach);

  // The nearest of the segments within `farthest` whose surface faces the same way, in single precision; of equal ones the
  // first. With a good guess, a segment or kNone, it is found sooner. O(1) for segments not much longer than the reach.
  [[nodiscard]] NearestSegment nearest(const Place& place, double farthest, Index guess = kNone) const;

 private:
  static constexpr int kLanes = 4;
  using Four = Eigen::Array4f;

  // Four segments that pass through cells of one slot; lanes that hold none lie far off.
  struct Pack {
    std::array<Four, 3> from, along;
    Four inverse_squared_length;
    std::array<Index, kLanes> id;

    Pack();
    [[nodiscard, gnu::always_inline]] Four squared_distance(const std::array<float, 3>& place) const {
      const Four x = place[0] - from[0], y = place[1] - from[1], z = place[2] - from[2];
      const Four part = ((x * along[0] + y * along[1] + z * along[2]) * inverse_squared_length).max(0.0F).min(1.0F);
      const Four dx = x - part * along[0], dy = y - part * along[1], dz = z - part * along[2];
      return dx * dx + dy * dy + dz * dz;
    }
  };
  void look_around(const Place& place, NearestSegment& best) const;

  std::span<const Segment> segments_;
  double reach_;
  CellSlots cells_;
  std::vector<Index> first_;  // pack of each slot
  std::vector<Pack> packs_;
};

}  // namespace curvesup::toolpath
