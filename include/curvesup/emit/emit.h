#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/io/text_file.h"
#include "curvesup/motion/machine.h"
#include "curvesup/motion/motion.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

struct EmitOptions {
  std::string title = "print";       // printed into comments; other bytes than letters, digits and _.- become _
  double layer_height_mm = 0.0;      // for the header of the Duet job; 0: the median bead height of the toolpaths
  double stop_lift_mm = 30.0;        // along the nozzle axis, before the robot halts on a timeout
  double stop_margin_s = 0.2;        // a gate stays at its level at least this long after a stop of both machines
  double max_ahead_s = 0.04;         // that corners cut by blends may save the robot before it waits for the Duet at a stop
  std::filesystem::path spool_folder;  // where text waits until the files are written; empty: in memory
};

struct EmittedFile {
  std::string name;  // below the output folder, e.g. "robot/part_0001.script"
  std::string description;
  std::function<void(const ByteSink&)> write;  // hands out the text in pieces, any number of times, in any thread
};

[[nodiscard]] std::string text_of(const EmittedFile& file);

// A path, or one section of it, that a part prints.
struct EmittedChain {
  Index path = 0;
  int section = 0, sections = 1;
};

struct EmittedPart {
  std::string file;
  std::vector<EmittedChain> chains;  // in print order
  double expected_s = 0.0;           // without heating
  std::size_t duet_offset = 0;       // byte in duet/print.g at which this part starts (line ";PART:n"), for resuming
  int moves = 0;
};

struct EmitReport {
  double time_s = 0.0;                                // as in the header of the Duet job
  double filament_mm[kMaterialCount] = {};            // printing, purging and priming together, as in the header
  double printed_filament_mm[kMaterialCount] = {};    // of the moves that also have X, Y or Z
  double printed_volume_mm3[kMaterialCount] = {};
  int material_changes = 0;                           // without the first load
  int layers = 0;                                     // printed groups
  std::size_t moves = 0, gates = 0;
  std::size_t tight_gates = 0;                        // gates with less than stop_margin_s after a stop
  std::size_t stops = 0;                              // inside chains: both machines stop
  double max_chunk_mismatch_s = 0.0;
  double max_flow_ratio = 0.0;                        // volume per second of a move, of the filament's max_flow_mm3_s
  std::vector<Check> checks;
};

struct EmittedFiles {
  std::vector<EmittedFile> files;
  std::vector<EmittedPart> parts;
  EmitReport report;
};

// Writes the programs of arm and extruder board for `motion`. The files hold all they need: the arguments may go.
//   Guarantees  no part above the caps of machine.program; every chain of `motion` in exactly one part, in order; the
//               bytes depend on the arguments only, not on locale or thread count; ASCII, LF.
//   Errors      usage: a chain is above the caps; internal: motion breaks its contract (no purge travel at a change of
//               material); output: no room in the spool folder.
//   Cost        linear; about 170 bytes per waypoint in the spool folder, in memory those of 512 chains.
//
// The two programs and their meeting points
// -----------------------------------------
// n, m, g, i are the numbers in machine.link; with the defaults: robot_start_output n = 0, robot_gate_output g = 2,
// robot_acknowledge_input i = 0, Duet barrier input P0, gate input P2, acknowledge output P0. All that follows is for
// link.kind = dio; the other links are described at the end. Waypoints of `motion` become one movep and one G1 each; a move
// that lasts longer than a chunk may, or that is long and follows a stop closely, is divided evenly on both sides.
//
//   BARRIER PAIR        robot                                            Duet
//     start             set_standard_digital_out(n, True)                M400
//                                                                        M577 P0 S1
//                                                                        <work>
//                       wait_acknowledge(True, seconds)                  M42 P0 S1        (fires after the work's moves)
//     between           <moves>                                          <moves>
//     end               set_standard_digital_out(n, False)               M400
//                                                                        M577 P0 S0
//                                                                        <work>
//                       wait_acknowledge(False, seconds)                 M42 P0 S0
//   There are three kinds of barrier pair, and both files hold the same sequence of them:
//     part    first in every part. Start work: temperatures, tool, M116. No moves between, no end work.
//     change  robot at the purge station. Start work: un-retract and unload the loaded filament, T, M116, load, prime,
//             retract, fan. No moves between, no end work. The last one of the job (comment "unload") only unloads.
//     chain   start work: un-retract. Between: the printing moves. End work: retract.
//
//   GATES of a chain. The moves are divided into chunks 0, 1, ... c - 1 of at most link.gate_moves moves and
//   link.gate_interval_s seconds. Gate j (1 <= j < c) lies before chunk j on the Duet: "M577 P2 S<j odd ? 1 : 0>" without
//   M400. The robot sets gate j + 1 when it enters chunk j: "set_standard_digital_out(g, <j + 1 odd>)" directly before
//   the first movep of chunk j. The level stays for the whole chunk, and at least stop_margin_s of it lie behind the
//   chunk's last stop, so that a Duet that comes a little late from M400 still sees it (report.tight_gates counts the
//   chunks whose stops are too dense for that).
//
//   RESETS on the robot that answer nothing: n and g to False at the beginning and at the end of each part and inside
//   lift_and_halt; g to False after each end acknowledge of a chain. On the Duet: M42 P0 S0 after each ;PART.
//
//   STOPS. A waypoint inside a chain with r = 0 stops both: the Duet job has M400 between the two moves. Where a gate
//   lies at the same waypoint, M577 comes before M400. The robot then stands for the time that its blends have saved since
//   the stop before ("sleep(s)" behind the movep, before a gate), so that it never is further ahead than max_ahead_s: where
//   no stop comes soon enough, a blend becomes one.
//
//   TIME. Chain: sum over its moves of length / (F / 60), plus v / a per stretch between two stops (start and end of the
//   chain are stops; half at its first, half at its last move), the same for both machines, except that the robot saves
//   (2 r - R phi) / v, R = r / tan(phi / 2), at a blend of turn phi. Travels: Travel::duration_s. E-only moves:
//   length / F. Acknowledges, M116 and macros: 0.
//
// robot/part_NNNN.script, N from 0001. Lines, each but the first and the last one or two indented:
//   def part_NNNN():
//    # <title> part N of M, machine <name>
//    set_tcp(p[..6])                                   metres, rotation vector; 6 decimals
//    set_payload(kg, [x, y, z])
//    set_standard_digital_out(n, False)  and  (g, False)
//    set_runstate_standard_digital_output_to_value(1, 3)
//    def lift_and_halt(message): ... end              outputs to 0, movel up, textmsg, popup, halt
//    def wait_acknowledge(level, seconds): ... end     loop with sleep; on timeout lift_and_halt
//    wait_acknowledge(False, s)                        acknowledge is 0 before anything starts: no barrier
//    movej(..)                                         to the start of the part: home (part 1) or above the last path
//    # barrier part N  + barrier pair
//   then per chain:
//    movej / movel lines of its travels that lift      (step lift; where a part ends before a chain, these are the last
//                                                       moves of the part before, and the next part starts there)
//    # path P section S of C layer K group G model|support      S from 1, K and G as in ;K: and ;LAYER:
//    movej / movel lines of the other travels; after the one that reaches the purge station, if the material changes:
//    # barrier change tool T  + barrier pair
//    # barrier path P section S  + start of the barrier pair
//    movep(p[..6], a=, v=, r=)  per waypoint but the first, with gates between; "# rotation" at the line's end marks a
//                                                       rotation-limited move: v is raised above F, see Waypoint
//    end of the barrier pair, set_standard_digital_out(g, False)
//   last part: the final travels, # barrier unload + barrier pair
//    resets, set_runstate_standard_digital_output_to_value(1, 0)    so that the Duet does not pause between parts
//    textmsg("curvesup part NNNN finished")
//   end
//   part_NNNN()                                        only in the form `file`
// movej has the form movej([q1..q6], a=, v=), or movej(get_inverse_kin(p[..6], [q1..q6]), a=, v=) where it ends at the first
// waypoint of a chain; movel(p[..6], a=, v=). Travels always end at a stop. Positions 7 decimals, rotation vectors 6, joints 6, v 7, r 6.
//
// duet/print.g. Comment lines and command lines; coordinates are nozzle tips in the platform frame, mm, 4 decimals:
//   header     ; generated by curvesup <version>   ; layer_height = h   ; filament used [mm] = a, b (by tool number)
//              ; estimated printing time (normal mode) = 1h 2m 3s   ;TIME:s
//   per part   ;PART:N                 the byte offset of this line is the part's entry
//              M42 P0 S0               reset
//              M400 / M577 P0 S1       part barrier, with the work:
//              G21 G90 M83 M564 H0 S0 M204 P T, G92 X Y Z (where the Duet stands: no shift when read from the beginning),
//              G10 P<tool> S R for each tool, T<tool> P0 and M116 P<tool> when a filament is loaded, M106 P<fan> S
//              M42 P0 S1 / M400 / M577 P0 S0 / M42 P0 S0
//   per chain  change block, if any: ;CHANGE:T then the barrier pair
//              ;LAYER:n (at a new group, counted 0, 1, ...) and ;K:k (after it, and when k changes inside a group)
//              ;PATH:P section S of C    ;TYPE:...
//              G0 X Y Z F              unless the Duet stands there
//              M400 / M577 P0 S1 / G1 E<retract> F / M42 P0 S1
//              G1 X Y Z E F            one per movep, same order; E 6 decimals; F when it changes
//              M400 / M577 P0 S0 / G1 E-<retract> F / M42 P0 S0
//   end        ;END, unload barrier pair, M400, M106 P S0, G10 P S0 R0, T-1 P0, M83; footer: ; num_layers = n, and the time
//
// link.kind = telnet: no inputs and outputs but the run state; both sides count signals from 1 over the whole job, one for
// the start and one for the end of a change or chain barrier pair, one for each gate, in the order of the job. Robot: at a
// barrier exchange("set global.rc=K", "rc K", seconds), which repeats the command each second until the answer comes; at a
// gate "gate = K", which a thread sends. Duet: "while global.rc < K" / "  G4 P4" after M400, for a gate without M400 and
// with "  set global.rw = 0"; acknowledge M400 / M118 P4 S"<rc K>". Part barrier: exchange("set global.rpart=N", "part N",
// seconds) against set global.rpart = 0 / while global.rpart != N / set global.rc = <K before> / work / answer.
//
// link.kind = stream: duet/print.g holds comments only, offsets are 0; the robot sends the work lines and, while it moves,
// one "G1 X E F" for each chunk one chunk ahead: X is the way along the chain from 0, the time that of the chunk.
[[nodiscard]] EmittedFiles emit_robot(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine,
                                      const EmitOptions& options = {}, const RunContext& run = {});

// The format that existing post-processors of curved-layer toolpaths read: one file a path, "waypoints/00001.txt" for
// path 0, support files end in "S.txt"; rows "x y z nx ny nz E jump model": nozzle tip in mm, z up; nozzle axis away
// from the part; filament so far in this file in mm, first row 0; jump 1 on the first row of a section; model 1 = part,
// 0 = support. Rows are the waypoints of `motion`; where it has none, the points of the toolpaths with their normals.
// Rows are made when a file is written: until then the arguments must stay.
[[nodiscard]] std::vector<EmittedFile> emit_waypoints(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine);

}  // namespace curvesup
