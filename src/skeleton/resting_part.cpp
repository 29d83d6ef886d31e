#include "skeleton/resting_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace curvesup {
namespace {

constexpr int kSamples = 48;
constexpr double kMargin = 1.4;  // of the disc of samples around a section that the trunk cuts aslant

// Points of the unit disc, all standing for the same area.
const std::array<std::pair<double, double>, kSamples>& disc() {
  static const auto points = [] {
    std::array<std::pair<double, double>, kSamples> p;
    for (int i = 0; i < kSamples; ++i) {
      const double r = std::sqrt((i + 0.5) / kSamples), angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
      p[i] = {r * std::cos(angle), r * std::sin(angle)};
    }
    return p;
  }();
  return points;
}

double radius_at(const StandingTrunk& trunk, double along) {
  if (along < -trunk.foot.depth_mm) return 0.0;
  return std::min(trunk.radius_mm, trunk.foot.radius_mm + trunk.foot.slope * along);
}

bool inside(const StandingTrunk& trunk, const Vec3& p) {
  const double along = (p - trunk.end).dot(trunk.axis), radius = radius_at(trunk, along);
  return radius > 0.0 && (p - trunk.end).squaredNorm() - along * along <= radius * radius;
}

WalkResult walk_to(const TetWalk& walk, const Vec3& from, Index tet, const Vec3& to) {
  const Vec3 way = to - from;
  const double length = way.norm();
  return walk.walk(from, tet, way / length, {.length = length, .stop_at_platform = false});
}

struct Sample {
  Vec3 position;
  Index tet;
  bool rests;
  int piece;  // lowest sample id of those it hangs together with
};

// Samples side by side with nothing of the model between them belong to one piece.
void join_pieces(const TetWalk& walk, std::vector<Sample>& samples, double within) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const int a = samples[i].piece, b = samples[j].piece;
      if (a == b || (samples[i].position - samples[j].position).squaredNorm() > within * within) continue;
      if (walk_to(walk, samples[i].position, samples[i].tet, samples[j].position).stop != WalkStop::length) continue;
      for (Sample& s : samples) {
        if (s.piece == a || s.piece == b) s.piece = std::min(a, b);
      }
    }
  }
}

}  // namespace

double resting_part(const TetWalk& walk, int layer_count, const StandingTrunk& trunk, double min_piece_area_mm2) {
  const Vec3 up = -walk.down(trunk.tet);
  const Vec3 side = up.unitOrthogonal(), other = up.cross(side);
  const double layer = 1.0 / layer_count, value = walk.value_at(trunk.tet, trunk.end);
  const double rise = walk.slope(trunk.tet, trunk.axis);  // of G along the axis
  if (rise <= 0.0) return 0.0;
  const double full = (trunk.radius_mm - trunk.foot.radius_mm) / trunk.foot.slope;
  const double highest = std::max({full, 2.0 * trunk.foot.radius_mm, 2.0 * layer / rise});
  const WalkResult above = walk_to(walk, trunk.end, trunk.tet, trunk.end + (highest + layer / rise) * trunk.axis);
  double least = 1.0;
  bool printed_below = false;
  std::vector<Sample> samples;
  for (double k = std::ceil((value - trunk.foot.depth_mm * rise) * layer_count - 0.5);; ++k) {
    const double along = ((k + 0.5) * layer - value) / rise;
    if (along > highest) break;
    const double radius = kMargin * radius_at(trunk, along);
    if (radius <= 0.0) continue;
    const Vec3 centre = trunk.end + along * trunk.axis;
    samples.clear();
    for (const auto& [x, y] : disc()) {
      const Vec3 p = centre + radius * (x * side + y * other);
      if (!inside(trunk, p)) continue;
      WalkResult there = walk_to(walk, trunk.end, trunk.tet, p);
      if (there.stop != WalkStop::length) there = walk_to(walk, above.position, above.tet, p);
      if (there.stop != WalkStop::length) continue;  // in the model
      const WalkResult below =
          walk.walk(p, there.tet, walk.down(there.tet), {.value = walk.value_at(there.tet, p) - layer});
      const bool rests = below.stop == WalkStop::model || below.stop == WalkStop::platform ||
                         (printed_below && inside(trunk, below.position));
      samples.push_back({p, there.tet, rests, static_cast<int>(samples.size())});
    }
    const double area = std::numbers::pi * radius * radius / kSamples;  // of one sample
    join_pieces(walk, samples, 2.0 * std::sqrt(area));
    printed_below = false;
    for (int piece = 0; piece < static_cast<int>(samples.size()); ++piece) {
      int present = 0, resting = 0;
      for (const Sample& s : samples) {
        present += s.piece == piece;
        resting += s.piece == piece && s.rests;
      }
      if (present == 0 || present * area < min_piece_area_mm2) continue;
      printed_below = true;
      least = std::min(least, static_cast<double>(resting) / present);
    }
  }
  return least;
}

}  // namespace curvesup
