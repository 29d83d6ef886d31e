#pragma once

#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/emit/emit.h"

// What both programs share: the moves of every chain as they are written, and their division into chunks.
namespace curvesup::emit {

// One printing move, to `tip_mm` / `pose`.
struct Move {
  Vec3 tip_mm = Vec3::Zero();
  Pose pose;
  double length_mm = 0.0;
  double speed_mm_s = 0.0;    // of the robot
  double feed_mm_s = 0.0;     // of the Duet: the intended speed
  double duration_s = 0.0;    // length over feed
  double blend_mm = 0.0;      // at its end; 0: both machines stop there
  double volume_mm3 = 0.0;
  double saved_s = 0.0;       // by the robot in the blend at its end
  double rest_s = 0.0;        // for which the robot stands at its end, a stop, so that the Duet comes up
  bool rotation_limited = false;
};

struct Chain {
  const PathMotion* motion = nullptr;
  Vec3 start_tip_mm = Vec3::Zero();
  std::vector<Move> moves;
  std::vector<int> chunks;    // first move of each
  double duet_s = 0.0;        // of the moves, with v / a at stops
  double max_mismatch_s = 0.0;
  int tight_gates = 0;
  int stops = 0;

  [[nodiscard]] bool stop_before(int move) const { return move > 0 && moves[static_cast<std::size_t>(move) - 1].blend_mm == 0.0; }
};

// The chains first .. first + count - 1 of `motion`. Moves longer than a chunk may last are divided evenly.
[[nodiscard]] std::vector<Chain> schedule_chains(const Motion& motion, std::size_t first, std::size_t count,
                                                 const Machine& machine, const EmitOptions& options,
                                                 const RunContext& run);

}  // namespace curvesup::emit
