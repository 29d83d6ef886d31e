#include "curvesup/emit/emit.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/io/spool.h"
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
    return i + 1 < chains.size() ? std::pair{chains[i + 1].lift_bytes, chains[i + 1].lift_moves}
                                 : std::pair{end.body_bytes, end.body_moves};
  };
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < chains.size(); ++i) {
    const RobotChain& chain = chains[i];
    const auto [tail_bytes, tail_moves] = lift_after(i);
    const bool fits = !parts.empty() && bytes + chain.lift_bytes + chain.body_bytes + tail_bytes <= max_bytes &&
                      parts.back().moves + chain.lift_moves + chain.body_moves + tail_moves <= limits.max_moves_per_part;
    if (fits) {
      bytes += chain.lift_bytes + chain.body_bytes;
      parts.back().moves += chain.lift_moves + chain.body_moves;
    } else {
      if (!parts.empty()) parts.back().moves += chain.lift_moves;
      const bool first = parts.empty();
      parts.push_back({i, i, 1 + chain.body_moves + (first ? chain.lift_moves : 0)});
      bytes = frame_bytes + chain.body_bytes + (first ? chain.lift_bytes : 0);
      if (bytes + tail_bytes > max_bytes || parts.back().moves + tail_moves > limits.max_moves_per_part) {
        const bool by_bytes = bytes + tail_bytes > max_bytes;
        const std::size_t moves = static_cast<std::size_t>(parts.back().moves + tail_moves);
        throw Error(ErrorKind::usage, std::string("config key machine.program.") + (by_bytes ? "max_bytes_per_part" : "max_moves_per_part"),
                    format("chain %zu of the robot's program takes %zu moves and %zu bytes, more than a part may have", i, moves,
                           bytes + tail_bytes),
                    format("set it to %zu or more", by_bytes ? bytes + tail_bytes : moves));
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

// Everything that the files are made of. The spools hold the chains one after the other; what a part needs of them is one
// piece: from the body of its first chain to the lift of the next part's, so that headers and ends need not be kept.
struct Program {
  Program(const Machine& for_machine, const EmitOptions& with)
      : machine(for_machine), options(with), robot_text(with.spool_folder), duet_text(with.spool_folder) {}

  Machine machine;
  EmitOptions options;
  std::vector<Signals> signals;
  std::vector<DuetState> states;
  std::vector<RobotChain> robot;  // their text is in the spool
  RobotChain robot_end;
  Spool robot_text, duet_text;
  std::vector<std::uint64_t> robot_at, duet_at;  // where the text of each chain begins, and where the last one ends
  std::vector<Part> parts;
  DuetHeader header;
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

void put_aside(std::string& text, Spool& spool, std::vector<std::uint64_t>& at) {
  spool.append(text);
  at.push_back(spool.size());
  std::string().swap(text);
}

// Some chains at a time: their moves are several times as large as their text.
void write_chains(const Toolpaths& toolpaths, const Motion& motion, const RunContext& run, Program& program, EmitReport& report) {
  constexpr std::size_t kTogether = 512;
  const Machine& machine = program.machine;
  const bool board = machine.link.kind != DuetLink::stream;
  const std::size_t count = motion.paths.size();
  program.states = duet_states(motion);
  program.signals.reserve(count + 1);
  program.signals.emplace_back();
  program.robot.reserve(count);
  program.robot_at.assign(1, 0);
  program.duet_at.assign(1, 0);
  for (std::size_t first = 0; first < count; first += kTogether) {
    const std::vector<Chain> chains =
        schedule_chains(motion, first, std::min(kTogether, count - first), machine, program.options, run);
    number_signals(chains, program.signals);
    for (RobotChain& chain : write_robot_chains(motion, first, chains, program.states, program.signals, machine, run)) {
      put_aside(chain.text, program.robot_text, program.robot_at);
      program.robot.push_back(std::move(chain));
    }
    if (board) {
      for (std::string& chain : write_duet_chains(toolpaths, first, chains, program.states, program.signals, machine, run)) {
        put_aside(chain, program.duet_text, program.duet_at);
      }
    }
    for (std::size_t i = 0; i < chains.size(); ++i) {
      count_chain(chains[i], program.robot[first + i], program.states[first + i].loaded, machine, report);
    }
    run.progress(0.9 * static_cast<double>(first) / static_cast<double>(count));
  }
  program.robot_end = write_robot_end(motion, program.states.back(), machine, program.signals.back().first);
  put_aside(program.robot_end.text, program.robot_text, program.robot_at);
  count_end(program, machine, report);
}

DuetHeader make_header(const Toolpaths& toolpaths, const Program& program, const EmitReport& report) {
  DuetHeader header;
  header.version = CURVESUP_VERSION;
  header.layer_height_mm = program.options.layer_height_mm > 0.0 ? program.options.layer_height_mm : median_height(toolpaths);
  header.time_s = report.time_s;
  header.layers = report.layers;
  for (int m = 0; m < kMaterialCount; ++m) {
    const auto tool = static_cast<std::size_t>(program.machine.filaments[static_cast<std::size_t>(m)].tool);
    if (header.filament_mm.size() <= tool) header.filament_mm.resize(tool + 1, 0.0);
    header.filament_mm[tool] += report.filament_mm[m];
  }
  return header;
}

std::vector<Part> make_parts(const Program& program) {
  const DuetState widest{.tip_mm = Vec3::Constant(-1000.0), .loaded = 0};
  const std::size_t frame =
      robot_part_header(program.machine, program.options, 99999, 99999, widest, Joints{-6, -6, -6, -6, -6, -6}).size() +
      robot_part_footer(program.machine, 99999).size();
  return pack_parts(program.robot, program.robot_end, frame, program.machine.program);
}

// What a script holds before and behind its piece of the spool, and that piece.
struct PartText {
  std::string header, footer;
  std::uint64_t begin = 0, end = 0;
};

PartText text_of_part(const Program& program, std::size_t index) {
  const Part& part = program.parts[index];
  const int number = static_cast<int>(index) + 1;
  const RobotChain& first = program.robot[part.first];
  PartText text;
  text.header = robot_part_header(program.machine, program.options, number, static_cast<int>(program.parts.size()),
                                  program.states[part.first], index == 0 ? home_joints(program.machine) : first.start);
  text.footer = robot_part_footer(program.machine, number);
  text.begin = index == 0 ? 0 : program.robot_at[part.first] + first.lift_bytes;
  const bool last = part.last == program.robot.size();
  text.end = last ? program.robot_text.size() : program.robot_at[part.last] + program.robot[part.last].lift_bytes;
  return text;
}

void write_part(const Program& program, std::size_t index, const ByteSink& sink) {
  const PartText text = text_of_part(program, index);
  sink(text.header);
  program.robot_text.read(text.begin, text.end, sink);
  sink(text.footer);
}

std::string duet_start_of(const Program& program, std::size_t part) {
  const std::size_t first = program.parts[part].first;
  return duet_part_start(program.machine, static_cast<int>(part) + 1, program.states[first], program.signals[first].first);
}

void write_job(const Program& program, const ByteSink& sink) {
  sink(duet_header(program.header, program.options, program.machine));
  if (program.machine.link.kind == DuetLink::stream) return sink(duet_end_of_stream_job(program.header));
  for (std::size_t p = 0; p < program.parts.size(); ++p) {
    sink(duet_start_of(program, p));
    program.duet_text.read(program.duet_at[program.parts[p].first], program.duet_at[program.parts[p].last], sink);
  }
  sink(duet_end(program.machine, program.states.back(), program.header, program.signals.back().first));
}

std::vector<EmittedPart> part_table(const Program& program, const Motion& motion) {
  const Machine& machine = program.machine;
  const bool board = machine.link.kind != DuetLink::stream;
  std::size_t starts = duet_header(program.header, program.options, machine).size();  // bytes of the job that are in no chain
  std::vector<EmittedPart> table;
  for (std::size_t p = 0; p < program.parts.size(); ++p) {
    const Part& part = program.parts[p];
    EmittedPart row;
    row.file = "robot/part_" + padded(static_cast<int>(p) + 1, 4) + ".script";
    row.moves = part.moves;
    if (board) {
      row.duet_offset = starts + program.duet_at[part.first];
      starts += duet_start_of(program, p).size();
    }
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

std::size_t parts_over_cap(const Program& program) {
  const ProgramLimits& limits = program.machine.program;
  std::size_t over = 0;
  for (std::size_t p = 0; p < program.parts.size(); ++p) {
    const PartText text = text_of_part(program, p);
    const std::uint64_t bytes = text.header.size() + (text.end - text.begin) + text.footer.size();
    over += bytes > static_cast<std::uint64_t>(limits.max_bytes_per_part) || program.parts[p].moves > limits.max_moves_per_part;
  }
  return over;
}

void add_checks(const Toolpaths& toolpaths, const Program& program, EmitReport& report) {
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
  report.checks.push_back(check_equal("emit.parts_over_cap", static_cast<double>(parts_over_cap(program)), 0.0, "robot parts above a cap"));
  report.checks.push_back(check_at_most("emit.chunk_mismatch_s", report.max_chunk_mismatch_s, 0.05,
                                        "robot against Duet by the time model, longest difference of a chunk"));
  report.checks.push_back(check_at_most("emit.flow_ratio", report.max_flow_ratio, 1.0 + 1e-6,
                                        "bead volume per second of a move, of the filament's largest flow"));
}

}  // namespace

std::string text_of(const EmittedFile& file) {
  std::string text;
  file.write([&text](std::string_view piece) { text += piece; });
  return text;
}

EmittedFiles emit_robot(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine,
                        const EmitOptions& requested, const RunContext& run) {
  EmitOptions options = requested;
  options.title = plain_text(requested.title);
  EmittedFiles out;
  const auto program = std::make_shared<Program>(machine, options);
  write_chains(toolpaths, motion, run, *program, out.report);
  program->parts = make_parts(*program);
  program->header = make_header(toolpaths, *program, out.report);
  out.parts = part_table(*program, motion);
  for (std::size_t p = 0; p < out.parts.size(); ++p) {
    out.files.push_back({out.parts[p].file, format("robot program, part %zu of %zu", p + 1, out.parts.size()),
                         [program, p](const ByteSink& sink) { write_part(*program, p, sink); }});
  }
  out.files.push_back({"duet/print.g", "job for the Duet board, in step with robot/",
                       [program](const ByteSink& sink) { write_job(*program, sink); }});
  out.files.push_back(small_file("duet/config_snippet.g", "what config.g of the Duet needs once", config_snippet(machine)));
  for (EmittedFile& macro : tool_macros(machine)) out.files.push_back(std::move(macro));
  out.files.push_back(small_file("robot/play_parts.py", "sends the parts to the robot one after another", player_script()));
  out.files.push_back(small_file("OPERATOR.md", "wiring, calibration, stop and resume", operator_page(machine, options, out.parts, out.report)));
  add_checks(toolpaths, *program, out.report);
  run.progress(1.0);
  return out;
}

}  // namespace curvesup
