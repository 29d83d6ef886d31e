#include "check/polyline_match.h"

#include <algorithm>

namespace curvesup::emitted {

namespace {

constexpr double kSamePlace_mm = 5e-4;
constexpr std::size_t kMostPlaces = 32;  // of one vertex that are followed up

struct Foot {
  double share = 0.0, distance = 0.0;
};

Foot foot_on(const Vec3& a, const Vec3& b, const Vec3& point) {
  const Vec3 along = b - a;
  const double squared = along.squaredNorm();
  const double share = squared > 0.0 ? std::clamp((point - a).dot(along) / squared, 0.0, 1.0) : 0.0;
  return {share, (a + share * along - point).norm()};
}

class Walk {
 public:
  Walk(std::span<const Vec3> source, std::span<const Vec3> emitted, const PolylineLimits& limits)
      : source_(source), emitted_(emitted), limits_(limits) {}

  // Always the nearest place within reach, but the first one that fits exactly.
  [[nodiscard]] std::vector<PolylinePlace> nearest_places() const {
    std::vector<PolylinePlace> places = {start()};
    places.reserve(emitted_.size());
    for (std::size_t i = 1; i < emitted_.size(); ++i) {
      PolylinePlace best;
      best.distance = 1e300;
      visit_places(places.back(), i, [&](const PolylinePlace& place) {
        if (place.distance < best.distance - 1e-9) best = place;
        return best.distance >= kSamePlace_mm;
      });
      places.push_back(best);
    }
    return places;
  }

  // The walk whose worst excess is least, by dynamic programming over all places within reach.
  [[nodiscard]] std::vector<PolylinePlace> best_places() const {
    std::vector<std::vector<Step>> steps = {{{start(), 0.0, 0}}};
    for (std::size_t i = 1; i < emitted_.size(); ++i) {
      std::vector<Step> next;
      for (std::size_t from = 0; from < steps.back().size(); ++from) {
        const Step& before = steps.back()[from];
        visit_places(before.place, i, [&](const PolylinePlace& place) {
          add(next, {place, std::max(before.worst, excess(place)), from});
          return true;
        });
      }
      keep_best(next);
      steps.push_back(std::move(next));
    }
    return trace(steps);
  }

  [[nodiscard]] double worst_excess(const std::vector<PolylinePlace>& places) const {
    double worst = end_excess(places.back());
    for (const PolylinePlace& place : places) worst = std::max(worst, excess(place));
    return worst;
  }

 private:
  struct Step {
    PolylinePlace place;
    double worst = 0.0;
    std::size_t from = 0;
  };

  [[nodiscard]] PolylinePlace start() const { return {1, 0.0, (emitted_[0] - source_[0]).norm(), 0.0}; }

  // In units of the limits, 0 within them.
  [[nodiscard]] double excess(const PolylinePlace& place) const {
    return std::max({0.0, place.distance / limits_.vertex - 1.0, place.aside / limits_.aside - 1.0});
  }

  // Of what lies behind the last place, which no emitted segment passes.
  [[nodiscard]] double end_excess(const PolylinePlace& last) const {
    double worst = 0.0;
    for (std::size_t p = last.segment; p < source_.size(); ++p) {
      worst = std::max(worst, (source_[p] - emitted_.back()).norm() / limits_.aside - 1.0);
    }
    return worst;
  }

  // The nearest place of emitted[i] on each segment from `before` on, as long as the source goes not much farther than
  // the emitted segment is long; a tangle of points that the segment passes within the limit does not count. `visit`
  // returns false to end.
  template <class Visit>
  void visit_places(const PolylinePlace& before, std::size_t i, const Visit& visit) const {
    const Vec3 &last = emitted_[i - 1], &tip = emitted_[i];
    const double reach = 1.5 * (tip - last).norm() + 0.3;
    double travelled = -before.share * (source_[before.segment] - source_[before.segment - 1]).norm(), aside = 0.0;
    for (std::size_t s = before.segment; s < source_.size() && travelled <= reach; ++s) {
      const Vec3 &a = source_[s - 1], &b = source_[s];
      const double from = s == before.segment ? before.share : 0.0;
      const Foot foot = foot_on(from > 0.0 ? Vec3(a + from * (b - a)) : a, b, tip);
      if (!visit(PolylinePlace{s, from + (1.0 - from) * foot.share, foot.distance, aside})) return;
      const double off = foot_on(last, tip, b).distance;
      aside = std::max(aside, off);
      if (off > limits_.aside) travelled += (b - a).norm();
    }
  }

  // Keeps one step a segment: the one with the least excess, of equals the earliest place, which leaves most ways on.
  static void add(std::vector<Step>& steps, const Step& step) {
    for (Step& other : steps) {
      if (other.place.segment != step.place.segment) continue;
      const bool better = step.worst < other.worst || (step.worst == other.worst && step.place.share < other.place.share);
      if (better) other = step;
      return;
    }
    steps.push_back(step);
  }

  static void keep_best(std::vector<Step>& steps) {
    if (steps.size() <= kMostPlaces) return;
    std::stable_sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.worst < b.worst; });
    steps.resize(kMostPlaces);
  }

  [[nodiscard]] std::vector<PolylinePlace> trace(const std::vector<std::vector<Step>>& steps) const {
    std::size_t best = 0;
    double least = 1e300;
    for (std::size_t s = 0; s < steps.back().size(); ++s) {
      const double worst = std::max(steps.back()[s].worst, end_excess(steps.back()[s].place));
      if (worst < least) {
        least = worst;
        best = s;
      }
    }
    std::vector<PolylinePlace> places(steps.size());
    for (std::size_t i = steps.size(); i-- > 0;) {
      places[i] = steps[i][best].place;
      best = steps[i][best].from;
    }
    return places;
  }

  std::span<const Vec3> source_, emitted_;
  const PolylineLimits& limits_;
};

double length_of(std::span<const Vec3> line) {
  double length = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

}  // namespace

std::vector<PolylinePlace> match_polylines(std::span<const Vec3> source, std::span<const Vec3> emitted,
                                           const PolylineLimits& limits) {
  const Walk walk(source, emitted, limits);
  std::vector<PolylinePlace> places = walk.nearest_places();
  const double worst = walk.worst_excess(places);
  // A line much longer than its source fits nowhere.
  if (worst <= 0.0 || length_of(emitted) > 1.5 * length_of(source) + 1.0) return places;
  std::vector<PolylinePlace> best = walk.best_places();
  return walk.worst_excess(best) < worst ? best : places;
}

}  // namespace curvesup::emitted
