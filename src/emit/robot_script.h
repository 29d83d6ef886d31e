#pragma once

#include <string>
#include <vector>

#include "emit/duet_job.h"
#include "emit/schedule.h"

namespace curvesup::emit {

// Script of one chain: lift, then body. The lift leaves the chain before; a part may end between the two.
struct RobotChain {
  std::string text;
  std::size_t lift_bytes = 0, body_bytes = 0;
  int lift_moves = 0, body_moves = 0;
  double lift_s = 0.0, body_s = 0.0;   // travel and printing; not the work at barriers
  Joints start{};                      // where the arm stands between lift and body
};

// chains[i] is chain first + i of `motion`; `states` and `signals` are of all chains.
[[nodiscard]] std::vector<RobotChain> write_robot_chains(const Motion& motion, std::size_t first, const std::vector<Chain>& chains,
                                                         const std::vector<DuetState>& states, const std::vector<Signals>& signals,
                                                         const Machine& machine, const RunContext& run);

[[nodiscard]] Joints home_joints(const Machine& machine);

// The final travels and the unload block.
[[nodiscard]] RobotChain write_robot_end(const Motion& motion, const DuetState& state, const Machine& machine,
                                         long first_signal);

// Everything of part `part` (from 1) before the first body, and after the last.
[[nodiscard]] std::string robot_part_header(const Machine& machine, const EmitOptions& options, int part, int parts,
                                            const DuetState& state, const Joints& start);
[[nodiscard]] std::string robot_part_footer(const Machine& machine, int part);

}  // namespace curvesup::emit
