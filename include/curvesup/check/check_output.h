#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/motion/machine.h"

namespace curvesup {

// What the emitted programs do, measured on the files.
struct EmittedFigures {
  std::size_t parts = 0, chains = 0, paths = 0, gates = 0;
  std::size_t print_moves = 0, travel_moves = 0;
  std::size_t robot_bytes = 0, duet_bytes = 0;
  double print_mm = 0.0;
  double simulated_s = 0.0, header_s = 0.0;
  double max_chain_mismatch_s = 0.0, max_chunk_mismatch_s = 0.0;
  double max_joint_speed_ratio = 0.0, max_joint_step_rad = 0.0, min_singularity_metric = 1.0;
  double max_tilt_deviation_deg = 0.0;
  double max_polyline_distance_mm = 0.0;     // emitted waypoint to the tip polyline of toolpaths.vtp
  double max_rotation_rad_per_m = 0.0;
  double volume_mm3[kMaterialCount] = {};    // from E of the moves that also have X, Y or Z
};

struct CheckOutputResult {
  bool ok = true;              // all checks are
  std::vector<Check> checks;   // ascending by rule
  EmittedFigures figures;
};

// Re-reads the programs under `out_folder` and proves them: robot/*.script, duet/*, manifest.json, toolpaths.vtp; nothing
// that the run which wrote them had in memory. `machine` is the `machine` section of config.resolved.json.
//
//   Guarantees  every file is read to its end, whatever is wrong in it: a fault is a failed check with file and line,
//               never an exception; the result depends on the files alone, not on the thread count.
//   Errors      input: out_folder, manifest.json or toolpaths.vtp cannot be read, or there is no robot part at all.
//   Cost        linear; about 5 microseconds per pose, 300 bytes per waypoint with its toolpaths.
//
// One check a rule; the numbers are those of the list of properties that emitted programs must have:
//
//   robot   01 program frame            02 bytes, indentation      03 blocks                   04 calls, arity, names
//           05 caps of a part           06 numbers of poses        07 ranges of units          08 tool frame and payload
//           09 blends do not overlap    10 stops                   11 spacing; turns at blends 12 corner cut; blend speed
//           13 rotation vector aliases  14 rotation-limited moves are marked
//           16 inverse kinematics; joint steps                     17 joint limits; joint speed; singularities
//           18 start of a part          20 travels lift             21 clearance of head and arm
//           22 waits end                23 strings                 24 end of a part
//   duet    25 lines                    26 commands                27 prelude                  28 tool and heater
//           29 feeds; flow              30 volume                  31 header                   32 layers
//           33 retraction               34 changes of tool         39 final state
//   both    15 nozzle axis against layer normal                    19 polylines; every path once, in order
//           35 barriers; gates          36 size of chunks          37 same polyline; same speed
//           38 durations of chunks, chains and the whole           40 file names
//           sync_deadlock, sync_overrun: both programs run against each other on one clock, also with a slow extruder board
//           manifest_parts, manifest_offsets, manifest_hashes
//
// Not decidable from files: 41 (same bytes in another locale: run twice) and 42 (that broken files are found: the tests of
// this module). Of 20 only that travels leave and arrive along the nozzle, far enough; what they pass is looked at for 21. 34: that the robot stands at the purge pose is compared with the station of `machine`.
// The helper functions that the scripts define are run in a small interpreter, with and without an answer.
// link.kind = stream has no Duet job: the rules of the job and of both programs together are left out there, and
// with link.kind = telnet the counters are compared instead of levels.
[[nodiscard]] CheckOutputResult check_output(const std::filesystem::path& out_folder, const Machine& machine,
                                             const RunContext& run = {});

// One screen of text: the failed checks with their first places, then the figures.
[[nodiscard]] std::string check_summary(const CheckOutputResult& result);

}  // namespace curvesup
