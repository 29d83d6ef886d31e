#include "curvesup/emit/emit.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "emit/companions.h"
#include "emit/duet_job.h"
#include "emit/robot_script.h"
#include "emit/schedule.h"
#include "emit/text.h"

namespace curvesup {

namespace {

using namespace emit;

// Only letters, digits and _.- reach the programs.
std::string plain_text(const std::string& text) {
  std::string plain = text.substr(0, 60);
  for (char& c : plain) {
    const bool keep = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '.' || c == '-';
    if (!keep) c = '_';
  }
  return plain.empty() ? "print" : plain;
}

double median_height(const Toolpaths& toolpaths) {
  std::vector<double> heights;
  heights.reserve(toolpaths.points.size());
  for (const PathPoint& point : toolpaths.points) {
    if (point.volume_mm3 > 0.0) heights.push_back(point.height_mm);
  }
  if (heights.empty()) return 0.0;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

// Signals of the chains that follow those numbered so far.
void number_signals(const std::vector<Chain>& chains, std::vector<Signals>& signals) {
  for (const Chain& chain : chains) {
    const long gates = std::max<long>(0, static_cast<long>(chain.chunks.size()) - 1);
    signals.back().count = (chain.motion->material_change_before ? 2 : 0) + 2 + gates;
    signals.push_back({signals.back().first + signals.back().count, 0});
  }
}

// A part: the chains first .. last - 1.
struct Part {
  std::size_t first = 0, last = 0;
  int moves = 0;
};

// As many chains as the caps allow in each part; the lift from a part's last chain and the job's end count too.
std::vector<Part> pack_parts(const std::vector<RobotChain>& chains, const RobotChain& end, std::size_t frame_bytes,
                             const ProgramLimits& limits) {
  std::vector<Part> parts;
  const auto max_bytes = static_cast<std::size_t>(limits.max_bytes_per_part);
  const auto lift_after = [&](std::size_t i) {
    return i + 1 < chains.size() ? std::pair{chains[i + 1].lift.size(), chains[i + 1].lift_moves}
                                 : std::pair{end.body.size(), end.body_moves};
  };
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const RobotChain& chain = chains[i];
    const auto [tail_bytes, tail_moves] = lift_after(i);
    const bool fits = !parts.empty() &&
                      bytes + chain.lift.size() + chain.body.size() + tail_bytes <= max_bytes &&
                      parts.back().moves + chain.lift_moves + chain.body_moves + tail_moves <= limits.max_moves_per_part;
    if (fits) {
      bytes += chain.lift.size() + chain.body.size();
      parts.back().moves += chain.lift_moves + chain.body_moves;
    } else {
      if (!parts.empty()) parts.back().moves += chain.lift_moves;
      const bool first = parts.empty();
      parts.push_back({i, i, 1 + chain.body_moves + (first ? chain.lift_moves : 0)});
      bytes = frame_bytes + chain.body.size() + (first ? chain.lift.size() : 0);
      if (bytes + tail_bytes > max_bytes || parts.back().moves + tail_moves > limits.max_moves_per_part) {
        throw Error(ErrorKind::internal, "emit, chain " + std::to_string(i),
                    format("%d moves and %zu bytes do not fit into a part", parts.back().moves + tail_moves, bytes + tail_bytes),
                    "raise machine.program.max_moves_per_part or max_bytes_per_part");
      }
    }
    parts.back().last = i + 1;
  }
  if (!parts.empty()) parts.back().moves += end.body_moves;
  return parts;
}

// Seconds of the work at the barriers of a chain.
double work_seconds(const PathMotion& path, int loaded_before, const Machine& machine) {
  const Filament& filament = machine.filaments[static_cast<std::size_t>(path.material)];
  double seconds = 2.0 * filament.retract_mm / filament.retract_mm_s;
  if (path.material_change_before) seconds += change_seconds(machine, loaded_before, static_cast<int>(path.material));
  return seconds;
}

// Everything that both files are made of.
struct Program {
  std::vector<Signals> signals;
  std::vector<DuetState> states;
  std::vector<RobotChain> robot;
  RobotChain robot_end;
  std::vector<std::string> duet;
  std::vector<Part> parts;
};

void count_chain(const Chain& chain, const RobotChain& robot, int loaded, const Machine& machine, EmitReport& report) {
  const auto material = static_cast<std::size_t>(chain.motion->material);
  const double max_flow = machine.filaments[material].max_flow_mm3_s;
  for (const Move& move : chain.moves) {
    report.printed_volume_mm3[material] += move.volume_mm3;
    if (move.duration_s > 0.0) report.max_flow_ratio = std::max(report.max_flow_ratio, move.volume_mm3 / (move.duration_s * max_flow));
  }
  if (chain.motion->material_change_before) {
    const Filament& next = machine.filaments[material];
    const bool same_tool = loaded >= 0 && machine.filaments[static_cast<std::size_t>(loaded)].tool == next.tool;
    if (loaded >= 0) ++report.material_changes;
    if (loaded >= 0 && !same_tool) report.filament_mm[loaded] -= machine.filaments[static_cast<std::size_t>(loaded)].unload_mm;
    if (!same_tool) report.filament_mm[material] += next.load_mm + next.purge_mm;
  }
  report.time_s += robot.lift_s + robot.body_s + work_seconds(*chain.motion, loaded, machine);
  report.moves += chain.moves.size();
  report.gates += chain.chunks.empty() ? 0 : chain.chunks.size() - 1;
  report.tight_gates += static_cast<std::size_t>(chain.tight_gates);
  report.stops += static_cast<std::size_t>(chain.stops);
  report.max_chunk_mismatch_s = std::max(report.max_chunk_mismatch_s, chain.max_mismatch_s);
}

void count_end(const Program& program, const Machine& machine, EmitReport& report) {
  const int loaded = program.states.back().loaded;
  if (loaded >= 0) report.filament_mm[loaded] -= machine.filaments[static_cast<std::size_t>(loaded)].unload_mm;
  report.time_s += program.robot_end.body_s + change_seconds(machine, loaded, -1);
  report.layers = program.states.back().group + 1;
  for (int m = 0; m < kMaterialCount; ++m) {
    report.printed_filament_mm[m] = report.printed_volume_mm3[m] * filament_per_mm3(machine, static_cast<Material>(m));
    report.filament_mm[m] += report.printed_filament_mm[m];
  }
}

// Some chains at a time: their moves are several times as large as their text.
Program write_chains(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine, const EmitOptions& options,
                     const RunContext& run, EmitReport& report) {
  constexpr std::size_t kTogether = 512;
  const std::size_t count = motion.paths.size();
  Program program;
  program.states = duet_states(motion);
  program.signals.reserve(count + 1);
  program.signals.emplace_back();
  program.robot.reserve(count);
  if (machine.link.kind != DuetLink::stream) program.duet.reserve(count);
  for (std::size_t first = 0; first < count; first += kTogether) {
    const std::vector<Chain> chains =
        schedule_chains(motion, first, std::min(kTogether, count - first), machine, options, run);
    number_signals(chains, program.signals);
    write_robot_chains(motion, first, chains, program.states, program.signals, machine, run, program.robot);
    if (machine.link.kind != DuetLink::stream) {
      write_duet_chains(toolpaths, first, chains, program.states, program.signals, machine, run, program.duet);
    }
    for (std::size_t i = 0; i < chains.size(); ++i) {
      count_chain(chains[i], program.robot[first + i], program.states[first + i].loaded, machine, report);
    }
    run.progress(0.9 * static_cast<double>(first) / static_cast<double>(count));
  }
  program.robot_end = write_robot_end(motion, program.states.back(), machine, program.signals.back().first);
  const DuetState widest{.tip_mm = Vec3::Constant(-1000.0), .loaded = 0};
  const std::size_t frame = robot_part_header(machine, options, 99999, 99999, widest, Joints{-6, -6, -6, -6, -6, -6}).size() +
                            robot_part_footer(machine, 99999).size();
  program.parts = pack_parts(program.robot, program.robot_end, frame, machine.program);
  count_end(program, machine, report);
  run.progress(0.9);
  return program;
}

DuetHeader make_header(const Toolpaths& toolpaths, const Machine& machine, const EmitOptions& options, const EmitReport& report) {
  DuetHeader header;
  header.version = CURVESUP_VERSION;
  header.layer_height_mm = options.layer_height_mm > 0.0 ? options.layer_height_mm : median_height(toolpaths);
  header.time_s = report.time_s;
  header.layers = report.layers;
  for (int m = 0; m < kMaterialCount; ++m) {
    const auto tool = static_cast<std::size_t>(machine.filaments[static_cast<std::size_t>(m)].tool);
    if (header.filament_mm.size() <= tool) header.filament_mm.resize(tool + 1, 0.0);
    header.filament_mm[tool] += report.filament_mm[m];
  }
  return header;
}

// The text of its chains goes over into the file.
EmittedFile robot_file(Program& program, std::size_t index, const Machine& machine, const EmitOptions& options) {
  const Part& part = program.parts[index];
  const int number = static_cast<int>(index) + 1;
  const int parts = static_cast<int>(program.parts.size());
  EmittedFile file{"robot/part_" + padded(number, 4) + ".script", {},
                   format("robot program, part %d of %d", number, parts)};
  std::string& text = file.content;
  const RobotChain* first = &program.robot[part.first];
  std::size_t size = 8192;
  for (std::size_t i = part.first; i < part.last; ++i) size += program.robot[i].lift.size() + program.robot[i].body.size();
  text.reserve(size);
  text += robot_part_header(machine, options, number, parts, program.states[part.first],
                            index == 0 ? home_joints(machine) : first->start);
  for (std::size_t i = part.first; i < part.last; ++i) {
    if (i > part.first || index == 0) text += program.robot[i].lift;
    text += program.robot[i].body;
    std::string().swap(program.robot[i].lift);
    std::string().swap(program.robot[i].body);
  }
  text += index + 1 < program.parts.size() ? program.robot[part.last].lift : program.robot_end.body;
  text += robot_part_footer(machine, number);
  return file;
}

std::string duet_file(Program& program, const Machine& machine, const EmitOptions& options, const DuetHeader& header,
                      std::vector<EmittedPart>& parts) {
  std::string text;
  std::size_t size = 8192;
  for (const std::string& chain : program.duet) size += chain.size();
  text.reserve(size + 1000 * program.parts.size());
  text += duet_header(header, options, machine);
  if (machine.link.kind == DuetLink::stream) return text + duet_end_of_stream_job(header);
  for (std::size_t p = 0; p < program.parts.size(); ++p) {
    const Part& part = program.parts[p];
    parts[p].duet_offset = text.size();
    text += duet_part_start(machine, static_cast<int>(p) + 1, program.states[part.first], program.signals[part.first].first);
    for (std::size_t i = part.first; i < part.last; ++i) {
      text += program.duet[i];
      std::string().swap(program.duet[i]);
    }
  }
  text += duet_end(machine, program.states.back(), header, program.signals.back().first);
  return text;
}

std::vector<EmittedPart> part_table(const Program& program, const Motion& motion, const Machine& machine) {
  std::vector<EmittedPart> table;
  for (std::size_t p = 0; p < program.parts.size(); ++p) {
    const Part& part = program.parts[p];
    EmittedPart row;
    row.file = "robot/part_" + padded(static_cast<int>(p) + 1, 4) + ".script";
    row.moves = part.moves;
    for (std::size_t i = part.first; i < part.last; ++i) {
      const PathMotion& path = motion.paths[i];
      row.chains.push_back({path.path, path.section, path.sections});
      row.expected_s += program.robot[i].body_s + work_seconds(path, program.states[i].loaded, machine);
      if (i > part.first || p == 0) row.expected_s += program.robot[i].lift_s;
    }
    row.expected_s += part.last < program.robot.size()
                          ? program.robot[part.last].lift_s
                          : program.robot_end.body_s + change_seconds(machine, program.states.back().loaded, -1);
    table.push_back(std::move(row));
  }
  return table;
}

void add_checks(const Toolpaths& toolpaths, const Machine& machine, const EmittedFiles& out, EmitReport& report) {
  double volume[kMaterialCount] = {};
  for (const Path& path : toolpaths.paths) {
    for (Index i = 0; i < path.point_count; ++i) {
      volume[static_cast<int>(path.material)] += toolpaths.points[static_cast<std::size_t>(path.first_point + i)].volume_mm3;
    }
  }
  double worst = 0.0;
  for (int m = 0; m < kMaterialCount; ++m) {
    if (volume[m] > 0.0) worst = std::max(worst, std::abs(report.printed_volume_mm3[m] / volume[m] - 1.0));
  }
  report.checks.push_back(check_at_most("emit.volume", worst, 1e-6, "bead volume of the programs against the toolpaths, relative"));
  std::size_t over = 0;
  for (std::size_t p = 0; p < out.parts.size(); ++p) {
    over += out.files[p].content.size() > static_cast<std::size_t>(machine.program.max_bytes_per_part) ||
            out.parts[p].moves > machine.program.max_moves_per_part;
  }
  report.checks.push_back(check_equal("emit.parts_over_cap", static_cast<double>(over), 0.0, "robot parts above a cap"));
  report.checks.push_back(check_at_most("emit.chunk_mismatch_s", report.max_chunk_mismatch_s, 0.05,
                                        "robot against Duet by the time model, longest difference of a chunk"));
  report.checks.push_back(check_at_most("emit.flow_ratio", report.max_flow_ratio, 1.0 + 1e-6,
                                        "bead volume per second of a move, of the filament's largest flow"));
}

}  // namespace

EmittedFiles emit_robot(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine,
                        const EmitOptions& requested, const RunContext& run) {
  EmitOptions options = requested;
  options.title = plain_text(requested.title);
  EmittedFiles out;
  Program program = write_chains(toolpaths, motion, machine, options, run, out.report);
  out.parts = part_table(program, motion, machine);
  out.files.reserve(program.parts.size() + 16);
  for (std::size_t p = 0; p < program.parts.size(); ++p) out.files.push_back(robot_file(program, p, machine, options));
  const DuetHeader header = make_header(toolpaths, machine, options, out.report);
  out.files.push_back({"duet/print.g", duet_file(program, machine, options, header, out.parts), "job for the Duet board, in step with robot/"});
  out.files.push_back({"duet/config_snippet.g", config_snippet(machine), "what config.g of the Duet needs once"});
  for (EmittedFile& macro : tool_macros(machine)) out.files.push_back(std::move(macro));
  out.files.push_back({"robot/play_parts.py", player_script(), "sends the parts to the robot one after another"});
  out.files.push_back({"OPERATOR.md", operator_page(machine, options, out.parts, out.report), "wiring, calibration, stop and resume"});
  add_checks(toolpaths, machine, out, out.report);
  run.progress(1.0);
  return out;
}

}  // namespace curvesup
