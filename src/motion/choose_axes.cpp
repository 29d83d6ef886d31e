#include "motion/choose_axes.h"

#include <algorithm>
#include <numeric>

#include "curvesup/core/parallel.h"

namespace curvesup {
namespace {

constexpr double kReachSpacing_mm = 2.0;  // between points at which the arm's reach is looked at
constexpr int kTiltRounds = 4;
constexpr int kOrderRounds = 8;
constexpr int kRaiseSteps = 4;    // of one point
constexpr int kRaiseRounds = 12;  // where points beside raised ones touch in their turn

// All that one choose_axes() call works on.
class AxisChooser {
 public:
  AxisChooser(const Cell& cell, const MotionOptions& options, PrintOrder& order, PlacedPaths& placed, const RunContext& run)
      : cell_(cell), options_(options), order_(order), placed_(placed), run_(run), look_(cell, order.deposit()),
        wanted_(placed.paths.size(), 1), stuck_(placed.paths.size(), 0), faults_(placed.paths.size()) {}

  std::vector<std::vector<AxisFault>> run() {
    choose();
    for (int round = 0; round < kOrderRounds && pass_earlier(); ++round) choose();
    raise_stuck();
    return std::move(faults_);
  }

 private:
  // Of each path that wants it, on its own.
  void choose() {
    const Tolerances& tolerances = cell_.machine().tolerances;
    parallel_for(placed_.paths.size(), 1, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t p = begin; p < end; ++p) {
        const Path& path = placed_.paths[p];
        if (!wanted_[p]) continue;
        stuck_[p] = 0;
        faults_[p].clear();
        if (path.point_count == 0) continue;
        smooth_axes(placed_.of(placed_.points, path), placed_.of(placed_.tips, path), tolerances, placed_.of(placed_.axes, path));
        thin_path(p);
        if (!is_free(p)) stuck_[p] = tilt_path(p);
      }
    });
  }

  void thin_path(std::size_t p) const {
    const Path& path = placed_.paths[p];
    const double max_flow = cell_.machine().filaments[static_cast<int>(path.material)].max_flow_mm3_s;
    placed_.drafts[p] = thin_waypoints(placed_.of(placed_.points, path), placed_.of(placed_.tips, path),
                                       placed_.of(placed_.axes, path), path.first_point, max_flow, cell_.machine().tolerances);
  }

  // Whether the head as it stands touches nothing at waypoints and between them, and the arm reaches them.
  bool is_free(std::size_t p) const {
    const Path& path = placed_.paths[p];
    std::vector<Index> at;
    for (const DraftPoint& draft : placed_.drafts[p]) at.push_back(draft.point - path.first_point);
    const auto tips = placed_.of(placed_.tips, path), axes = placed_.of(placed_.axes, path);
    const auto points = placed_.of(placed_.points, path);
    const auto before = placed_.of(placed_.laid_before, path);
    const std::vector<std::size_t> keys = key_points(tips, axes, at);
    ReachHint hint;
    std::vector<Deposit::HeadPose> poses;
    double since_reach = kReachSpacing_mm;
    auto draft = placed_.drafts[p].begin();
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const std::size_t i = keys[k];
      const bool kept = draft != placed_.drafts[p].end() && draft->point - path.first_point == static_cast<Index>(i);
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
    order_.deposit().touches_head(cell_.head(), poses, cell_.machine().tolerances.clearance_mm, touches);
    if (std::find(touches.begin(), touches.end(), 1) != touches.end()) return false;
    for (const std::size_t key : keys) placed_.of(placed_.known_free, path)[key] = 1;
    return true;
  }

  // Axes of a path that cannot stay as they are, and its waypoints anew. Waypoints at which the head touches something
  // though the key points around are free become keys themselves. True when it still touches something.
  bool tilt_path(std::size_t p) {
    const Path& path = placed_.paths[p];
    std::vector<Index> keys;
    for (int round = 0; round < kTiltRounds; ++round) {
      const std::span<char> free = placed_.of(placed_.known_free, path);
      std::fill(free.begin(), free.end(), 0);
      const auto axes = placed_.of(placed_.axes, path);
      if (round > 0) smooth_axes(placed_.of(placed_.points, path), placed_.of(placed_.tips, path), cell_.machine().tolerances, axes);
      faults_[p] = tilt_axes(cell_, order_.deposit(), path.first_point, placed_.of(placed_.points, path),
                             placed_.of(placed_.tips, path), placed_.of(placed_.laid_before, path), options_, keys, axes, free);
      thin_path(p);
      if (!options_.avoid_collisions || !look_.add_touching_keys(placed_, p, keys)) break;
    }
    return options_.avoid_collisions && !look_.touching_poses(placed_, p).empty();
  }

  // Paths that no tilt and no order frees pass higher where they touch, step by step; where that does not help, as planned.
  void raise_stuck() {
    if (cell_.machine().tolerances.max_raise_mm <= 0.0) return;
    parallel_for(placed_.paths.size(), 1, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t p = begin; p < end; ++p) {
        if (stuck_[p]) raise_path(p);
      }
    });
  }

  void raise_path(std::size_t p) {
    const Path& path = placed_.paths[p];
    const Tolerances& tolerances = cell_.machine().tolerances;
    const auto tilt_anew = [&] {
      smooth_axes(placed_.of(placed_.points, path), placed_.of(placed_.tips, path), tolerances, placed_.of(placed_.axes, path));
      return tilt_path(p);
    };
    if (!look_.raise_may_help(placed_, p)) return;
    for (int round = 0; round < kRaiseRounds; ++round) {
      placed_.raise(path, look_.touching_points(placed_, p), tolerances.max_raise_mm / kRaiseSteps, tolerances.max_raise_mm);
      if (!tilt_anew()) return;
    }
    placed_.lower(path);
    tilt_anew();
  }

  // Paths at which no tilt keeps the head off beads beside them, of their own piece, go before those: without them a tilt
  // may be found that clears the rest. False when there are none; else all whose place has changed want axes anew.
  bool pass_earlier() {
    std::vector<Index> order(placed_.paths.size());
    std::iota(order.begin(), order.end(), 0);
    wanted_.assign(placed_.paths.size(), 0);
    bool any = false;
    for (std::size_t p = 0; p < stuck_.size(); ++p) {
      if (!stuck_[p]) continue;
      const std::size_t first = earliest_touched(p);
      if (first >= p) continue;
      // Earlier moves have shifted what lies between.
      const auto to = std::find(order.begin(), order.end(), static_cast<Index>(first));
      const auto from = std::find(order.begin(), order.end(), static_cast<Index>(p));
      if (to >= from) continue;
      std::rotate(to, from, from + 1);
      std::fill(wanted_.begin() + (to - order.begin()), wanted_.begin() + (from + 1 - order.begin()), 1);
      any = true;
    }
    if (!any) return false;
    PlacedPaths anew = order_.reorder(placed_, order);
    for (std::size_t p = 0; p < anew.paths.size(); ++p) {
      if (!wanted_[p]) keep_axes(placed_, anew, p);
    }
    placed_ = std::move(anew);
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
  std::size_t earliest_touched(std::size_t p) const {
    std::vector<Index> touched;
    for (const HeadLook::OpenPose& open : look_.touching_poses(placed_, p)) {
      const Deposit::HeadPose pose = HeadLook::pose(placed_, open.tip, open.axis, open.point);
      order_.deposit().contacts_of_head(cell_.head(), pose.tip, pose.axis, pose.free_height, 0.0, pose.before, touched);
    }
    std::size_t first = p;
    for (const Index point : touched) {
      const Index number = order_.path_of(point);
      if (number < placed_.first_path) continue;
      const auto other = static_cast<std::size_t>(number - placed_.first_path);
      if (same_sheet(placed_.paths[other], placed_.paths[p])) first = std::min(first, other);
    }
    return first;
  }

  // Whether two paths lie in one piece, so that neither needs the other to rest on.
  static bool same_sheet(const Path& a, const Path& b) {
    return a.piece == b.piece && a.layer == b.layer && a.pass == b.pass && a.material == b.material && a.group == b.group;
  }

  const Cell& cell_;
  const MotionOptions& options_;
  PrintOrder& order_;
  PlacedPaths& placed_;
  const RunContext& run_;
  HeadLook look_;
  std::vector<char> wanted_;  // paths whose axes are to be chosen
  std::vector<char> stuck_;   // those that touch something at every allowed tilt
  std::vector<std::vector<AxisFault>> faults_;
};

}  // namespace

std::vector<std::vector<AxisFault>> choose_axes(const Cell& cell, const MotionOptions& options, PrintOrder& order,
                                                PlacedPaths& placed, const RunContext& run) {
  return AxisChooser(cell, options, order, placed, run).run();
}

}  // namespace curvesup
