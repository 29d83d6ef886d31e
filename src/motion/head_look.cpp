#include "motion/head_look.h"

#include <algorithm>

#include "motion/nozzle_axis.h"

namespace curvesup {
namespace {

constexpr double kTurning = 0.02;        // rad between waypoints
constexpr double kTurningMuch = 0.12;    // between places on the way from one to the next
constexpr double kLookSpacing_mm = 2.0;  // of such places

// Half way, and half way on either side of that as long as the way is long or the axis turns much.
void add_poses_between(const DraftPoint& from, const DraftPoint& to, double least_turn,
                       std::vector<HeadLook::OpenPose>& poses) {
  const bool turns = (to.axis - from.axis).squaredNorm() >= least_turn * least_turn;
  if (!turns && (to.tip - from.tip).squaredNorm() < kLookSpacing_mm * kLookSpacing_mm) return;
  DraftPoint before = from, behind = to;
  before.tip = behind.tip = 0.5 * (from.tip + to.tip);
  before.axis = behind.axis = (from.axis + to.axis).normalized();
  poses.push_back({behind.tip, behind.axis, from.point, to.point});
  add_poses_between(from, behind, kTurningMuch, poses);
  add_poses_between(before, to, kTurningMuch, poses);
}

}  // namespace

Deposit::HeadPose HeadLook::pose(const PlacedPaths& placed, const Vec3& tip, const Vec3& axis, Index point) {
  const std::size_t row = placed.row(point);
  return {tip, axis, free_height(placed.points[row]), placed.laid_before[row]};
}

std::vector<HeadLook::OpenPose> HeadLook::open_poses(const PlacedPaths& placed, std::size_t p) const {
  const std::vector<DraftPoint>& drafts = placed.drafts[p];
  std::vector<OpenPose> poses;
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const DraftPoint& draft = drafts[i];
    if (!placed.knows_free(draft)) poses.push_back({draft.tip, draft.axis, draft.point, draft.point});
    if (i > 0) add_poses_between(drafts[i - 1], draft, kTurning, poses);
  }
  return poses;
}

std::vector<HeadLook::OpenPose> HeadLook::touching_poses(const PlacedPaths& placed, std::size_t p) const {
  const std::vector<OpenPose> open = open_poses(placed, p);
  std::vector<Deposit::HeadPose> poses;
  for (const OpenPose& at : open) poses.push_back(pose(placed, at.tip, at.axis, at.point));
  std::vector<char> touches(poses.size());
  deposit_.touches_head(cell_.head(), poses, 0.0, touches);
  std::vector<OpenPose> touching;
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (touches[i] || !cell_.head_above_table(open[i].tip, open[i].axis)) touching.push_back(open[i]);
  }
  return touching;
}

std::vector<char> HeadLook::touching_points(const PlacedPaths& placed, std::size_t p) const {
  const Path& path = placed.paths[p];
  std::vector<char> marked(static_cast<std::size_t>(path.point_count), 0);
  for (const OpenPose& pose : touching_poses(placed, p)) {
    const auto at = [&](Index point) { return marked.begin() + (point - path.first_point); };
    std::fill(at(pose.from), at(pose.point) + 1, 1);
  }
  return marked;
}

bool HeadLook::add_touching_keys(const PlacedPaths& placed, std::size_t p, std::vector<Index>& keys) const {
  const Path& path = placed.paths[p];
  const std::size_t before = keys.size();
  for (const OpenPose& pose : touching_poses(placed, p)) {
    const Index key = pose.point - path.first_point;
    for (Index k = std::max(0, key - 1); k <= std::min(path.point_count - 1, key + 1); ++k) keys.push_back(k);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys.size() > before;
}

bool HeadLook::is_free(const PlacedPaths& placed, const Vec3& tip, const Vec3& axis, Index point, Contact* contact) const {
  const Deposit::HeadPose here = pose(placed, tip, axis, point);
  return cell_.head_above_table(tip, axis) &&
         !deposit_.touches_head(cell_.head(), tip, axis, here.free_height, 0.0, here.before, contact);
}

bool HeadLook::raise_may_help(const PlacedPaths& placed, std::size_t p) const {
  const Tolerances& tolerances = cell_.machine().tolerances;
  for (const OpenPose& pose : touching_poses(placed, p)) {
    const Vec3& normal = placed.points[placed.row(pose.point)].normal;
    const Vec3 raised = pose.tip + tolerances.max_raise_mm * normal;
    const std::vector<Vec3> tilted = directions_around(normal, tolerances.max_tilt_deviation.radians());
    const auto free = [&](const Vec3& axis) { return is_free(placed, raised, axis, pose.point, nullptr); };
    if (std::none_of(tilted.begin(), tilted.end(), free)) return false;
  }
  return true;
}

}  // namespace curvesup
