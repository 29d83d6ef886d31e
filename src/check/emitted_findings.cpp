#include "check/emitted_findings.h"

namespace curvesup::emitted {

namespace {

struct RuleText {
  Rule rule;
  const char* name;
  const char* what;
  bool at_least = false;
};

constexpr RuleText kRules[] = {
    {Rule::frame, "rule_01_program_frame", "first line def, last line end or the call, one top-level def"},
    {Rule::bytes, "rule_02_bytes_and_indentation", "ASCII, LF, lines of a program start with a space, no tab"},
    {Rule::blocks, "rule_03_blocks", "every block ends; every loop waits or moves"},
    {Rule::calls, "rule_04_calls", "every called function is known and gets arguments that it takes"},
    {Rule::part_caps, "rule_05_part_caps", "moves and bytes of each part; a part ends between chains"},
    {Rule::pose_numbers, "rule_06_pose_numbers", "six finite numbers with six decimals, within reach"},
    {Rule::units, "rule_07_units", "speeds, accelerations, blend radii and lengths in SI units"},
    {Rule::tool_frame, "rule_08_tool_frame", "tool frame and payload of the machine, once, before the first move"},
    {Rule::blend_overlap, "rule_09_blend_overlap", "blend zones of neighbours do not meet"},
    {Rule::stops, "rule_10_stops", "the arm stands at every wait, at chain ends and where the kind of move changes"},
    {Rule::spacing, "rule_11_spacing", "waypoints nearer than the smallest segment"},
    {Rule::turns, "rule_11_turns", "degrees, largest turn at a blended waypoint"},
    {Rule::corner_cut, "rule_12_corner_cut", "mm, largest corner cut by a blend"},
    {Rule::blend_speed, "rule_12_blend_speed", "speed through a blend over what the acceleration allows"},
    {Rule::rotation_alias, "rule_13_rotation_alias", "rotation vectors change no more than the frames they stand for"},
    {Rule::rotation_marks, "rule_14_rotation_marks", "moves that turn more than the controller's rule allows are marked, no others"},
    {Rule::tilt_deviation, "rule_15_tilt_deviation", "degrees, nozzle axis against layer normal"},
    {Rule::inverse_kinematics, "rule_16_inverse_kinematics", "every pose is reached from the one before"},
    {Rule::joint_step, "rule_16_joint_step", "rad, largest turn of a joint in a printed segment"},
    {Rule::joint_limits, "rule_17_joint_limits", "joint positions within the limits with margin"},
    {Rule::joint_speed, "rule_17_joint_speed", "joint speed at the stated feed over its limit"},
    {Rule::singularity, "rule_17_singularity", "least distance from a singularity while printing", true},
    {Rule::part_start, "rule_18_part_start", "a part starts with explicit joints; seeds of the inverse kinematics belong to their pose"},
    {Rule::polyline, "rule_19_polyline", "mm, emitted nozzle tips from the tip polylines of toolpaths.vtp"},
    {Rule::source_points, "rule_19_source_points", "mm, points of toolpaths.vtp from the emitted tip polylines"},
    {Rule::path_order, "rule_19_path_order", "every path of toolpaths.vtp once, in order, whole"},
    {Rule::travel_lift, "rule_20_travel_lift", "travels leave and arrive along the nozzle and lift enough"},
    {Rule::clearance, "rule_21_clearance", "head and arm touch neither platform nor what is laid before"},
    {Rule::timeouts, "rule_22_timeouts", "waits return on the answer; without it they lift, warn and halt in time"},
    {Rule::strings, "rule_23_strings", "strings below 255 characters, closed"},
    {Rule::part_end, "rule_24_part_end", "a part ends with the nozzle off the bead, outputs reset, sockets closed"},
    {Rule::job_lines, "rule_25_job_lines", "ASCII, at most 255 characters a line, no leading spaces"},
    {Rule::job_commands, "rule_26_job_commands", "known commands with known parameters"},
    {Rule::prelude, "rule_27_prelude", "units, absolute axes, relative extruder, limits and position before anything moves; no homing"},
    {Rule::tool_and_heat, "rule_28_tool_and_heat", "a hot tool of the right material wherever filament moves"},
    {Rule::feeds, "rule_29_feeds", "feed before and within limits at every move; extruder alone not too slow"},
    {Rule::flow, "rule_29_flow", "volume per second of a move over the largest of its material"},
    {Rule::volume, "rule_30_volume", "relative, extruded volume per tool against toolpaths.vtp; five decimals of E"},
    {Rule::path_volume, "rule_30_path_volume", "relative, extruded volume of each path against toolpaths.vtp"},
    {Rule::header, "rule_31_header", "layer height, layers, filament and time as the firmware reads them"},
    {Rule::layers, "rule_32_layers", "layer comments count the printed groups of toolpaths.vtp"},
    {Rule::retraction, "rule_33_retraction", "retract and un-retract alternate and balance; loads and unloads as stated"},
    {Rule::tool_change, "rule_34_tool_change", "changes of material at the purge station, in full"},
    {Rule::barriers, "rule_35_barriers", "both programs hold the same barriers and acknowledges, levels alternate"},
    {Rule::gates, "rule_35_gates", "gates alternate from 1 and are set one chunk ahead"},
    {Rule::chunk_size, "rule_36_chunk_size", "moves and seconds between two gates"},
    {Rule::same_polyline, "rule_37_same_polyline", "mm, waypoints of the script against those of the job"},
    {Rule::same_speed, "rule_37_same_speed", "relative, speed of the script against feed of the job, both stop at the same waypoints"},
    {Rule::chunk_time, "rule_38_chunk_time", "robot against extruder board by the time model, difference of a chunk over what is allowed"},
    {Rule::chain_time, "rule_38_chain_time", "the same for a chain"},
    {Rule::total_time, "rule_38_total_time", "relative, simulated time against the header"},
    {Rule::final_state, "rule_39_final_state", "fan within 0 and 1; at the end fan, heaters and tool off, relative extrusion"},
    {Rule::file_names, "rule_40_file_names", "names of files as agreed"},
    {Rule::deadlock, "sync_deadlock", "both programs run to their end against each other, on time and with a slow extruder board"},
    {Rule::overrun, "sync_overrun", "the extruder never runs more than one chunk ahead of the arm's own"},
    {Rule::manifest_parts, "manifest_parts", "parts of the manifest are those of the folder: order, paths, moves, seconds"},
    {Rule::manifest_offsets, "manifest_offsets", "byte offsets of the manifest point at the parts in the job"},
    {Rule::manifest_hashes, "manifest_hashes", "sizes and hashes of the manifest are those of the files"},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < std::size(kRules); ++i) {
    if (kRules[i].rule != static_cast<Rule>(i)) return false;
  }
  return std::size(kRules) == static_cast<std::size_t>(Rule::count);
}
static_assert(in_order());

}  // namespace

std::string Findings::text(const Place& place, std::string_view what) {
  std::string text(place.file);
  if (place.line > 0) text += ":" + std::to_string(place.line);
  if (!text.empty()) text += ": ";
  return text += what;
}

void Findings::merge(const Findings& later) {
  for (std::size_t i = 0; i < findings_.size(); ++i) {
    Finding& into = findings_[i];
    const Finding& from = later.findings_[i];
    if (into.failures == 0) into.first = from.first;
    into.failures += from.failures;
    if (!from.measured) continue;
    const bool worse = !into.measured || (kRules[i].at_least ? from.worst < into.worst : from.worst > into.worst);
    if (worse) into.worst = from.worst;
    into.limit = from.limit;
    into.measured = true;
  }
}

std::vector<Check> Findings::checks() const {
  std::vector<Check> checks;
  for (const RuleText& rule : kRules) {
    const Finding& finding = (*this)[rule.rule];
    Check check{std::string("emitted.") + rule.name, finding.failures == 0,
                finding.measured ? finding.worst : static_cast<double>(finding.failures),
                finding.measured ? finding.limit : 0.0, rule.what};
    if (!check.ok) check.detail += "; " + std::to_string(finding.failures) + " failed, first " + finding.first;
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace curvesup::emitted
