#include "curvesup/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "motion/arm_path.h"
#include "motion/placement.h"
#include "motion/travel.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kSampleSpacing_mm = 1.0;   // of deposited beads
constexpr double kLongestSegment_mm = 3.0;  // longer ones are divided before anything is checked at their points
constexpr double kSoftBeads = 3.0;          // bead widths behind the nozzle
constexpr double kReachSpacing_mm = 2.0;    // between points at which the arm's reach is looked at
constexpr int kTiltRounds = 4;
constexpr double kPoseTolerance = 1e-6;  // m and rad, between joints and pose

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// All that one plan_motion() call works on.
class MotionPlanner {
 public:
  MotionPlanner(const Toolpaths& toolpaths, const Cell& cell, const MotionOptions& options, const RunContext& run)
      : toolpaths_(toolpaths), cell_(cell), options_(options), run_(run) {}

  MotionResult plan(const PartPlacement& placement) {
    result_.motion.part_offset_mm = placement.offset_mm;
    result_.motion.part_rotation_rad = placement.rotation_rad;
    place_points(placement);
    choose_axes();
    choose_postures();
    if (result_.report.unreachable.empty()) {
      plan_travels();
      check_bodies();
    }
    finish_report();
    return std::move(result_);
  }

 private:
  std::span<const PathPoint> points_of(const Path& path) const {
    return std::span(points_).subspan(path.first_point, path.point_count);
  }
  std::span<const Vec3> tips_of(const Path& path) const {
    return std::span(tips_).subspan(path.first_point, path.point_count);
  }
  std::span<Vec3> axes_of(const Path& path) { return std::span(axes_).subspan(path.first_point, path.point_count); }

  void place_points(const PartPlacement& placement) {
    const Mat3 turn = Eigen::AngleAxisd(placement.rotation_rad, Vec3::UnitZ()).toRotationMatrix();
    points_.reserve(toolpaths_.points.size());
    tips_.reserve(toolpaths_.points.size());
    sources_.reserve(toolpaths_.points.size());
    for (const Path& source : toolpaths_.paths) {
      Path path = source;
      path.first_point = static_cast<Index>(points_.size());
      for (Index i = source.first_point; i < source.first_point + source.point_count; ++i) {
        PathPoint point = toolpaths_.points[i];
        if (placement.rotation_rad != 0.0) {
          point.position = turn * point.position;
          point.normal = turn * point.normal;
        }
        point.position += placement.offset_mm;
        append_point(point, i, i > source.first_point);
      }
      path.point_count = static_cast<Index>(points_.size()) - path.first_point;
      paths_.push_back(path);
    }
    axes_.resize(points_.size());
    known_free_.assign(points_.size(), 0);
    find_laid_before();
    deposit_ = Deposit(paths_, points_, tips_, kSampleSpacing_mm);
  }

  // What was laid before the nozzle reaches a point: all of it but the bead's own last stretch, which still hangs on
  // the nozzle and is soft.
  void find_laid_before() {
    laid_before_.resize(points_.size());
    for (const Path& path : paths_) {
      Index back = path.first_point;
      double behind = 0.0;
      for (Index i = path.first_point; i < path.first_point + path.point_count; ++i) {
        if (i > path.first_point) behind += (tips_[i] - tips_[i - 1]).norm();
        while (back < i && behind - (tips_[back + 1] - tips_[back]).norm() > kSoftBeads * points_[i].width_mm) {
          behind -= (tips_[back + 1] - tips_[back]).norm();
          ++back;
        }
        laid_before_[i] = back;
      }
    }
  }

  // Appends a point; a long segment to it is divided, so that what is true at its points is nearly true between them.
  void append_point(const PathPoint& point, Index source, bool joined) {
    const Vec3 tip = point.position + point.tip_offset_mm * point.normal;
    const double length = joined ? (tip - tips_.back()).norm() : 0.0;
    const int pieces = std::max(1, static_cast<int>(std::ceil(length / kLongestSegment_mm)));
    const PathPoint from = joined ? points_.back() : point;
    const Vec3 from_tip = joined ? tips_.back() : tip;
    for (int s = 1; s <= pieces; ++s) {
      const double t = static_cast<double>(s) / pieces;
      PathPoint between = point;
      between.volume_mm3 = point.volume_mm3 / pieces;
      if (s < pieces) {
        between.position = (1.0 - t) * from.position + t * point.position;
        between.normal = ((1.0 - t) * from.normal + t * point.normal).normalized();
        between.tip_offset_mm = (1.0 - t) * from.tip_offset_mm + t * point.tip_offset_mm;
      }
      points_.push_back(between);
      tips_.push_back((1.0 - t) * from_tip + t * tip);
      sources_.push_back(s < pieces ? kNone : source);
    }
  }

  // The toolpath point at or behind a divided one.
  Index source_of(Index point) const {
    while (point >= 0 && sources_[point] == kNone) ++point;
    return point >= 0 ? sources_[point] : kNone;
  }

  // Nozzle axes and thinned waypoints of every path; each path on its own.
  void choose_axes() {
    const std::size_t count = paths_.size();
    drafts_.resize(count);
    std::vector<std::vector<AxisFault>> faults(count);
    const Tolerances& tolerances = cell_.machine().tolerances;
    parallel_for(count, 16, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t p = begin; p < end; ++p) {
        const Path& path = paths_[p];
        if (path.point_count == 0) continue;
        smooth_axes(points_of(path), tips_of(path), tolerances, axes_of(path));
        thin_path(path, drafts_[p]);
        if (!is_free(path, drafts_[p])) faults[p] = tilt_path(path, drafts_[p]);
      }
    });
    for (std::size_t p = 0; p < count; ++p) list_faults(static_cast<Index>(p), faults[p]);
  }

  void thin_path(const Path& path, std::vector<DraftPoint>& drafts) {
    const double max_flow = cell_.machine().filaments[static_cast<int>(path.material)].max_flow_mm3_s;
    drafts = thin_waypoints(points_of(path), tips_of(path), axes_of(path), path.first_point, max_flow,
                            cell_.machine().tolerances);
  }

  // Whether the head as it stands touches nothing at waypoints and between them, and the arm reaches them.
  bool is_free(const Path& path, const std::vector<DraftPoint>& drafts) {
    std::vector<Index> at;
    for (const DraftPoint& draft : drafts) at.push_back(draft.point - path.first_point);
    const std::span<const Vec3> tips = tips_of(path), axes = axes_of(path);
    const std::vector<std::size_t> keys = key_points(tips, axes, at);
    ReachHint hint;
    std::vector<Deposit::HeadPose> poses;
    double since_reach = kReachSpacing_mm;
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const Index point = path.first_point + static_cast<Index>(keys[k]);
      if (k > 0) since_reach += (tips_[point] - poses.back().tip).norm();
      poses.push_back({tips_[point], axes_[point], free_height(points_[point]), laid_before_[point]});
      if (since_reach < kReachSpacing_mm && k + 1 < keys.size()) continue;
      since_reach = 0.0;
      if (!reachable(cell_, tips_[point], axes_[point], options_.yaw_samples, hint)) return false;
    }
    if (!options_.avoid_collisions) return true;
    for (const Deposit::HeadPose& pose : poses) {
      if (!cell_.head_above_table(pose.tip, pose.axis)) return false;
    }
    std::vector<char> touches(poses.size());
    deposit_.touches_head(cell_.head(), poses, cell_.machine().tolerances.clearance_mm, touches);
    if (std::find(touches.begin(), touches.end(), 1) != touches.end()) return false;
    for (const std::size_t key : keys) known_free_[path.first_point + static_cast<Index>(key)] = 1;
    return true;
  }

  // Axes of a path that cannot stay as they are, and its waypoints anew. Waypoints at which the head touches something
  // though the key points around are free become keys themselves.
  std::vector<AxisFault> tilt_path(const Path& path, std::vector<DraftPoint>& drafts) {
    std::vector<AxisFault> faults;
    std::vector<Index> keys;
    for (int round = 0; round < kTiltRounds; ++round) {
      const std::span<char> free = std::span(known_free_).subspan(path.first_point, path.point_count);
      std::fill(free.begin(), free.end(), 0);
      if (round > 0) smooth_axes(points_of(path), tips_of(path), cell_.machine().tolerances, axes_of(path));
      faults = tilt_axes(cell_, deposit_, path.first_point, points_of(path), tips_of(path),
                         std::span<const Index>(laid_before_).subspan(path.first_point, path.point_count), options_,
                         keys, axes_of(path), free);
      thin_path(path, drafts);
      if (!options_.avoid_collisions || !add_touching_keys(path, drafts, keys)) break;
    }
    return faults;
  }

  // Adds the points of waypoints at which the head touches something; false when none is new.
  bool add_touching_keys(const Path& path, const std::vector<DraftPoint>& drafts, std::vector<Index>& keys) {
    const std::size_t before = keys.size();
    for (const DraftPoint& draft : drafts) {
      const Index key = draft.point - path.first_point;
      if (std::binary_search(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(before), key)) continue;
      if (known_free_[draft.point]) continue;
      known_free_[draft.point] = head_is_free(draft.tip, draft.axis, draft.point, nullptr);
      if (known_free_[draft.point]) continue;
      for (Index k = std::max(0, key - 1); k <= std::min(path.point_count - 1, key + 1); ++k) keys.push_back(k);
    }
    if (keys.size() == before) return false;
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    return keys.size() > before;
  }

  bool head_is_free(const Vec3& tip, const Vec3& axis, Index point, Contact* contact) const {
    return cell_.head_above_table(tip, axis) &&
           !deposit_.touches_head(cell_.head(), tip, axis, free_height(points_[point]), 0.0, laid_before_[point],
                                  contact);
  }

  void list_faults(Index path, const std::vector<AxisFault>& faults) {
    bool reach_listed = false;
    for (const AxisFault& fault : faults) {
      if (!fault.reach) continue;
      ++result_.report.unreachable_waypoints;
      if (!reach_listed)
        result_.report.unreachable.push_back(
            {path, source_of(fault.point), tips_[fault.point], axes_[fault.point], describe(fault.arm)});
      reach_listed = true;
    }
  }

  std::string name_of_contact(const char* body, const Contact& contact) const {
    if (contact.point == kNone) return std::string(body) + " touches the platform";
    const auto next = std::upper_bound(paths_.begin(), paths_.end(), contact.point,
                                       [](Index point, const Path& path) { return point < path.first_point; });
    const Index path = static_cast<Index>(next - paths_.begin()) - 1;
    const char* material = paths_[path].material == Material::model ? "model" : "support";
    return format("%s touches %s of path %d, layer %d", body, material, path, paths_[path].layer);
  }

  // Yaw and branch, path after path: each prefers to go on as the one before ended.
  void choose_postures() {
    ArmState state;
    for (std::size_t p = 0; p < paths_.size(); ++p) {
      if (drafts_[p].empty()) continue;
      if (p % 64 == 0) run_.check_stop();
      ArmPath arm = plan_arm_path(cell_, nullptr, drafts_[p], options_, state);
      bool links_free = false;
      if (options_.avoid_collisions && arm.unreachable == kNone) {
        links_free = !links_touch(arm);
        if (!links_free) {
          ArmPath clear = plan_arm_path(cell_, &deposit_, drafts_[p], options_, state);
          if (clear.unreachable == kNone) arm = std::move(clear);
        }
      }
      if (arm.unreachable != kNone) {
        const bool listed =
            !result_.report.unreachable.empty() && result_.report.unreachable.back().path == static_cast<Index>(p);
        if (!listed) {
          result_.report.unreachable.push_back({static_cast<Index>(p), source_of(arm.unreachable),
                                                tips_[arm.unreachable], axes_[arm.unreachable], describe(arm.fault)});
        }
        ++result_.report.unreachable_waypoints;
        continue;
      }
      add_chains(static_cast<Index>(p), arm, links_free);
      const ArmPoint& last = arm.sections.back().points.back();
      state = {true, last.yaw, arm.sections.back().branch, last.joints};
      drafts_[p] = {};
    }
  }

  bool links_touch(const ArmPath& arm) const {
    Index before = 0;
    for (const ArmSection& section : arm.sections) {
      for (const ArmPoint& point : section.points) {
        if (point.draft.point != kNone) before = point.draft.point;
        if (touching_link(cell_, deposit_, point.joints, before, 0.0)) return true;
      }
    }
    return false;
  }

  void add_chains(Index path_index, const ArmPath& arm, bool links_free) {
    const Path& path = paths_[path_index];
    Motion& motion = result_.motion;
    for (std::size_t s = 0; s < arm.sections.size(); ++s) {
      const ArmSection& section = arm.sections[s];
      PathMotion chain;
      chain.path = path_index;
      chain.section = static_cast<int>(s);
      chain.sections = static_cast<int>(arm.sections.size());
      chain.material = path.material;
      chain.layer = path.layer;
      chain.group = path.group;
      chain.first_waypoint = static_cast<Index>(motion.waypoints.size());
      chain.waypoint_count = static_cast<Index>(section.points.size());
      chain.material_change_before = motion.paths.empty() || motion.paths.back().material != path.material;
      for (const ArmPoint& point : section.points) {
        const bool first = motion.waypoints.size() == static_cast<std::size_t>(chain.first_waypoint);
        add_waypoint(chain, point, first);
      }
      std::span<Waypoint> waypoints = std::span(motion.waypoints).subspan(chain.first_waypoint);
      set_blends(waypoints, cell_.machine().tolerances, 1e3 * cell_.machine().speeds.print_acceleration_m_s2);
      ends_.push_back({section.points.front().yaw, section.points.back().yaw, section.branch, links_free});
      motion.paths.push_back(chain);
    }
  }

  void add_waypoint(PathMotion& chain, const ArmPoint& point, bool first) {
    Motion& motion = result_.motion;
    Waypoint waypoint;
    waypoint.tip_mm = point.draft.tip;
    waypoint.axis = point.draft.axis;
    waypoint.joints = point.joints;
    waypoint.point = point.draft.point;  // of the divided paths until the report is made
    const Frame frame = cell_.tcp_frame(point.draft.tip, point.draft.axis, point.yaw);
    const Vec3 near = motion.waypoints.empty() || first ? Vec3::Zero() : motion.waypoints.back().pose.rotation_vector;
    waypoint.pose = {frame.translation(), rotation_vector_near(frame.linear(), near)};
    if (!first) {
      waypoint.volume_mm3 = point.draft.volume_mm3;
      set_speed(motion.waypoints.back(), point.draft.duration_s, waypoint);
      const double length = (waypoint.tip_mm - motion.waypoints.back().tip_mm).norm();
      chain.length_mm += length;
      chain.volume_mm3 += waypoint.volume_mm3;
      chain.duration_s += waypoint.duration_s;
      rotation_ += (waypoint.pose.rotation_vector - motion.waypoints.back().pose.rotation_vector).norm();
    } else {
      rotation_ = 0.0;
    }
    const double deviation = angle_between(waypoint.axis, point.draft.normal) / kDegree;
    chain.max_tilt_deviation_deg = std::max(chain.max_tilt_deviation_deg, deviation);
    chain.rotation_rad_per_m = chain.length_mm > 0.0 ? 1e3 * rotation_ / chain.length_mm : 0.0;
    deviations_.push_back(deviation);
    motion.waypoints.push_back(waypoint);
  }

  // The duration that feed, melt rate, joint speeds and the controller's rotation rule allow, and the speed to state
  // for it.
  void set_speed(const Waypoint& from, double duration, Waypoint& to) {
    const Speeds& speeds = cell_.machine().speeds;
    const double length = (to.tip_mm - from.tip_mm).norm();
    const double turn = (to.pose.rotation_vector - from.pose.rotation_vector).norm();
    for (int j = 0; j < 6; ++j)
      duration = std::max(duration, std::abs(to.joints[j] - from.joints[j]) / cell_.joint_speed(j));
    const double planned = std::max(length, 1e3 * turn / speeds.rotation_rad_per_m);
    duration = std::max(duration, planned / speeds.max_programmed_mm_s);
    to.duration_s = duration;
    to.speed_mm_s = planned / duration;
    to.rotation_limited = planned > length;
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
      const Waypoint& waypoint = motion.waypoints[chain.first_waypoint + (last ? chain.waypoint_count - 1 : 0)];
      return end_of(waypoint, last ? ends_[c].last_yaw : ends_[c].first_yaw, ends_[c].branch, chain.layer);
    };
    std::vector<TravelPlan> plans(count + 1);
    parallel_for(count + 1, 32, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t c = begin; c < end; ++c) {
        const TravelEnd from = c > 0 ? chain_end(c - 1, true) : home, to = c < count ? chain_end(c, false) : home;
        const bool change = c < count && motion.paths[c].material_change_before;
        const Index before = c > 0 ? last_point(motion.paths[c - 1]) + 1 : 0;
        plans[c] = plan_travel(cell_, deposit_, from, to, change ? &purge : nullptr, before);
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
        const Waypoint& waypoint = motion.waypoints[motion.paths[chain].first_waypoint];
        result_.report.collisions.push_back({motion.paths[chain].path, source_of(waypoint.point), waypoint.tip_mm,
                                             plans[c].contact.position, plans[c].contact.depth_mm,
                                             "travel: " + name_of_contact(plans[c].body, plans[c].contact)});
        ++result_.report.colliding_travels;
      }
    }
  }

  Index last_point(const PathMotion& chain) const {
    const Path& path = paths_[chain.path];
    return path.first_point + path.point_count - 1;
  }

  // Head and links at every waypoint against platform and what is printed before it.
  void check_bodies() {
    Motion& motion = result_.motion;
    struct Hit {
      std::size_t waypoint;
      Contact contact;
      const char* body;
    };
    const std::size_t count = motion.paths.size();
    std::vector<std::vector<Hit>> hits(chunk_count(count, 32));
    std::vector<Index> chain_of;
    parallel_for(count, 32, run_, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      for (std::size_t c = begin; c < end; ++c) {
        const PathMotion& chain = motion.paths[c];
        Index at = paths_[chain.path].first_point;
        for (Index w = chain.first_waypoint; w < chain.first_waypoint + chain.waypoint_count; ++w) {
          Contact contact;
          if (motion.waypoints[w].point != kNone) at = motion.waypoints[w].point;
          if (const char* body = touching_body(motion.waypoints[w], at, ends_[c].links_free, contact)) {
            hits[chunk].push_back({static_cast<std::size_t>(w), contact, body});
          }
        }
      }
    });
    std::size_t chain = 0;
    Index listed = kNone;
    for (const auto& chunk : hits) {
      for (const Hit& hit : chunk) {
        while (static_cast<Index>(hit.waypoint) >=
               motion.paths[chain].first_waypoint + motion.paths[chain].waypoint_count)
          ++chain;
        ++result_.report.colliding_waypoints;
        const PathMotion& path = motion.paths[chain];
        if (listed == path.path) continue;
        listed = path.path;
        const Waypoint& waypoint = motion.waypoints[hit.waypoint];
        result_.report.collisions.push_back({path.path, source_of(waypoint.point), waypoint.tip_mm,
                                             hit.contact.position, hit.contact.depth_mm,
                                             name_of_contact(hit.body, hit.contact)});
      }
    }
  }

  const char* touching_body(const Waypoint& waypoint, Index before, bool links_free, Contact& contact) const {
    const bool known = waypoint.point != kNone && known_free_[waypoint.point];
    if (!known && !head_is_free(waypoint.tip_mm, waypoint.axis, before, &contact)) return "head";
    if (links_free) return nullptr;
    return touching_link(cell_, deposit_, waypoint.joints, before, 0.0, &contact);
  }

  void finish_report() {
    Motion& motion = result_.motion;
    MotionReport& report = result_.report;
    report.waypoints = motion.waypoints.size();
    report.source_points = toolpaths_.points.size();
    report.chains = motion.paths.size();
    report.min_singularity_metric = motion.waypoints.empty() ? 0.0 : 1.0;
    double worst_position = 0.0, worst_rotation = 0.0, worst_volume = 0.0;
    std::size_t jumps = 0, near = 0;
    for (const PathMotion& chain : motion.paths) {
      report.print_s += chain.duration_s;
      for (Index w = chain.first_waypoint; w < chain.first_waypoint + chain.waypoint_count; ++w) {
        const Waypoint& waypoint = motion.waypoints[w];
        const Frame reached =
            forward_kinematics(cell_.machine().arm, waypoint.joints) * to_frame(cell_.machine().tool.tcp);
        worst_position = std::max(worst_position, (reached.translation() - waypoint.pose.position_m).norm());
        const Eigen::AngleAxisd turn(Mat3(reached.linear().transpose() * rotation_of(waypoint.pose.rotation_vector)));
        worst_rotation = std::max(worst_rotation, turn.angle());
        report.max_tilt_deg = std::max(report.max_tilt_deg, angle_between(waypoint.axis, Vec3::UnitZ()) / kDegree);
        report.min_singularity_metric =
            std::min(report.min_singularity_metric, singularity_metric(cell_.machine().arm, waypoint.joints));
        report.rotation_limited += waypoint.rotation_limited;
        if (w == chain.first_waypoint) continue;
        report.stops += w + 1 < chain.first_waypoint + chain.waypoint_count && waypoint.blend_mm == 0.0;
        const Waypoint& before = motion.waypoints[w - 1];
        near += (waypoint.tip_mm - before.tip_mm).norm() < 0.999 * cell_.machine().tolerances.min_segment_mm;
        double step = 0.0;
        for (int j = 0; j < 6; ++j) {
          const double turned = std::abs(waypoint.joints[j] - before.joints[j]);
          step = std::max(step, turned);
          const double limit = cell_.joint_speed(j) / cell_.machine().arm.joint_speed_fraction;
          report.max_joint_speed_ratio = std::max(report.max_joint_speed_ratio, turned / waypoint.duration_s / limit);
        }
        report.max_joint_step_rad = std::max(report.max_joint_step_rad, step);
        jumps += step > cell_.machine().arm.max_joint_step_rad;
      }
    }
    worst_volume = volume_error();
    for (Waypoint& waypoint : motion.waypoints) {
      if (waypoint.point != kNone) waypoint.point = sources_[waypoint.point];
    }
    report_deviations();
    const Arm& arm = cell_.machine().arm;
    auto& checks = report.checks;
    checks.push_back(
        check_at_most("motion.unreachable", static_cast<double>(report.unreachable_waypoints), 0, first_unreachable()));
    checks.push_back(check_at_most("motion.collisions",
                                   static_cast<double>(report.colliding_waypoints + report.colliding_travels), 0,
                                   first_collision()));
    checks.push_back(check_at_most("motion.forward_kinematics_m", worst_position, kPoseTolerance,
                                   "largest distance between the tip that the joints bring about and the pose"));
    checks.push_back(check_at_most("motion.forward_kinematics_rad", worst_rotation, kPoseTolerance,
                                   "largest turn between the frame that the joints bring about and the pose"));
    checks.push_back(check_at_most("motion.branch_jumps", static_cast<double>(jumps), 0,
                                   "segments in which a joint turns more than arm.max_joint_step_rad"));
    checks.push_back(check_at_most("motion.joint_speed_ratio", report.max_joint_speed_ratio,
                                   arm.joint_speed_fraction + 1e-9,
                                   "largest joint speed at the planned durations over its limit"));
    checks.push_back(check_at_least("motion.singularity_metric", report.min_singularity_metric,
                                    motion.waypoints.empty() ? 0.0 : arm.min_singularity_metric,
                                    "least of |sin q5|, |sin q3|, shoulder margin"));
    checks.push_back(
        check_at_most("motion.volume_error", worst_volume, 1e-9,
                      "largest relative difference between the volume of a path and that of its waypoints"));
    checks.push_back(check_at_most("motion.near_waypoints", static_cast<double>(near), 0,
                                   "consecutive waypoints nearer than tolerances.min_segment_mm"));
    checks.push_back(check_at_most(
        "motion.tilt_deviation_deg", report.tilt_deviation_max_deg,
        cell_.machine().tolerances.max_tilt_deviation.degrees() + 1e-6 + cell_.machine().tolerances.axis.degrees(),
        "largest angle between nozzle axis and layer normal"));
  }

  // Over the paths that were planned: their waypoints' volume against their points'.
  double volume_error() const {
    double worst = 0.0;
    const auto& chains = result_.motion.paths;
    for (std::size_t c = 0; c < chains.size();) {
      const Index path = chains[c].path;
      double laid = 0.0, wanted = 0.0;
      for (; c < chains.size() && chains[c].path == path; ++c) laid += chains[c].volume_mm3;
      for (const PathPoint& point : points_of(paths_[path])) wanted += point.volume_mm3;
      worst = std::max(worst, std::abs(laid - wanted) / std::max(1e-12, wanted));
    }
    return worst;
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

  std::string first_unreachable() const {
    if (result_.report.unreachable.empty()) return "every waypoint is reached";
    const UnreachableWaypoint& first = result_.report.unreachable.front();
    return format("path %d, point %d at (%.2f, %.2f, %.2f): %s", first.path, first.point, first.tip_mm.x(),
                  first.tip_mm.y(), first.tip_mm.z(), first.reason.c_str());
  }

  std::string first_collision() const {
    if (result_.report.collisions.empty()) return "head and arm touch neither platform nor printed material";
    const MotionCollision& first = result_.report.collisions.front();
    return format("path %d, point %d at (%.2f, %.2f, %.2f): %s", first.path, first.point, first.tip_mm.x(),
                  first.tip_mm.y(), first.tip_mm.z(), first.what.c_str());
  }

  struct ChainEnds {
    double first_yaw, last_yaw;
    int branch;
    bool links_free;  // nothing touches forearm and wrist
  };

  const Toolpaths& toolpaths_;
  const Cell& cell_;
  const MotionOptions& options_;
  const RunContext& run_;
  // The toolpaths placed, with long segments divided.
  std::vector<Path> paths_;
  std::vector<PathPoint> points_;
  std::vector<Vec3> tips_, axes_;
  std::vector<Index> laid_before_;
  std::vector<char> known_free_;  // the head at this point touches nothing, with the axis as it is now
  std::vector<Index> sources_;    // toolpath point, kNone for one that divides a segment
  Deposit deposit_;
  std::vector<std::vector<DraftPoint>> drafts_;
  std::vector<ChainEnds> ends_;  // of each chain
  std::vector<double> deviations_;
  double rotation_ = 0.0;
  MotionResult result_;
};

}  // namespace

MotionResult plan_motion(const Toolpaths& toolpaths, const Machine& machine, const MotionOptions& options,
                         const RunContext& run) {
  const Cell cell(machine);
  const PartPlacement placement = place_part(toolpaths, cell, options, run);
  return MotionPlanner(toolpaths, cell, options, run).plan(placement);
}

}  // namespace curvesup
