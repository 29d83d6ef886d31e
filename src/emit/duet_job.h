#pragma once

#include <string>
#include <vector>

#include "emit/schedule.h"

namespace curvesup::emit {

// Numbers of the signals of a chain where the link counts them: one for each barrier side and gate of the job.
struct Signals {
  long first = 1;
  long count = 0;
};

// What the Duet knows when a chain begins.
struct DuetState {
  Vec3 tip_mm = Vec3::Zero();
  int loaded = -1;          // material whose filament is in the nozzle
  int group = -1;           // printed groups so far - 1
  int source_group = -1;
  Index layer = kNone;
};

// The states before every chain, and after the last.
[[nodiscard]] std::vector<DuetState> duet_states(const Motion& motion);

struct DuetHeader {
  std::string version;
  double layer_height_mm = 0.0;
  double time_s = 0.0;
  std::vector<double> filament_mm;  // by tool
  int layers = 0;
};

// chains[i] is chain first + i; `states` and `signals` are of all chains.
[[nodiscard]] std::vector<std::string> write_duet_chains(const Toolpaths& toolpaths, std::size_t first, const std::vector<Chain>& chains,
                                                         const std::vector<DuetState>& states, const std::vector<Signals>& signals,
                                                         const Machine& machine, const RunContext& run);
[[nodiscard]] std::string duet_header(const DuetHeader& header, const EmitOptions& options, const Machine& machine);
// Lines that the Duet runs while the robot waits at a barrier; in print.g, or sent by the robot where the link is `stream`.
[[nodiscard]] std::string part_work(const Machine& machine, const DuetState& state);
[[nodiscard]] std::string change_work(const Machine& machine, int loaded, int next);
[[nodiscard]] std::string chain_start_work(const Machine& machine, Material material);
[[nodiscard]] std::string chain_end_work(const Machine& machine, Material material);
[[nodiscard]] std::string unload_work(const Machine& machine, int loaded);
[[nodiscard]] std::string finish_work(const Machine& machine);

[[nodiscard]] std::string duet_part_start(const Machine& machine, int part, const DuetState& state, long first_signal);
[[nodiscard]] std::string duet_end(const Machine& machine, const DuetState& state, const DuetHeader& header,
                                   long first_signal);

// Filament for the change of material itself: seconds that it takes.
[[nodiscard]] double change_seconds(const Machine& machine, int loaded, int next);
// Where the robot sends all commands, the job on the Duet only describes the print.
[[nodiscard]] std::string duet_end_of_stream_job(const DuetHeader& header);

[[nodiscard]] double filament_per_mm3(const Machine& machine, Material material);

}  // namespace curvesup::emit
