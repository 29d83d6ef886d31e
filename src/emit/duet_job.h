#pragma once

#include <string>
#include <vector>

#include "emit/robot_script.h"
#include "emit/schedule.h"

namespace curvesup::emit {

// What the Duet knows when a chain begins.
struct DuetState {
  Vec3 tip_mm = Vec3::Zero();
  int loaded = -1;          // material whose filament is in the nozzle
  int group = -1;           // printed groups so far - 1
  int source_group = -1;
  Index layer = kNone;
};

// The states before every chain, and after the last.
[[nodiscard]] std::vector<DuetState> duet_states(const std::vector<Chain>& chains);

struct DuetHeader {
  std::string version;
  double layer_height_mm = 0.0;
  double time_s = 0.0;
  std::vector<double> filament_mm;  // by tool
  int layers = 0;
};

[[nodiscard]] std::vector<std::string> write_duet_chains(const Toolpaths& toolpaths, const std::vector<Chain>& chains,
                                                         const std::vector<DuetState>& states,
                                                         const std::vector<Signals>& signals, const Machine& machine,
                                                         const RunContext& run);
[[nodiscard]] std::string duet_header(const DuetHeader& header, const EmitOptions& options, const Machine& machine);
[[nodiscard]] std::string duet_part_start(const Machine& machine, int part, const DuetState& state, long first_signal);
[[nodiscard]] std::string duet_end(const Machine& machine, const DuetState& state, const DuetHeader& header,
                                   long first_signal);

// Filament for the change of material itself: seconds that it takes.
[[nodiscard]] double change_seconds(const Machine& machine, int loaded, int next);
[[nodiscard]] double filament_per_mm3(const Machine& machine, Material material);

}  // namespace curvesup::emit
