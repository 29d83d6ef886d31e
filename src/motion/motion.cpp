#include "curvesup/motion/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "core/memory.h"
#include "motion/arm_path.h"
#include "motion/chain.h"
#include "motion/head_look.h"
#include "motion/placed_paths.h"
#include "motion/travel.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kSampleSpacing_mm = 1.0;  // of deposited beads
constexpr double kReachSpacing_mm = 2.0;   // between points at which the arm's reach is looked at
constexpr int kTiltRounds = 4;
constexpr int kOrderRounds = 8;
constexpr int kRaiseSteps = 4;
constexpr double kPoseTolerance = 1e-6;       // m and rad, between joints and pose
constexpr std::size_t kRunPaths = 512;        // paths that are planned together, at least
constexpr std::size_t kRunPoints = 200000;    // or points
constexpr std::size_t kGuesses = 64;          // paths whose postures are worked out at the same time, at most
constexpr std::size_t kFewGuesses = 4;        // where the head had to turn
constexpr std::size_t kWaypointsBetweenReleases = 250000;

// All that one plan_motion() call works on.
class MotionPlanner {
 public:
  MotionPlanner(const Toolpaths& toolpaths, const Cell& cell, const MotionOptions& options,
                const PartPlacement& placement, const RunContext& run)
      : toolpaths_(toolpaths), cell_(cell), options_(options), placement_(placement), run_(run), deposit_(kSampleSpacing_mm), look_(cell, deposit_) {}

  MotionResult plan() {
    result_.motion.part_offset_mm = placement_.offset_mm;
    result_.motion.part_rotation_rad = placement_.rotation_rad;
    lay_out();
    ReleasedInSteps memory(kWaypointsBetweenReleases);
    for (std::size_t begin = 0, end; begin < order_.size(); begin = end) {
      end = run_end(begin);
      plan_run(begin, end);
      // What the runs leave in the heaps of the threads would come on top of the waypoints.
      memory.at(result_.motion.waypoints.size());
      run_.progress(0.9 * static_cast<double>(end) / static_cast<double>(order_.size()));
    }
    if (result_.report.unreachable.empty()) plan_travels();
    if (reordered_) result_.path_order = std::move(order_);
    finish_report();
    return std::move(result_);
  }

 private:
  // Every bead of the print, and the numbers of the placed points of each path.
  void lay_out() {
    const std::size_t count = toolpaths_.paths.size();
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0);
    first_points_.assign(count + 1, 0);
    std::vector<Deposit> parts(chunk_count(count, kRunPaths), Deposit(kSampleSpacing_mm));
    parallel_for(count, kRunPaths, run_, [&](std::size_t begin, std::size_t end, std::size_t part) {
      for (std::size_t p = begin; p < end; ++p) {
        const PlacedPaths placed = place_paths(toolpaths_, placement_, std::span(order_).subspan(p, 1), 0, 0, 0);
        parts[part].add_path(placed.points, placed.tips);
        first_points_[p + 1] = static_cast<Index>(placed.points.size());
      }
    });
    for (Deposit& part : parts) deposit_.append(std::move(part));
    deposit_.finish();
    std::partial_sum(first_points_.begin(), first_points_.end(), first_points_.begin());
    result_.motion.waypoints.reserve(static_cast<std::size_t>(first_points_.back()) + count);
  }

  PlacedPaths place(std::size_t begin, std::size_t end) const {
    const std::span<const Index> order = std::span(order_).subspan(begin, end - begin);
    // Only paths of one run change places, so the run's points stay those of the toolpaths from here on.
    return place_paths(toolpaths_, placement_, order, static_cast<Index>(begin), first_points_[begin],
                       toolpaths_.paths[begin].first_point);
  }

  // Paths that are planned together: whole pieces.
  std::size_t run_end(std::size_t begin) const {
    std::size_t end = begin + 1;
    const auto same_piece = [&](std::size_t path) { return toolpaths_.paths[path].piece == toolpaths_.paths[path - 1].piece; };
    const auto points = [&] { return static_cast<std::size_t>(first_points_[end] - first_points_[begin]); };
    while (end < order_.size() && (same_piece(end) || (end - begin < kRunPaths && points() < kRunPoints))) ++end;
    return end;
  }

  void plan_run(std::size_t begin, std::size_t end) {
    run_.check_stop();
    PlacedPaths placed = place(begin, end);
    std::vector<char> wanted(placed.paths.size(), 1), stuck(placed.paths.size(), 0);
    choose_axes(placed, wanted, stuck);
    for (int round = 0; round < kOrderRounds && pass_earlier(placed, stuck, wanted); ++round) choose_axes(placed, wanted, stuck);
    raise_stuck(placed, stuck);
    for (std::size_t p = 0; p < placed.paths.size(); ++p) list_faults(placed, p);
    choose_postures(placed);
  }

  // Nozzle axes and thinned waypoints of the paths that `wanted` marks; each path on its own. `stuck` gets marks for those
  // that touch something at every allowed tilt.
  void choose_axes(PlacedPaths& placed, const std::vector<char>& wanted, std::vector<char>& stuck) {
    faults_.resize(placed.paths.size());
    const Tolerances& tolerances = cell_.machine().tolerances;
    parallel_for(placed.paths.size(), 1, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t p = begin; p < end; ++p) {
        const Path& path = placed.paths[p];
        if (!wanted[p]) continue;
        stuck[p] = 0;
        faults_[p].clear();
        if (path.point_count == 0) continue;
        smooth_axes(placed.of(placed.points, path), placed.of(placed.tips, path), tolerances, placed.of(placed.axes, path));
        thin_path(placed, p);
        if (!is_free(placed, p)) stuck[p] = tilt_path(placed, p);
      }
    });
  }

  void thin_path(PlacedPaths& placed, std::size_t p) const {
    const Path& path = placed.paths[p];
    const double max_flow = cell_.machine().filaments[static_cast<int>(path.material)].max_flow_mm3_s;
    placed.drafts[p] = thin_waypoints(placed.of(placed.points, path), placed.of(placed.tips, path),
                                      placed.of(placed.axes, path), path.first_point, max_flow, cell_.machine().tolerances);
  }

  // Whether the head as it stands touches nothing at waypoints and between them, and the arm reaches them.
  bool is_free(PlacedPaths& placed, std::size_t p) const {
    const Path& path = placed.paths[p];
    std::vector<Index> at;
    for (const DraftPoint& draft : placed.drafts[p]) at.push_back(draft.point - path.first_point);
    const auto tips = placed.of(placed.tips, path), axes = placed.of(placed.axes, path);
    const auto points = placed.of(placed.points, path);
    const auto before = placed.of(placed.laid_before, path);
    const std::vector<std::size_t> keys = key_points(tips, axes, at);
    ReachHint hint;
    std::vector<Deposit::HeadPose> poses;
    double since_reach = kReachSpacing_mm;
    auto draft = placed.drafts[p].begin();
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const std::size_t i = keys[k];
      const bool kept = draft != placed.drafts[p].end() && draft->point - path.first_point == static_cast<Index>(i);
      const Vec3 &tip = kept ? draft->tip : tips[i], &axis = kept ? draft->axis : axes[i];
      if (kept) ++draft;
      if (k > 0) since_reach += (tip - poses.back().tip).norm();
      poses.push_back({tip, axis, free_height(points[i]), before[i]});
      if (since_reach < kReachSpacing_mm && k + 1 < keys.size()) continue;
      since_reach = 0.0;
      if (!reachable(cell_, tip, axis, options_.yaw_samples, hint)) return false;
    }
    if (!options_.avoid_collisions) return true;
    for (const Deposit::HeadPose& pose : poses) {
      if (!cell_.head_above_table(pose.tip, pose.axis)) return false;
    }
    std::vector<char> touches(poses.size());
    deposit_.touches_head(cell_.head(), poses, cell_.machine().tolerances.clearance_mm, touches);
    if (std::find(touches.begin(), touches.end(), 1) != touches.end()) return false;
    for (const std::size_t key : keys) placed.of(placed.known_free, path)[key] = 1;
    return true;
  }

  // Axes of a path that cannot stay as they are, and its waypoints anew. Waypoints at which the head touches something
  // though the key points around are free become keys themselves. True when it still touches something.
  bool tilt_path(PlacedPaths& placed, std::size_t p) {
    const Path& path = placed.paths[p];
    std::vector<Index> keys;
    for (int round = 0; round < kTiltRounds; ++round) {
      const std::span<char> free = placed.of(placed.known_free, path);
      std::fill(free.begin(), free.end(), 0);
      const auto axes = placed.of(placed.axes, path);
      if (round > 0) smooth_axes(placed.of(placed.points, path), placed.of(placed.tips, path), cell_.machine().tolerances, axes);
      faults_[p] = tilt_axes(cell_, deposit_, path.first_point, placed.of(placed.points, path), placed.of(placed.tips, path),
                             placed.of(placed.laid_before, path), options_, keys, axes, free);
      thin_path(placed, p);
      if (!options_.avoid_collisions || !look_.add_touching_keys(placed, p, keys)) break;
    }
    return options_.avoid_collisions && !look_.touching_poses(placed, p).empty();
  }

  // Paths that no tilt and no order frees pass higher where they touch, step by step; where that does not help, as planned.
  void raise_stuck(PlacedPaths& placed, const std::vector<char>& stuck) {
    if (cell_.machine().tolerances.max_raise_mm <= 0.0) return;
    parallel_for(placed.paths.size(), 1, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t p = begin; p < end; ++p) {
        if (stuck[p]) raise_path(placed, p);
      }
    });
    for (std::size_t i = 0; i < placed.raises.size(); ++i) {
      if (placed.raises[i] == 0.0) continue;
      result_.raised.push_back({placed.sources[i], placed.raises[i]});
      result_.report.max_raise_mm = std::max(result_.report.max_raise_mm, placed.raises[i]);
    }
  }

  void raise_path(PlacedPaths& placed, std::size_t p) {
    const Path& path = placed.paths[p];
    const Tolerances& tolerances = cell_.machine().tolerances;
    const auto tilt_anew = [&] {
      smooth_axes(placed.of(placed.points, path), placed.of(placed.tips, path), tolerances, placed.of(placed.axes, path));
      return tilt_path(placed, p);
    };
    if (!look_.raise_may_help(placed, p)) return;
    for (int step = 0; step < kRaiseSteps; ++step) {
      placed.raise(path, look_.touching_points(placed, p), tolerances.max_raise_mm / kRaiseSteps, tolerances.max_raise_mm);
      if (!tilt_anew()) return;
    }
    placed.lower(path);
    tilt_anew();
  }

  // Paths at which no tilt keeps the head off beads beside them, of their own piece, go before those: without them a tilt
  // may be found that clears the rest. False when there are none; else `moved` marks all whose place has changed.
  bool pass_earlier(PlacedPaths& placed, const std::vector<char>& stuck, std::vector<char>& moved) {
    std::vector<Index> order(placed.paths.size());
    std::iota(order.begin(), order.end(), 0);
    moved.assign(placed.paths.size(), 0);
    bool any = false;
    for (std::size_t p = 0; p < stuck.size(); ++p) {
      if (!stuck[p]) continue;
      const std::size_t first = earliest_touched(placed, p);
      if (first >= p) continue;
      // Earlier moves have shifted what lies between.
      const auto to = std::find(order.begin(), order.end(), static_cast<Index>(first));
      const auto from = std::find(order.begin(), order.end(), static_cast<Index>(p));
      if (to >= from) continue;
      std::rotate(to, from, from + 1);
      std::fill(moved.begin() + (to - order.begin()), moved.begin() + (from + 1 - order.begin()), 1);
      any = true;
    }
    if (!any) return false;
    reordered_ = true;
    const auto begin = static_cast<std::size_t>(placed.first_path), end = placed.end_path();
    deposit_.reorder(begin, order);
    std::vector<Index> paths;
    for (const Index was : order) paths.push_back(order_[begin + static_cast<std::size_t>(was)]);
    std::copy(paths.begin(), paths.end(), order_.begin() + placed.first_path);
    PlacedPaths anew = place(begin, end);
    for (std::size_t p = 0; p < anew.paths.size(); ++p) {
      first_points_[begin + p] = anew.paths[p].first_point;
      if (!moved[p]) keep_axes(placed, anew, p);
    }
    placed = std::move(anew);
    return true;
  }

  // A path whose place is the same keeps what was chosen for it.
  static void keep_axes(const PlacedPaths& from, PlacedPaths& to, std::size_t p) {
    const Path& path = to.paths[p];
    to.drafts[p] = from.drafts[p];
    const auto axes = from.of(from.axes, path);
    std::copy(axes.begin(), axes.end(), to.of(to.axes, path).begin());
    const auto known_free = from.of(from.known_free, path);
    std::copy(known_free.begin(), known_free.end(), to.of(to.known_free, path).begin());
  }

  // The earliest path of the same piece whose bead the head touches; else p.
  std::size_t earliest_touched(const PlacedPaths& placed, std::size_t p) const {
    std::vector<Index> touched;
    for (const HeadLook::OpenPose& open : look_.touching_poses(placed, p)) {
      const Deposit::HeadPose pose = HeadLook::pose(placed, open.tip, open.axis, open.point);
      deposit_.contacts_of_head(cell_.head(), pose.tip, pose.axis, pose.free_height, 0.0, pose.before, touched);
    }
    std::size_t first = p;
    for (const Index point : touched) {
      const Index number = path_of(point);
      if (number < placed.first_path) continue;
      const auto other = static_cast<std::size_t>(number - placed.first_path);
      if (same_sheet(placed.paths[other], placed.paths[p])) first = std::min(first, other);
    }
    return first;
  }

  // Whether two paths lie in one piece, so that neither needs the other to rest on.
  static bool same_sheet(const Path& a, const Path& b) {
    return a.piece == b.piece && a.layer == b.layer && a.pass == b.pass && a.material == b.material && a.group == b.group;
  }

  // The path of a placed point.
  Index path_of(Index point) const {
    return static_cast<Index>(std::upper_bound(first_points_.begin(), first_points_.end(), point) - first_points_.begin()) - 1;
  }

  void list_faults(const PlacedPaths& placed, std::size_t p) {
    bool listed = false;
    for (const AxisFault& fault : faults_[p]) {
      if (!fault.reach) continue;
      ++result_.report.unreachable_waypoints;
      const std::size_t row = placed.row(fault.point);
      if (!listed) {
        result_.report.unreachable.push_back({placed.first_path + static_cast<Index>(p), placed.source_of(fault.point),
                                              placed.tips[row], placed.axes[row], describe(fault.arm)});
      }
      listed = true;
    }
  }

  std::string name_of_contact(const char* body, const Contact& contact) const {
    if (contact.point == kNone) return std::string(body) + " touches the platform";
    const Index number = path_of(contact.point);
    const Path& path = toolpaths_.paths[order_[number]];
    const char* material = path.material == Material::model ? "model" : "support";
    return format("%s touches %s of path %d, layer %d", body, material, number, path.layer);
  }

  // Yaw and branch, path after path: each prefers to go on as the one before ended. Most can: those are worked out
  // together, as if all could; the first one that cannot turns the head, or is planned by itself.
  void choose_postures(PlacedPaths& placed) {
    std::vector<PlannedPath> planned(placed.paths.size());
    std::size_t most = kGuesses;
    for (std::size_t p = 0; p < planned.size();) {
      std::vector<Guess> guesses = guess_postures(placed, p, state_.yaw, most);
      const bool all = take_guesses(guesses, planned, p);
      if (p == planned.size()) break;
      if (all && !guesses.empty()) {
        most = std::min(kGuesses, 2 * most);
        continue;
      }
      most = kFewGuesses;
      const std::optional<double> held = turned_yaw(placed, p);
      if (held) {
        guesses = guess_postures(placed, p, *held, 1);
        if (take_guesses(guesses, planned, p)) continue;
      }
      plan_path(placed, p, planned[p]);
      ++p;
    }
    add_chains(placed, planned);
  }

  struct Guess {
    std::size_t path = 0;
    std::optional<ArmSection> section;  // that nothing touches
  };

  // The next paths, `most` at most, held as the arm stands but at that turn of the head.
  std::vector<Guess> guess_postures(const PlacedPaths& placed, std::size_t from, double yaw, std::size_t most) const {
    std::vector<Guess> guesses;
    if (!state_.known) return guesses;
    for (std::size_t p = from; p < placed.paths.size() && guesses.size() < most; ++p) {
      if (!placed.drafts[p].empty()) guesses.push_back({p, std::nullopt});
    }
    const Deposit* obstacles = options_.avoid_collisions ? &deposit_ : nullptr;
    parallel_for(guesses.size(), 2, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t g = begin; g < end; ++g) {
        guesses[g].section = hold_posture(cell_, obstacles, placed.drafts[guesses[g].path], state_.branch, yaw);
      }
    });
    return guesses;
  }

  // Takes paths over up to the first that is not held, which `p` becomes; false when there is one.
  bool take_guesses(std::vector<Guess>& guesses, std::vector<PlannedPath>& planned, std::size_t& p) {
    for (Guess& guess : guesses) {
      p = guess.path;
      if (!guess.section) return false;
      planned[p] = {cut_section(cell_, std::move(*guess.section), state_), options_.avoid_collisions};
      end_path(planned[p++].arm);
    }
    return true;
  }

  // Another turn of the head with which a path can be held, as far as its key waypoints tell.
  std::optional<double> turned_yaw(const PlacedPaths& placed, std::size_t p) const {
    if (!state_.known || placed.drafts[p].empty()) return std::nullopt;
    const std::optional<double> held = held_yaw(cell_, placed.drafts[p], options_, state_.yaw, state_.branch);
    return held && *held != state_.yaw ? held : std::nullopt;
  }

  // One path, whatever it takes.
  void plan_path(const PlacedPaths& placed, std::size_t p, PlannedPath& planned) {
    if (placed.drafts[p].empty()) return;
    ArmPath arm = plan_arm_path(cell_, nullptr, placed.drafts[p], options_, state_);
    bool links_free = false;
    if (options_.avoid_collisions && arm.unreachable == kNone) {
      links_free = true;
      Index at = placed.paths[p].first_point;
      for (const ArmSection& section : arm.sections) {
        links_free = links_free && !links_touch(section, at);
        at = last_point(section, at);
      }
      if (!links_free) {
        ArmPath clear = plan_arm_path(cell_, &deposit_, placed.drafts[p], options_, state_);
        if (clear.unreachable == kNone) arm = std::move(clear);
      }
    }
    if (arm.unreachable != kNone) return list_unreachable(placed, p, arm);
    end_path(arm);
    planned = {std::move(arm), links_free};
  }

  void list_unreachable(const PlacedPaths& placed, std::size_t p, const ArmPath& arm) {
    const Index path = placed.first_path + static_cast<Index>(p);
    const bool listed = std::any_of(result_.report.unreachable.begin(), result_.report.unreachable.end(),
                                    [&](const UnreachableWaypoint& other) { return other.path == path; });
    const std::size_t row = placed.row(arm.unreachable);
    if (!listed) {
      result_.report.unreachable.push_back(
          {path, placed.source_of(arm.unreachable), placed.tips[row], placed.axes[row], describe(arm.fault)});
    }
    ++result_.report.unreachable_waypoints;
  }

  void end_path(const ArmPath& arm) {
    const ArmPoint& last = arm.sections.back().points.back();
    state_ = {true, last.yaw, arm.sections.back().branch, last.joints};
  }

  // With the clearance that is kept from all that is printed.
  bool links_touch(const ArmSection& section, Index before) const {
    for (const ArmPoint& point : section.points) {
      if (point.draft.point != kNone) before = point.draft.point;
      if (touching_link(cell_, deposit_, point.joints, before, cell_.machine().tolerances.clearance_mm)) return true;
    }
    return false;
  }

  // Chains of a run, with their figures; chains do not need each other.
  void add_chains(const PlacedPaths& placed, std::vector<PlannedPath>& planned) {
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
        at = last_point(sections[s], at);
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

  // The last waypoint of a section that is a point of its path; waypoints that divide a segment are none.
  static Index last_point(const ArmSection& section, Index before) {
    for (auto point = section.points.rbegin(); point != section.points.rend(); ++point) {
      if (point->draft.point != kNone) return point->draft.point;
    }
    return before;
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
        body = touching_link(cell_, deposit_, point.joints, at, 0.0, &contact);
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
    deposit_.touches_head(cell_.head(), poses, 0.0, touches);
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
    worst_.add(figures);
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
    worst_volume_ = std::max(worst_volume_, std::abs(laid - wanted) / std::max(1e-12, wanted));
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
        const Index before = c > 0 ? first_points_[motion.paths[c - 1].path + 1] : 0;
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
        const Waypoint waypoint = motion.waypoints[motion.paths[chain].first_waypoint];
        result_.report.collisions.push_back({motion.paths[chain].path, waypoint.point, waypoint.tip_mm,
                                             plans[c].contact.position, plans[c].contact.depth_mm,
                                             "travel: " + name_of_contact(plans[c].body, plans[c].contact)});
        ++result_.report.colliding_travels;
      }
    }
  }

  void finish_report() {
    const Motion& motion = result_.motion;
    MotionReport& report = result_.report;
    report.waypoints = motion.waypoints.size();
    report.source_points = toolpaths_.points.size();
    report.chains = motion.paths.size();
    report.min_singularity_metric = motion.waypoints.empty() ? 0.0 : worst_.min_singularity_metric;
    report_deviations();
    const Arm& arm = cell_.machine().arm;
    auto& checks = report.checks;
    checks.push_back(
        check_at_most("motion.unreachable", static_cast<double>(report.unreachable_waypoints), 0, first_unreachable()));
    checks.push_back(check_at_most("motion.collisions",
                                   static_cast<double>(report.colliding_waypoints + report.colliding_travels), 0,
                                   first_collision()));
    checks.push_back(check_at_most("motion.forward_kinematics_m", worst_.position_m, kPoseTolerance,
                                   "largest distance between the tip that the joints bring about and the pose"));
    checks.push_back(check_at_most("motion.forward_kinematics_rad", worst_.rotation_rad, kPoseTolerance,
                                   "largest turn between the frame that the joints bring about and the pose"));
    checks.push_back(check_at_most("motion.branch_jumps", static_cast<double>(worst_.jumps), 0,
                                   "segments in which a joint turns more than arm.max_joint_step_rad"));
    checks.push_back(check_at_most("motion.joint_speed_ratio", report.max_joint_speed_ratio,
                                   arm.joint_speed_fraction + 1e-9,
                                   "largest joint speed at the planned durations over its limit"));
    checks.push_back(check_at_least("motion.singularity_metric", report.min_singularity_metric,
                                    motion.waypoints.empty() ? 0.0 : arm.min_singularity_metric,
                                    "least of |sin q5|, |sin q3|, shoulder margin"));
    checks.push_back(
        check_at_most("motion.volume_error", worst_volume_, 1e-9,
                      "largest relative difference between the volume of a path and that of its waypoints"));
    checks.push_back(check_at_most("motion.near_waypoints", static_cast<double>(worst_.near), 0,
                                   "consecutive waypoints nearer than tolerances.min_segment_mm"));
    checks.push_back(check_at_most(
        "motion.tilt_deviation_deg", report.tilt_deviation_max_deg,
        cell_.machine().tolerances.max_tilt_deviation.degrees() + 1e-6 + cell_.machine().tolerances.axis.degrees(),
        "largest angle between nozzle axis and layer normal"));
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
  };

  const Toolpaths& toolpaths_;
  const Cell& cell_;
  const MotionOptions& options_;
  const PartPlacement& placement_;
  const RunContext& run_;
  std::vector<Index> order_;         // of the toolpaths' paths
  std::vector<Index> first_points_;  // placed points before each path, and all at the end
  bool reordered_ = false;
  Deposit deposit_;
  HeadLook look_;
  std::vector<std::vector<AxisFault>> faults_;  // of the paths of this run
  ArmState state_;
  std::vector<ChainEnds> ends_;
  std::vector<float> deviations_;
  ChainFigures worst_;
  double worst_volume_ = 0.0;
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
