#include "motion/placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/parallel.h"
#include "motion/nozzle_axis.h"

namespace curvesup {
namespace {

constexpr std::size_t kSamples = 400;
constexpr int kTurns = 8;
constexpr double kShift_mm = 40.0;

struct Score {
  std::size_t reached = 0;
  double comfort = 0.0;   // mean singularity metric, in steps of 0.02
  double distance = 0.0;  // that the part is moved, a turn counting as its radius
};

bool better(const Score& a, const Score& b) {
  if (a.reached != b.reached) return a.reached > b.reached;
  if (a.comfort != b.comfort) return a.comfort > b.comfort;
  return a.distance < b.distance;
}

// Best singularity metric of a pose over all postures; negative when there is none.
double best_metric(const Cell& cell, const Vec3& tip, const Vec3& axis, int yaw_samples) {
  double best = -1.0;
  for (const double yaw : yaw_values(yaw_samples)) {
    const IkSolutions solutions = inverse_kinematics(cell.machine().arm, cell.flange_frame(tip, axis, yaw));
    for (int i = 0; i < solutions.count; ++i) {
      double metric = 0.0;
      if (cell.arm_fault(solutions.joints[i], &metric) == ArmFault::none) best = std::max(best, metric);
    }
    if (best > 0.6) break;
  }
  return best;
}

}  // namespace

PartPlacement place_part(const Toolpaths& toolpaths, const Cell& cell, const MotionOptions& options,
                         const RunContext& run) {
  if (cell.machine().place == Placement::as_modelled || toolpaths.points.empty()) return {};
  Vec3 low = toolpaths.points[0].position, high = low;
  for (const PathPoint& point : toolpaths.points) {
    low = low.cwiseMin(point.position);
    high = high.cwiseMax(point.position);
  }
  const Vec3 centre(0.5 * (low.x() + high.x()), 0.5 * (low.y() + high.y()), 0.0);
  double radius = 0.0;
  for (const PathPoint& point : toolpaths.points) radius = std::max(radius, (point.position - centre).head<2>().norm());

  std::vector<std::size_t> samples;
  const std::size_t step = std::max<std::size_t>(1, toolpaths.points.size() / kSamples);
  for (std::size_t i = 0; i < toolpaths.points.size(); i += step) samples.push_back(i);

  std::vector<PartPlacement> candidates;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = 2.0 * std::numbers::pi * turn / kTurns;
    const Vec3 turned = Eigen::AngleAxisd(angle, Vec3::UnitZ()) * centre;
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        const Vec3 shift(x * kShift_mm, y * kShift_mm, 0.0);
        const bool fits = shift.norm() + radius <= cell.machine().platform.radius_mm;
        if (fits || (x == 0 && y == 0)) candidates.push_back({shift - turned, angle});
      }
    }
  }
  std::vector<Score> scores(candidates.size());
  parallel_for(candidates.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t c = begin; c < end; ++c) {
      const Mat3 turn = Eigen::AngleAxisd(candidates[c].rotation_rad, Vec3::UnitZ()).toRotationMatrix();
      double sum = 0.0;
      for (const std::size_t i : samples) {
        const PathPoint& point = toolpaths.points[i];
        const Vec3 axis = turn * point.normal;
        const Vec3 tip = turn * point.position + candidates[c].offset_mm + point.tip_offset_mm * axis;
        const double metric = best_metric(cell, tip, axis, options.yaw_samples / 2);
        scores[c].reached += metric >= 0.0;
        sum += std::max(0.0, metric);
      }
      scores[c].comfort = std::round(50.0 * sum / static_cast<double>(samples.size())) / 50.0;
      const double turned = std::abs(std::remainder(candidates[c].rotation_rad, 2.0 * std::numbers::pi));
      scores[c].distance = (turn * centre + candidates[c].offset_mm - centre).norm() + radius * turned;
    }
  });
  std::size_t best = 0;
  for (std::size_t c = 1; c < scores.size(); ++c) {
    if (better(scores[c], scores[best])) best = c;
  }
  return candidates[best];
}

}  // namespace curvesup
