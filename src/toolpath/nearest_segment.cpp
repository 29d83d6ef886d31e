#include "toolpath/nearest_segment.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace curvesup::toolpath {
namespace {

constexpr double kSameSide = 0.5;  // cosine between the normals of a place and of a track that may fill it
constexpr int kLanes = 4;
using Four = Eigen::Array4f;

// Four places of one slot of the grid, packed; lanes that hold no place lie far off.
struct Pack {
  std::array<Four, 3> position;
  Four least;  // squared distance of the nearest segment so far
  std::array<Index, kLanes> id, nearest;

  Pack() : least(Four::Constant(std::numeric_limits<float>::lowest())) {
    position.fill(Four::Zero());
    id.fill(kNone);
    nearest.fill(kNone);
  }
};

// A segment as the search reads it.
struct Line {
  std::array<float, 3> from, along;
  float inverse_squared_length;

  explicit Line(const Segment& s) : inverse_squared_length(static_cast<float>(s.inverse_squared_length)) {
    for (int i = 0; i < 3; ++i) {
      from[i] = static_cast<float>(s.from[i]);
      along[i] = static_cast<float>(s.along[i]);
    }
  }
  [[nodiscard]] Four squared_distance(const Pack& pack) const {
    const Four x = pack.position[0] - from[0], y = pack.position[1] - from[1], z = pack.position[2] - from[2];
    const Four part = ((x * along[0] + y * along[1] + z * along[2]) * inverse_squared_length).max(0.0F).min(1.0F);
    const Four dx = x - part * along[0], dy = y - part * along[1], dz = z - part * along[2];
    return dx * dx + dy * dy + dz * dz;
  }
};

std::size_t slots_for(std::size_t places) { return std::bit_ceil(std::max<std::size_t>(places / kLanes, 64)); }

class PlaceGrid {
 public:
  PlaceGrid(std::span<const Place> places, double reach)
      : places_(places), reach_(reach), cells_(3.0 * reach, slots_for(places.size())), first_(slots_for(places.size()) + 1, 0) {
    std::vector<Index> slot(places.size());
    for (std::size_t p = 0; p < places.size(); ++p) ++first_[(slot[p] = static_cast<Index>(cells_.slot_of(places[p].position))) + 1];
    std::vector<Index> fill(first_.size(), 0);  // places
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      first_[i + 1] = first_[i] + (first_[i + 1] + kLanes - 1) / kLanes;
      fill[i] = kLanes * first_[i];
    }
    packs_.resize(first_.back());
    const float limit = static_cast<float>(reach * reach);
    for (std::size_t p = 0; p < places.size(); ++p) {
      const Index at = fill[slot[p]]++;
      Pack& pack = packs_[at / kLanes];
      const int lane = at % kLanes;
      for (int i = 0; i < 3; ++i) pack.position[i][lane] = static_cast<float>(places[p].position[i]);
      pack.least[lane] = limit;
      pack.id[lane] = static_cast<Index>(p);
    }
  }

  void offer(const Segment& segment, Index id) {
    const Line line(segment);
    const Vec3 end = segment.from + segment.along, margin = Vec3::Constant(reach_);
    cells_.for_box(segment.from.cwiseMin(end) - margin, segment.from.cwiseMax(end) + margin, [&](std::size_t slot) {
      for (Index k = first_[slot]; k < first_[slot + 1]; ++k) {
        Pack& pack = packs_[k];
        const Four squared = line.squared_distance(pack);
        if (!(squared < pack.least).any()) continue;
        for (int lane = 0; lane < kLanes; ++lane) {
          if (!(squared[lane] < pack.least[lane]) || segment.normal.dot(places_[pack.id[lane]].normal) < kSameSide) continue;
          pack.least[lane] = squared[lane];
          pack.nearest[lane] = id;
        }
      }
    });
  }

  [[nodiscard]] std::vector<Index> nearest() const {
    std::vector<Index> result(places_.size(), kNone);
    for (const Pack& pack : packs_) {
      for (int lane = 0; lane < kLanes; ++lane) {
        if (pack.id[lane] != kNone) result[pack.id[lane]] = pack.nearest[lane];
      }
    }
    return result;
  }

 private:
  std::span<const Place> places_;
  double reach_;
  CellSlots cells_;
  std::vector<Index> first_;  // pack of each slot
  std::vector<Pack> packs_;
};

}  // namespace

std::vector<Index> nearest_segments(std::span<const Place> places, std::span<const Segment> segments, double reach) {
  PlaceGrid grid(places, reach);
  for (std::size_t s = 0; s < segments.size(); ++s) grid.offer(segments[s], static_cast<Index>(s));
  return grid.nearest();
}

}  // namespace curvesup::toolpath
