#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "curvesup/core/report.h"

// What is wrong with emitted files, by rule.
namespace curvesup::emitted {

enum class Rule {
  frame,
  bytes,
  blocks,
  calls,
  part_caps,
  pose_numbers,
  units,
  tool_frame,
  blend_overlap,
  stops,
  spacing,
  turns,
  corner_cut,
  blend_speed,
  rotation_alias,
  rotation_marks,
  tilt_deviation,
  inverse_kinematics,
  joint_step,
  joint_limits,
  joint_speed,
  singularity,
  part_start,
  polyline,
  source_points,
  path_order,
  travel_lift,
  clearance,
  timeouts,
  strings,
  part_end,
  job_lines,
  job_commands,
  prelude,
  tool_and_heat,
  feeds,
  flow,
  volume,
  path_volume,
  header,
  layers,
  retraction,
  tool_change,
  barriers,
  gates,
  chunk_size,
  same_polyline,
  same_speed,
  chunk_time,
  chain_time,
  total_time,
  final_state,
  file_names,
  deadlock,
  overrun,
  manifest_parts,
  manifest_offsets,
  manifest_hashes,
  count
};

struct Finding {
  std::size_t failures = 0;
  bool measured = false;
  double worst = 0.0, limit = 0.0;
  std::string first;  // place and text of the first failure
};

// A line of a file.
struct Place {
  std::string_view file;
  int line = 0;
};

class Findings {
 public:
  void fail(Rule rule, const Place& place, std::string_view what) {
    Finding& finding = at(rule);
    if (finding.failures++ == 0) finding.first = text(place, what);
  }
  void expect(bool ok, Rule rule, const Place& place, std::string_view what) {
    if (!ok) fail(rule, place, what);
  }
  void at_most(Rule rule, double value, double limit, const Place& place, std::string_view what) {
    Finding& finding = at(rule);
    if (!finding.measured || value > finding.worst) finding.worst = value;
    finding.limit = limit;
    finding.measured = true;
    if (!(value <= limit)) fail(rule, place, what);
  }
  void at_least(Rule rule, double value, double limit, const Place& place, std::string_view what) {
    Finding& finding = at(rule);
    if (!finding.measured || value < finding.worst) finding.worst = value;
    finding.limit = limit;
    finding.measured = true;
    if (!(value >= limit)) fail(rule, place, what);
  }

  // `later` is of files or lines behind those of this one.
  void merge(const Findings& later);
  [[nodiscard]] std::vector<Check> checks() const;
  [[nodiscard]] const Finding& operator[](Rule rule) const { return findings_[static_cast<std::size_t>(rule)]; }

 private:
  Finding& at(Rule rule) { return findings_[static_cast<std::size_t>(rule)]; }
  static std::string text(const Place& place, std::string_view what);

  std::array<Finding, static_cast<std::size_t>(Rule::count)> findings_;
};

}  // namespace curvesup::emitted
