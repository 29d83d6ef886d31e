#include <algorithm>
#include <numbers>
#include <sstream>

#include "check/emitted_sync.h"
#include "core/memory.h"
#include "curvesup/check/check_output.h"
#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/text_file.h"

namespace curvesup {

namespace {

using namespace emitted;
namespace fs = std::filesystem;

// "part_0001.script" gives 1; 0 for other names.
int part_number(const std::string& name) {
  if (!name.starts_with("part_") || !name.ends_with(".script")) return 0;
  const std::string digits = name.substr(5, name.size() - 12);
  if (digits.size() < 4 || digits.size() > 8 || digits.find_first_not_of("0123456789") != std::string::npos) return 0;
  return std::stoi(digits);
}

std::vector<RobotPart> find_parts(const fs::path& folder, Findings& findings) {
  std::vector<RobotPart> parts;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "robot", error)) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() != ".script") continue;
    const int number = part_number(name);
    if (number == 0) {
      findings.fail(Rule::file_names, {"robot/" + name, 0}, "no name of a part");
      continue;
    }
    RobotPart part;
    part.file = "robot/" + name;
    part.number = number;
    parts.push_back(std::move(part));
  }
  if (parts.empty()) throw Error(ErrorKind::input, (folder / "robot").string(), "holds no part_NNNN.script", "give the folder that slice wrote");
  std::sort(parts.begin(), parts.end(), [](const RobotPart& a, const RobotPart& b) { return a.number < b.number; });
  for (std::size_t i = 0; i < parts.size(); ++i) {
    findings.expect(parts[i].number == static_cast<int>(i) + 1, Rule::file_names, {parts[i].file, 0}, "parts are not numbered 1, 2, ...");
  }
  return parts;
}

void add(EmittedFigures& figures, const EmittedFigures& part) {
  figures.print_mm += part.print_mm;
  figures.max_rotation_rad_per_m = std::max(figures.max_rotation_rad_per_m, part.max_rotation_rad_per_m);
}

void read_part(RobotPart& part, int parts, const fs::path& folder, const Machine& machine, EmittedFigures& figures) {
  part.text = read_file(folder / part.file);
  read_script(part, parts, machine);
  probe_waits(part, machine);
  part.bytes = part.text.size();
  part.sha256 = sha256_hex(part.text);
  part.functions = {};
  std::string().swap(part.text);
  part.moves.shrink_to_fit();
  part.events.shrink_to_fit();
  check_arm(part, machine);
  std::vector<Joints>().swap(part.joints);
  check_chains(part, machine, figures);
}

void read_job_file(Job& job, const fs::path& folder, const Machine& machine) {
  if (machine.link.kind != DuetLink::stream) return read_job(job, folder, machine);
  job.sha256 = sha256_of_file(folder / job.file);
  job.bytes = fs::file_size(folder / job.file);
}

// All files at once; the longest come first.
void read_programs(Programs& programs, SourcePaths& source, const fs::path& folder, const Machine& machine, const RunContext& run,
                   Findings& findings, EmittedFigures& figures) {
  std::vector<RobotPart>& parts = programs.parts;
  std::vector<EmittedFigures> each(parts.size());
  const bool board = machine.link.kind != DuetLink::stream;
  parallel_for(parts.size() + 2, 1, run, [&](std::size_t task, std::size_t, std::size_t) {
    if (task == 0) return read_job_file(programs.job, folder, machine);
    if (task > 1) return read_part(parts[task - 2], static_cast<int>(parts.size()), folder, machine, each[task - 2]);
    if (board) source = read_source(folder / "toolpaths.vtp");
  });
  release_free_memory();
  figures.parts = parts.size();
  figures.duet_bytes = programs.job.bytes;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    findings.merge(parts[i].findings);
    add(figures, each[i]);
    figures.robot_bytes += parts[i].bytes;
    for (const RobotMove& move : parts[i].moves) ++(move.kind == RobotMove::Kind::process ? figures.print_moves : figures.travel_moves);
  }
}

// Each part starts where the one before ended, the first one at home.
void check_part_starts(const std::vector<RobotPart>& parts, const Machine& machine, Findings& findings) {
  Joints before{};
  for (std::size_t i = 0; i < 6; ++i) before[i] = machine.stations.home_deg[i] * std::numbers::pi / 180.0;
  bool known = true;
  for (const RobotPart& part : parts) {
    if (part.moves.empty()) {
      findings.fail(Rule::part_start, {part.file, 0}, "a part without moves");
      continue;
    }
    double apart = 0.0;
    for (std::size_t i = 0; i < 6; ++i) apart = std::max(apart, std::abs(part.moves.front().reached[i] - before[i]));
    if (known) findings.expect(apart < 1e-4, Rule::part_start, {part.file, part.moves.front().line}, "the part does not start where the one before ended");
    before = part.moves.back().reached;
    known = part.moves.back().solved;
  }
}

void read_duet_folder(const fs::path& folder, Findings& findings) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "duet", error)) {
    if (entry.path().filename() != "print.g") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) read_settings("duet/" + file.filename().string(), read_file(file), findings);
}

}  // namespace

CheckOutputResult check_output(const fs::path& out_folder, const Machine& machine, const RunContext& run) {
  CheckOutputResult result;
  Findings findings;
  Programs programs;
  programs.parts = find_parts(out_folder, findings);
  SourcePaths source;
  read_programs(programs, source, out_folder, machine, run, findings, result.figures);
  check_part_starts(programs.parts, machine, findings);
  run.progress(0.5);
  read_duet_folder(out_folder, findings);
  if (machine.link.kind != DuetLink::stream) {
    findings.merge(programs.job.findings);
    check_sync(programs, machine, run, findings, result.figures);
    run.progress(0.7);
    const std::vector<PathBead> beads = std::move(source.beads);
    check_paths(programs, std::move(source), machine, run, findings, result.figures);
    release_free_memory();
    run.progress(0.8);
    check_clearance(programs, beads, machine, run, findings);
  }
  check_manifest(programs, out_folder, findings);
  EmittedFigures& figures = result.figures;
  figures.max_joint_speed_ratio = findings[Rule::joint_speed].worst;
  figures.max_joint_step_rad = findings[Rule::joint_step].worst;
  figures.min_singularity_metric = findings[Rule::singularity].measured ? findings[Rule::singularity].worst : 1.0;
  result.checks = findings.checks();
  for (const Check& check : result.checks) result.ok = result.ok && check.ok;
  run.progress(1.0);
  return result;
}

std::string check_summary(const CheckOutputResult& result) {
  const EmittedFigures& f = result.figures;
  std::string text;
  std::size_t failed = 0;
  for (const Check& check : result.checks) {
    if (check.ok) continue;
    ++failed;
    text += format("FAILED %-40s %.6g (limit %.6g) %s\n", check.name.c_str(), check.value, check.limit, check.detail.c_str());
  }
  text += format("%zu of %zu checks hold\n", result.checks.size() - failed, result.checks.size());
  text += format("robot     %zu parts, %.1f MB; %zu printing moves over %.1f m, %zu travels\n", f.parts, 1e-6 * static_cast<double>(f.robot_bytes),
                 f.print_moves, 1e-3 * f.print_mm, f.travel_moves);
  text += format("duet      %.1f MB; %zu chains of %zu paths, %zu gates\n", 1e-6 * static_cast<double>(f.duet_bytes), f.chains, f.paths, f.gates);
  text += format("time      %.1f min simulated, %.1f min in the header; largest difference of a chunk %.0f ms, of a chain %.0f ms\n", f.simulated_s / 60.0,
                 f.header_s / 60.0, 1e3 * f.max_chunk_mismatch_s, 1e3 * f.max_chain_mismatch_s);
  text += format("arm       joint speed %.2f of the limit, step %.3f rad, singularity metric %.3f, rotation %.0f rad/m\n", f.max_joint_speed_ratio,
                 f.max_joint_step_rad, f.min_singularity_metric, f.max_rotation_rad_per_m);
  text += format("nozzle    %.1f degrees from the layer normal, %.4f mm from the paths\n", f.max_tilt_deviation_deg, f.max_polyline_distance_mm);
  text += format("volume    %.1f mm3 model, %.1f mm3 support\n", f.volume_mm3[0], f.volume_mm3[1]);
  return text;
}

}  // namespace curvesup
