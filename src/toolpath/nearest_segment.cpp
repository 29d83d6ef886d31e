#include "toolpath/nearest_segment.h"

#include <bit>
#include <cmath>

namespace curvesup::toolpath {
namespace {

constexpr double kSameSide = 0.5;  // cosine between the normals of a place and of a track that may fill it
constexpr float kRounding = 1e-5F;  // relative, of squared distances
constexpr float kFarOff = 1e15F;

std::size_t slots_for(std::size_t segments) { return std::bit_ceil(std::max<std::size_t>(2 * segments, 64)); }

}  // namespace

SegmentGrid::Pack::Pack() {
  from.fill(Four::Constant(kFarOff));
  along.fill(Four::Zero());
  inverse_squared_length = Four::Zero();
  id.fill(kNone);
}

SegmentGrid::SegmentGrid(std::span<const Segment> segments, double reach)
    : segments_(segments), reach_(reach), cells_(2.0 * reach, slots_for(segments.size())), first_(slots_for(segments.size()) + 1, 0) {
  const auto for_slots = [&](const Segment& s, const auto& use) {
    const Vec3 end = s.from + s.along;
    cells_.for_box(s.from.cwiseMin(end), s.from.cwiseMax(end), use);
  };
  for (const Segment& s : segments) for_slots(s, [&](std::size_t slot) { ++first_[slot + 1]; });
  std::vector<Index> fill(first_.size(), 0);  // lanes
  for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
    first_[i + 1] = first_[i] + (first_[i + 1] + kLanes - 1) / kLanes;
    fill[i] = kLanes * first_[i];
  }
  packs_.resize(first_.back());
  for (std::size_t id = 0; id < segments.size(); ++id) {
    const Segment& s = segments[id];
    for_slots(s, [&](std::size_t slot) {
      const Index at = fill[slot]++;
      Pack& pack = packs_[at / kLanes];
      const int lane = at % kLanes;
      for (int i = 0; i < 3; ++i) {
        pack.from[i][lane] = static_cast<float>(s.from[i]);
        pack.along[i][lane] = static_cast<float>(s.along[i]);
      }
      pack.inverse_squared_length[lane] = static_cast<float>(s.inverse_squared_length);
      pack.id[lane] = static_cast<Index>(id);
    });
  }
}

NearestSegment SegmentGrid::nearest(const Place& place, double farthest, Index guess) const {
  NearestSegment best;
  const auto within = [](double reach) { return static_cast<float>(reach * reach); };
  if (guess != kNone && segments_[guess].normal.dot(place.normal) >= kSameSide) {
    best = {guess, static_cast<float>(segments_[guess].squared_distance(place.position))};
    best.squared += kRounding * best.squared;
  }
  const double close = std::min(reach_, farthest);
  if (best.id == kNone || best.squared > within(close)) best = {kNone, within(close)};
  look_around(place, best);
  for (double reach = close; best.id == kNone && reach < farthest;) {
    reach = std::min(2.0 * reach, farthest);
    best.squared = within(reach);
    look_around(place, best);
  }
  return best;
}

void SegmentGrid::look_around(const Place& place, NearestSegment& best) const {
  std::array<float, 3> position;
  for (int i = 0; i < 3; ++i) position[i] = static_cast<float>(place.position[i]);
  const Vec3 margin = Vec3::Constant(std::sqrt(best.squared));
  cells_.for_box(place.position - margin, place.position + margin, [&](std::size_t slot) {
    for (Index k = first_[slot]; k < first_[slot + 1]; ++k) {
      const Pack& pack = packs_[k];
      const Four squared = pack.squared_distance(position);
      if (!(squared <= best.squared).any()) continue;
      for (int lane = 0; lane < kLanes; ++lane) {
        const Index id = pack.id[lane];
        if (squared[lane] > best.squared || (squared[lane] == best.squared && id >= best.id)) continue;
        if (segments_[id].normal.dot(place.normal) < kSameSide) continue;
        best = {id, squared[lane]};
      }
    }
  });
}

}  // namespace curvesup::toolpath
