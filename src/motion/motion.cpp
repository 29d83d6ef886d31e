#include "curvesup/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "core/memory.h"
#include "motion/choose_axes.h"
#include "motion/choose_postures.h"
#include "motion/motion_checks.h"
#include "motion/print_order.h"
#include "motion/travel.h"

namespace curvesup {
namespace {

constexpr std::size_t kWaypointsBetweenReleases = 250000;

// All that one plan_motion() call works on.
class MotionPlanner {
 public:
  MotionPlanner(const Toolpaths& toolpaths, const Cell& cell, const MotionOptions& options,
                const PartPlacement& placement, const RunContext& run)
      : cell_(cell), options_(options), run_(run), order_(toolpaths, placement, run), look_(cell, order_.deposit()),
        postures_(cell, order_.deposit(), options, run), unreachable_(order_.path_count(), 0) {
    result_.motion.part_offset_mm = placement.offset_mm;
    result_.motion.part_rotation_rad = placement.rotation_rad;
    result_.motion.waypoints.reserve(static_cast<std::size_t>(order_.point_count()) + order_.path_count());
    result_.report.source_points = toolpaths.points.size();
  }

  MotionResult plan() {
    ReleasedInSteps memory(kWaypointsBetweenReleases);
    for (std::size_t begin = 0, end; begin < order_.path_count(); begin = end) {
      end = order_.run_end(begin);
      plan_run(begin, end);
      // What the runs leave in the heaps of the threads would come on top of the waypoints.
      memory.at(result_.motion.waypoints.size());
      run_.progress(0.9 * static_cast<double>(end) / static_cast<double>(order_.path_count()));
    }
    if (result_.report.unreachable.empty()) plan_travels();
    result_.path_order = order_.changed_order();
    finish_report();
    return std::move(result_);
  }

 private:
  void plan_run(std::size_t begin, std::size_t end) {
    run_.check_stop();
    PlacedPaths placed = order_.place(begin, end);
    const std::vector<std::vector<AxisFault>> faults = choose_axes(cell_, options_, order_, placed, run_);
    list_raised(placed);
    for (std::size_t p = 0; p < placed.paths.size(); ++p) {
      for (const AxisFault& fault : faults[p]) {
        if (fault.reach) list_unreachable(placed, p, fault.point, fault.arm);
      }
    }
    const std::vector<PlannedPath> planned = postures_.choose(placed);
    for (std::size_t p = 0; p < planned.size(); ++p) {
      const ArmPath& arm = planned[p].arm;
      if (arm.unreachable != kNone) list_unreachable(placed, p, arm.unreachable, arm.fault);
    }
    add_chains(placed, planned);
  }

  void list_raised(const PlacedPaths& placed) {
    for (std::size_t i = 0; i < placed.raises.size(); ++i) {
      if (placed.raises[i] == 0.0) continue;
      result_.raised.push_back({placed.sources[i], placed.raises[i]});
      result_.report.max_raise_mm = std::max(result_.report.max_raise_mm, placed.raises[i]);
    }
  }

  // Counts the waypoint, and lists the first one of each path.
  void list_unreachable(const PlacedPaths& placed, std::size_t p, Index point, ArmFault fault) {
    MotionReport& report = result_.report;
    const Index path = placed.first_path + static_cast<Index>(p);
    ++report.unreachable_waypoints;
    if (std::exchange(unreachable_[path], 1)) return;
    const std::size_t row = placed.row(point);
    report.unreachable.push_back({path, placed.source_of(point), placed.tips[row], placed.axes[row], describe(fault)});
  }

  std::string what_is_wrong(const TravelPlan& travel) const {
    if (travel.body == nullptr) return "travel: the arm reaches no pose above an end of the way, so it would move straight through";
    return "travel: " + name_of_contact(travel.body, travel.contact);
  }

  std::string name_of_contact(const char* body, const Contact& contact) const {
    if (contact.point == kNone) return std::string(body) + " touches the platform";
    const Index number = order_.path_of(contact.point);
    const Path& path = order_.path(number);
    const char* material = path.material == Material::model ? "model" : "support";
    return format("%s touches %s of path %d, layer %d", body, material, number, path.layer);
  }

  // Chains of a run, with their figures; chains do not need each other.
  void add_chains(const PlacedPaths& placed, const std::vector<PlannedPath>& planned) {
    Motion& motion = result_.motion;
    struct Source {
      std::size_t path, section;
      Index at;  // the last point of the path that the nozzle has passed when the section begins
    };
    std::vector<Source> sources;
    const std::size_t first_chain = motion.paths.size();
    std::size_t waypoints = motion.waypoints.size();
    for (std::size_t p = 0; p < planned.size(); ++p) {
      const std::vector<ArmSection>& sections = planned[p].arm.sections;
      Index at = placed.paths[p].first_point;
      for (std::size_t s = 0; s < sections.size(); ++s) {
        const Path& path = placed.paths[p];
        PathMotion chain;
        chain.path = placed.first_path + static_cast<Index>(p);
        chain.section = static_cast<int>(s);
        chain.sections = static_cast<int>(sections.size());
        chain.material = path.material;
        chain.layer = path.layer;
        chain.group = path.group;
        chain.first_waypoint = static_cast<Index>(waypoints);
        chain.waypoint_count = static_cast<Index>(sections[s].points.size());
        chain.material_change_before = motion.paths.empty() || motion.paths.back().material != path.material;
        waypoints += sections[s].points.size();
        motion.paths.push_back(chain);
        sources.push_back({p, s, at});
        at = sections[s].last_point(at);
      }
    }
    motion.waypoints.resize(waypoints);
    std::vector<ChainFigures> figures(sources.size());
    parallel_for(sources.size(), 8, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i) {
        PathMotion& chain = motion.paths[first_chain + i];
        const ArmSection& section = planned[sources[i].path].arm.sections[sources[i].section];
        std::vector<Waypoint> chain_points = make_waypoints(cell_, section, chain, figures[i]);
        check_bodies(placed, section, sources[i].at, planned[sources[i].path].links_free, figures[i]);
        for (std::size_t w = 0; w < chain_points.size(); ++w) {
          Index& point = chain_points[w].point;
          if (point != kNone) point = placed.sources[placed.row(point)];
          motion.waypoints.set(static_cast<std::size_t>(chain.first_waypoint) + w, chain_points[w]);
        }
        measure_chain(cell_, motion, chain, figures[i]);
      }
    });
    for (std::size_t i = 0; i < sources.size(); ++i) {
      const ArmSection& section = planned[sources[i].path].arm.sections[sources[i].section];
      ends_.push_back({section.points.front().yaw, section.points.back().yaw, section.branch});
      add_figures(placed, section, motion.paths[first_chain + i], figures[i]);
    }
    for (std::size_t p = 0; p < planned.size(); ++p) add_volume_error(placed, p, first_chain);
  }

  // Head and links at every waypoint against platform and what is printed before it.
  void check_bodies(const PlacedPaths& placed, const ArmSection& section, Index at, bool links_free,
                    ChainFigures& figures) const {
    const std::vector<char> heads_touch = touching_heads(placed, section, at);
    for (std::size_t w = 0; w < section.points.size(); ++w) {
      const ArmPoint& point = section.points[w];
      if (point.draft.point != kNone) at = point.draft.point;
      Contact contact;
      const char* body = nullptr;
      if (heads_touch[w] && !look_.is_free(placed, point.draft.tip, point.draft.axis, at, &contact)) body = "head";
      if (!body && !links_free) {
        body = touching_link(cell_, order_.deposit(), point.joints, at, 0.0, &contact);
      }
      if (!body) continue;
      if (figures.colliding++ > 0) continue;
      figures.first_body = body;
      figures.first_contact = contact;
      figures.first_colliding = w;
    }
  }

  // Marks the waypoints of a section at which the head touches something.
  std::vector<char> touching_heads(const PlacedPaths& placed, const ArmSection& section, Index at) const {
    std::vector<Deposit::HeadPose> poses;
    std::vector<std::size_t> open;
    std::vector<char> marks(section.points.size(), 0);
    for (std::size_t w = 0; w < marks.size(); ++w) {
      const DraftPoint& draft = section.points[w].draft;
      if (draft.point != kNone) at = draft.point;
      if (placed.knows_free(draft)) continue;
      marks[w] = !cell_.head_above_table(draft.tip, draft.axis);
      open.push_back(w);
      poses.push_back(HeadLook::pose(placed, draft.tip, draft.axis, at));
    }
    std::vector<char> touches(poses.size());
    order_.deposit().touches_head(cell_.head(), poses, 0.0, touches);
    for (std::size_t i = 0; i < open.size(); ++i) marks[open[i]] = marks[open[i]] || touches[i];
    return marks;
  }

  void add_figures(const PlacedPaths& placed, const ArmSection& section, const PathMotion& chain, const ChainFigures& figures) {
    MotionReport& report = result_.report;
    report.print_s += chain.duration_s;
    report.max_tilt_deg = std::max(report.max_tilt_deg, figures.max_tilt_deg);
    report.rotation_limited += figures.rotation_limited;
    report.stops += figures.stops;
    report.max_joint_speed_ratio = std::max(report.max_joint_speed_ratio, figures.max_joint_speed_ratio);
    report.max_joint_step_rad = std::max(report.max_joint_step_rad, figures.max_joint_step_rad);
    report.colliding_waypoints += figures.colliding;
    figures_.worst.add(figures);
    deviations_.insert(deviations_.end(), figures.deviations_deg.begin(), figures.deviations_deg.end());
    if (figures.colliding == 0 || (!report.collisions.empty() && report.collisions.back().path == chain.path)) return;
    const DraftPoint& draft = section.points[figures.first_colliding].draft;
    report.collisions.push_back({chain.path, placed.source_of(draft.point), draft.tip, figures.first_contact.position,
                                 figures.first_contact.depth_mm, name_of_contact(figures.first_body, figures.first_contact)});
  }

  // Its waypoints' volume against its points'.
  void add_volume_error(const PlacedPaths& placed, std::size_t p, std::size_t first_chain) {
    const Index path = placed.first_path + static_cast<Index>(p);
    const auto& chains = result_.motion.paths;
    const auto first = std::lower_bound(chains.begin() + static_cast<std::ptrdiff_t>(first_chain), chains.end(), path,
                                        [](const PathMotion& chain, Index number) { return chain.path < number; });
    double laid = 0.0, wanted = 0.0;
    for (auto chain = first; chain != chains.end() && chain->path == path; ++chain) laid += chain->volume_mm3;
    if (first == chains.end() || first->path != path) return;
    for (const PathPoint& point : placed.of(placed.points, placed.paths[p])) wanted += point.volume_mm3;
    figures_.volume = std::max(figures_.volume, std::abs(laid - wanted) / std::max(1e-12, wanted));
  }

  TravelEnd end_of(const Waypoint& waypoint, double yaw, int branch, Index layer) const {
    TravelEnd end;
    end.tip = waypoint.tip_mm;
    end.axis = waypoint.axis;
    end.yaw = yaw;
    end.branch = branch;
    end.joints = waypoint.joints;
    end.pose = waypoint.pose;
    end.layer = layer;
    return end;
  }

  TravelEnd station(const Joints& degrees) const {
    TravelEnd end;
    end.station = true;
    end.joints = radians(degrees);
    cell_.tip_of(end.joints, end.tip, end.axis);
    const Frame frame = forward_kinematics(cell_.machine().arm, end.joints) * to_frame(cell_.machine().tool.tcp);
    end.pose = to_pose(frame);
    return end;
  }

  void plan_travels() {
    Motion& motion = result_.motion;
    const std::size_t count = motion.paths.size();
    const TravelEnd home = station(cell_.machine().stations.home_deg),
                    purge = station(cell_.machine().stations.purge_deg);
    const auto chain_end = [&](std::size_t c, bool last) {
      const PathMotion& chain = motion.paths[c];
      const Waypoint waypoint = motion.waypoints[chain.first_waypoint + (last ? chain.waypoint_count - 1 : 0)];
      return end_of(waypoint, last ? ends_[c].last_yaw : ends_[c].first_yaw, ends_[c].branch, chain.layer);
    };
    std::vector<TravelPlan> plans(count + 1);
    parallel_for(count + 1, 32, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t c = begin; c < end; ++c) {
        const TravelEnd from = c > 0 ? chain_end(c - 1, true) : home, to = c < count ? chain_end(c, false) : home;
        const bool change = c < count && motion.paths[c].material_change_before;
        const Index before = c > 0 ? order_.end_point(motion.paths[c - 1].path) : 0;
        plans[c] = plan_travel(cell_, order_.deposit(), from, to, change ? &purge : nullptr, before);
      }
    });
    for (std::size_t c = 0; c <= count; ++c) {
      const Index first = static_cast<Index>(motion.travels.size());
      Vec3 at =
          c > 0 ? motion.waypoints[motion.paths[c - 1].first_waypoint + motion.paths[c - 1].waypoint_count - 1].tip_mm
                : home.tip;
      for (const Travel& move : plans[c].moves) {
        result_.report.travel_mm += (move.tip_mm - at).norm();
        result_.report.travel_s += move.duration_s;
        at = move.tip_mm;
        motion.travels.push_back(move);
      }
      if (c < count) {
        motion.paths[c].first_travel = first;
        motion.paths[c].travel_count = static_cast<Index>(plans[c].moves.size());
      } else {
        motion.final_travel = first;
      }
      if (!plans[c].clear) {
        const std::size_t chain = std::min(c, count - 1);
        const Waypoint waypoint = motion.waypoints[motion.paths[chain].first_waypoint];
        result_.report.collisions.push_back({motion.paths[chain].path, waypoint.point, waypoint.tip_mm,
                                             plans[c].contact.position, plans[c].contact.depth_mm,
                                             what_is_wrong(plans[c])});
        ++result_.report.colliding_travels;
      }
    }
  }

  void finish_report() {
    const Motion& motion = result_.motion;
    MotionReport& report = result_.report;
    report.waypoints = motion.waypoints.size();
    report.chains = motion.paths.size();
    report.min_singularity_metric = motion.waypoints.empty() ? 0.0 : figures_.worst.min_singularity_metric;
    report_deviations();
    report.checks = motion_checks(motion, report, figures_, cell_.machine());
  }

  void report_deviations() {
    if (deviations_.empty()) return;
    std::sort(deviations_.begin(), deviations_.end());
    const auto at = [&](double share) {
      return deviations_[static_cast<std::size_t>(share * static_cast<double>(deviations_.size() - 1))];
    };
    result_.report.tilt_deviation_median_deg = at(0.5);
    result_.report.tilt_deviation_p95_deg = at(0.95);
    result_.report.tilt_deviation_max_deg = deviations_.back();
  }

  struct ChainEnds {
    double first_yaw, last_yaw;
    int branch;
  };

  const Cell& cell_;
  const MotionOptions& options_;
  const RunContext& run_;
  PrintOrder order_;
  HeadLook look_;
  PostureChooser postures_;
  std::vector<char> unreachable_;  // by path
  std::vector<ChainEnds> ends_;
  std::vector<float> deviations_;
  MotionFigures figures_;
  MotionResult result_;
};

}  // namespace

MotionResult plan_motion(const Toolpaths& toolpaths, const Machine& machine, const MotionOptions& options,
                         const RunContext& run) {
  const Cell cell(machine);
  const PartPlacement placement = place_part(toolpaths, cell, options, run);
  return MotionPlanner(toolpaths, cell, options, placement, run).plan();
}

void raise_points(Toolpaths& toolpaths, std::span<const RaisedPoint> raised) {
  for (const RaisedPoint& point : raised) toolpaths.points[point.point].tip_offset_mm += point.raise_mm;
}

void reorder_paths(Toolpaths& toolpaths, std::span<const Index> order) {
  std::size_t begin = 0;
  while (begin < order.size() && order[begin] == static_cast<Index>(begin)) ++begin;
  std::size_t end = order.size();
  while (end > begin && order[end - 1] == static_cast<Index>(end - 1)) --end;
  if (begin == end) return;
  const auto first = toolpaths.paths.begin() + static_cast<std::ptrdiff_t>(begin);
  const auto last = toolpaths.paths.begin() + static_cast<std::ptrdiff_t>(end);
  const std::vector<Path> paths(first, last);
  Index point = paths.front().first_point;
  const std::vector<PathPoint> points(toolpaths.points.begin() + point,
                                      toolpaths.points.begin() + paths.back().first_point + paths.back().point_count);
  const Index offset = point;
  for (std::size_t i = begin; i < end; ++i) {
    Path path = paths[static_cast<std::size_t>(order[i]) - begin];
    const auto from = points.begin() + (path.first_point - offset);
    std::copy(from, from + path.point_count, toolpaths.points.begin() + point);
    path.first_point = point;
    point += path.point_count;
    toolpaths.paths[i] = path;
  }
}

}  // namespace curvesup
