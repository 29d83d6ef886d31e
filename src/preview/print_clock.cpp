#include "print_clock.h"

#include <algorithm>

namespace curvesup {

namespace {

constexpr double kTravelSpeed = 50.0, kJumpOverhead = 1.5;  // mm/s, s: the toolpath planner's defaults

double segment_length(const Toolpaths& toolpaths, Index point) {
  return (toolpaths.points[point].position - toolpaths.points[point - 1].position).norm();
}

void clock_by_feed(const Toolpaths& toolpaths, PrintClock& clock) {
  double now = 0.0;
  Vec3 at = Vec3::Zero();
  bool started = false;
  for (const Path& path : toolpaths.paths) {
    if (path.point_count == 0) continue;
    const Index end = path.first_point + path.point_count;
    const Vec3& start = toolpaths.points[path.first_point].position;
    if (started && (start - at).norm() > 1e-9) {
      const double begin = now;
      now += (start - at).norm() / kTravelSpeed + kJumpOverhead;
      clock.travels.push_back({begin, now, {at, start}});
    }
    clock.point_s[path.first_point] = static_cast<float>(now);
    for (Index p = path.first_point + 1; p < end; ++p) {
      now += segment_length(toolpaths, p) / std::max(toolpaths.points[p].feed_mm_s, 0.1);
      clock.point_s[p] = static_cast<float>(now);
    }
    at = toolpaths.points[end - 1].position;
    started = true;
  }
  clock.end_s = now;
}

// A toolpath point whose time and axis are known.
struct Anchor {
  Index point;
  double time;
  Vec3 axis;
};

// Fills the points between two anchors, evenly by length.
void fill_between(const Toolpaths& toolpaths, const Anchor& a, const Anchor& b, PrintClock& clock) {
  double total = 0.0;
  for (Index p = a.point + 1; p <= b.point; ++p) total += segment_length(toolpaths, p);
  double walked = 0.0;
  for (Index p = a.point; p <= b.point; ++p) {
    if (p > a.point) walked += segment_length(toolpaths, p);
    const double fraction = total > 0.0 ? walked / total : 0.0;
    clock.point_s[p] = static_cast<float>(a.time + fraction * (b.time - a.time));
    clock.axis[p] = (a.axis + fraction * (b.axis - a.axis)).normalized().cast<float>();
  }
}

class MotionClock {
 public:
  MotionClock(const Toolpaths& toolpaths, const Motion& motion, PrintClock& clock)
      : toolpaths_(toolpaths), motion_(motion), clock_(clock),
        to_part_(Eigen::AngleAxisd(-motion.part_rotation_rad, Vec3::UnitZ()).toRotationMatrix()) {}

  void run() {
    std::vector<Anchor> anchors;
    Index path = kNone;
    for (const PathMotion& chain : motion_.paths) {
      if (chain.path != path) finish_path(path, anchors);
      path = chain.path;
      travel(chain.first_travel, chain.travel_count);
      print(chain, anchors);
    }
    finish_path(path, anchors);
    travel(motion_.final_travel, static_cast<Index>(motion_.travels.size()) - motion_.final_travel);
    clock_.end_s = now_;
  }

 private:
  [[nodiscard]] Vec3 in_part(const Vec3& tip) const { return to_part_ * (tip - motion_.part_offset_mm); }

  void travel(Index first, Index count) {
    if (count == 0) return;
    PrintClock::Travel travel{now_, now_, {}};
    if (started_) travel.tips.push_back(at_);
    for (Index t = first; t < first + count; ++t) {
      now_ += motion_.travels[t].duration_s;
      at_ = in_part(motion_.travels[t].tip_mm);
      travel.tips.push_back(at_);
    }
    travel.end_s = now_;
    started_ = true;
    if (travel.tips.size() > 1) clock_.travels.push_back(std::move(travel));
  }

  void print(const PathMotion& chain, std::vector<Anchor>& anchors) {
    for (Index w = chain.first_waypoint; w < chain.first_waypoint + chain.waypoint_count; ++w) {
      const Waypoint& waypoint = motion_.waypoints[w];
      now_ += waypoint.duration_s;
      at_ = in_part(waypoint.tip_mm);
      if (waypoint.point == kNone || (!anchors.empty() && waypoint.point <= anchors.back().point)) continue;
      anchors.push_back({waypoint.point, now_, to_part_ * waypoint.axis});
    }
    started_ = started_ || chain.waypoint_count > 0;
  }

  void finish_path(Index path, std::vector<Anchor>& anchors) {
    if (path == kNone) return;
    const Path& source = toolpaths_.paths[path];
    const Index last = source.first_point + source.point_count - 1;
    if (anchors.empty()) anchors.push_back({source.first_point, now_, Vec3::UnitZ()});
    // Ends of the path that are no waypoints take the values of the nearest one.
    if (anchors.front().point > source.first_point) {
      anchors.insert(anchors.begin(), {source.first_point, anchors.front().time, anchors.front().axis});
    }
    if (anchors.back().point < last) anchors.push_back({last, now_, anchors.back().axis});
    for (std::size_t i = 1; i < anchors.size(); ++i) fill_between(toolpaths_, anchors[i - 1], anchors[i], clock_);
    anchors.clear();
  }

  const Toolpaths& toolpaths_;
  const Motion& motion_;
  PrintClock& clock_;
  Mat3 to_part_;
  double now_ = 0.0;
  Vec3 at_ = Vec3::Zero();
  bool started_ = false;
};

}  // namespace

PrintClock run_clock(const Toolpaths& toolpaths, const Motion* motion) {
  PrintClock clock;
  clock.point_s.assign(toolpaths.points.size(), 0.0f);
  clock.axis.reserve(toolpaths.points.size());
  for (const PathPoint& point : toolpaths.points) clock.axis.push_back(point.normal.cast<float>());
  if (motion != nullptr && !motion->paths.empty()) {
    MotionClock(toolpaths, *motion, clock).run();
  } else {
    clock_by_feed(toolpaths, clock);
  }
  return clock;
}

}  // namespace curvesup
