#include "emit/duet_job.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/parallel.h"
#include "emit/duet_link.h"
#include "emit/text.h"

namespace curvesup::emit {

namespace {

constexpr int kFilamentDecimals = 6;
constexpr int kFeedDecimals = 2;
constexpr double kMinExtruderFeed = 30.0;  // mm/min: slower moves of the extruder alone are delivered in bursts

const Filament& filament_of(const Machine& machine, int material) {
  return machine.filaments[static_cast<std::size_t>(material)];
}

void append_axis(std::string& text, const char* word, double value) {
  text += word;
  append_fixed(text, value, 4);
}

void append_xyz(std::string& text, const Vec3& tip) {
  append_axis(text, " X", tip.x());
  append_axis(text, " Y", tip.y());
  append_axis(text, " Z", tip.z());
}

// A move of the extruder alone.
void append_extruder_move(std::string& text, double e_mm, double speed_mm_s) {
  text += "G1 E";
  append_fixed(text, e_mm, 5);
  text += " F";
  append_fixed(text, std::max(kMinExtruderFeed, 60.0 * speed_mm_s), kFeedDecimals);
  text += '\n';
}

void append_fan(std::string& text, const Machine& machine, double share) {
  text += "M106 P" + std::to_string(machine.extruder.fan) + " S" + fixed(share, 2) + "\n";
}

void append_tool(std::string& text, const char* before, int tool, const char* after) {
  text += before;
  append_integer(text, tool);
  text += after;
}

const char* feature_name(const Path& path) {
  if (path.material == Material::support) return "Support material";
  switch (path.kind) {
    case PathKind::contour: return "Perimeter";
    case PathKind::centre_line: return "Gap fill";
    case PathKind::infill: return "Solid infill";
  }
  return "Custom";
}

// Sets of temperatures, once per tool.
void append_temperatures(std::string& text, const Machine& machine) {
  for (int material = 0; material < kMaterialCount; ++material) {
    const Filament& filament = filament_of(machine, material);
    if (material > 0 && filament.tool == filament_of(machine, 0).tool) continue;
    const std::string degrees = fixed(filament.temperature_c, 1);
    text += "G10 P" + std::to_string(filament.tool) + " S" + degrees + " R" + degrees + "\n";
  }
}

class ChainWriter {
 public:
  ChainWriter(const Toolpaths& toolpaths, const Machine& machine) : toolpaths_(toolpaths), machine_(machine), link_(machine) {}

  std::string write(const Chain& chain, const DuetState& before, const DuetState& after, long signal) const {
    std::string text;
    text.reserve(400 + 48 * chain.moves.size());
    const PathMotion& path = *chain.motion;
    if (path.material_change_before) {
      append_change(before.loaded, static_cast<int>(path.material), signal, text);
      signal += 2;
    }
    append_comments(path, before, after, text);
    if ((chain.start_tip_mm - before.tip_mm).norm() > 1e-9) {
      text += "G0";
      append_xyz(text, chain.start_tip_mm);
      text += " F";
      append_fixed(text, 60.0 * machine_.speeds.travel_mm_s, kFeedDecimals);
      text += '\n';
    }
    append_print(chain, signal, text);
    return text;
  }

 private:
  void append_change(int loaded, int next, long signal, std::string& text) const {
    append_tool(text, ";CHANGE:", filament_of(machine_, next).tool, "\n");
    link_.start(text, signal);
    text += change_work(machine_, loaded, next);
    link_.started(text, signal);
    link_.end(text, signal + 1);
    link_.ended(text, signal + 1);
  }

  void append_comments(const PathMotion& path, const DuetState& before, const DuetState& after, std::string& text) const {
    const bool new_group = after.group != before.group;
    if (new_group) append_tool(text, ";LAYER:", after.group, "\n");
    if (new_group || after.layer != before.layer) append_tool(text, ";K:", path.layer, "\n");
    append_tool(text, ";PATH:", path.path, " section ");
    append_integer(text, path.section + 1);
    text += " of ";
    append_integer(text, path.sections);
    text += "\n;TYPE:";
    text += feature_name(toolpaths_.paths[static_cast<std::size_t>(path.path)]);
    text += '\n';
  }

  void append_print(const Chain& chain, long signal, std::string& text) const {
    const PathMotion& path = *chain.motion;
    link_.start(text, signal);
    text += chain_start_work(machine_, path.material);
    link_.started(text, signal++);
    const double per_mm3 = filament_per_mm3(machine_, path.material);
    double e = 0.0;
    std::int64_t e_units = 0, feed_units = -1;
    int chunk = 1;
    const int chunks = static_cast<int>(chain.chunks.size());
    for (int k = 0; k < static_cast<int>(chain.moves.size()); ++k) {
      if (chunk < chunks && chain.chunks[chunk] == k) {
        link_.gate(text, chunk, signal++);
        ++chunk;
      }
      if (chain.stop_before(k)) text += "M400\n";
      const Move& move = chain.moves[k];
      text += "G1";
      append_xyz(text, move.tip_mm);
      // Rounded so that the sum over the chain keeps its value.
      e += move.volume_mm3 * per_mm3;
      const std::int64_t e_now = to_units(e, kFilamentDecimals);
      text += " E";
      append_units(text, e_now - e_units, kFilamentDecimals);
      e_units = e_now;
      const std::int64_t feed = to_units(60.0 * move.feed_mm_s, kFeedDecimals);
      if (feed != feed_units) {
        text += " F";
        append_units(text, feed, kFeedDecimals);
        feed_units = feed;
      }
      text += '\n';
    }
    link_.end(text, signal);
    text += chain_end_work(machine_, path.material);
    link_.ended(text, signal);
  }

  const Toolpaths& toolpaths_;
  const Machine& machine_;
  DuetLinkText link_;
};

std::string duration_text(double seconds) {
  const long total = std::lround(seconds);
  std::string text;
  if (total >= 3600) text += std::to_string(total / 3600) + "h ";
  if (total >= 60) text += std::to_string(total / 60 % 60) + "m ";
  return text + std::to_string(total % 60) + "s";
}

std::string time_comments(double seconds) {
  return "; estimated printing time (normal mode) = " + duration_text(seconds) + "\n;TIME:" +
         std::to_string(std::lround(seconds)) + "\n";
}

std::string footer(const DuetHeader& header) {
  return "; num_layers = " + std::to_string(header.layers) + "\n" + time_comments(header.time_s);
}

}  // namespace

double filament_per_mm3(const Machine& machine, Material material) {
  const double diameter = machine.extruder.filament_diameter_mm;
  const double area = std::numbers::pi / 4.0 * diameter * diameter;
  return filament_of(machine, static_cast<int>(material)).flow / area;
}

double change_seconds(const Machine& machine, int loaded, int next) {
  double seconds = 0.0;
  if (loaded >= 0 && next >= 0 && filament_of(machine, loaded).tool == filament_of(machine, next).tool) return 0.0;
  if (loaded >= 0) {
    const Filament& f = filament_of(machine, loaded);
    seconds += f.retract_mm / f.retract_mm_s + f.unload_mm / f.load_mm_s;
  }
  if (next >= 0) {
    const Filament& f = filament_of(machine, next);
    seconds += (f.load_mm + f.purge_mm) / f.load_mm_s + f.retract_mm / f.retract_mm_s;
  }
  return seconds;
}

std::vector<DuetState> duet_states(const Motion& motion) {
  std::vector<DuetState> states(motion.paths.size() + 1);
  for (std::size_t i = 0; i < motion.paths.size(); ++i) {
    DuetState next = states[i];
    const PathMotion& path = motion.paths[i];
    if (path.material_change_before) next.loaded = static_cast<int>(path.material);
    if (next.group < 0 || next.source_group != path.group) ++next.group;
    next.source_group = path.group;
    next.layer = path.layer;
    next.tip_mm = Vec3::Zero();
    if (path.waypoint_count > 0) next.tip_mm = motion.waypoints[path.first_waypoint + path.waypoint_count - 1].tip_mm;
    states[i + 1] = next;
  }
  return states;
}

std::vector<std::string> write_duet_chains(const Toolpaths& toolpaths, std::size_t first, const std::vector<Chain>& chains,
                                           const std::vector<DuetState>& states, const std::vector<Signals>& signals,
                                           const Machine& machine, const RunContext& run) {
  const ChainWriter writer(toolpaths, machine);
  std::vector<std::string> out(chains.size());
  parallel_for(chains.size(), 16, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t c = first + i;
      out[i] = writer.write(chains[i], states[c], states[c + 1], signals[c].first);
    }
  });
  return out;
}

std::string duet_header(const DuetHeader& header, const EmitOptions& options, const Machine& machine) {
  std::string text = "; generated by curvesup " + header.version + "\n";
  text += "; " + options.title + ", machine " + machine.name + ", robot and extruder in step: see OPERATOR.md\n";
  text += "; layer_height = " + fixed(header.layer_height_mm, 3) + "\n";
  text += "; filament used [mm] = ";
  for (std::size_t i = 0; i < header.filament_mm.size(); ++i) {
    text += (i > 0 ? ", " : "") + fixed(header.filament_mm[i], 2);
  }
  return text + "\n" + time_comments(header.time_s);
}

std::string part_work(const Machine& machine, const DuetState& state) {
  std::string text = "G21\nG90\nM83\nM564 H0 S0\n";
  text += "M204 P" + fixed(1000.0 * machine.speeds.print_acceleration_m_s2, 1) + " T" +
          fixed(1000.0 * machine.speeds.travel_acceleration_m_s2, 1) + "\n";
  text += "G92";
  append_xyz(text, state.tip_mm);
  text += '\n';
  append_temperatures(text, machine);
  if (state.loaded >= 0) {
    const Filament& filament = filament_of(machine, state.loaded);
    append_tool(text, "T", filament.tool, " P0\n");
    append_tool(text, "M116 P", filament.tool, "\n");
    append_fan(text, machine, filament.fan);
  }
  return text;
}

std::string change_work(const Machine& machine, int loaded, int next) {
  const Filament& filament = filament_of(machine, next);
  const bool same_tool = loaded >= 0 && filament_of(machine, loaded).tool == filament.tool;
  std::string text = same_tool ? std::string() : unload_work(machine, loaded);
  append_tool(text, "T", filament.tool, "\n");
  append_tool(text, "M116 P", filament.tool, "\n");
  if (!same_tool) {
    append_extruder_move(text, filament.load_mm + filament.purge_mm, filament.load_mm_s);
    append_extruder_move(text, -filament.retract_mm, filament.retract_mm_s);
  }
  append_fan(text, machine, filament.fan);
  return text;
}

std::string chain_start_work(const Machine& machine, Material material) {
  const Filament& filament = filament_of(machine, static_cast<int>(material));
  std::string text;
  append_extruder_move(text, filament.retract_mm, filament.retract_mm_s);
  return text;
}

std::string chain_end_work(const Machine& machine, Material material) {
  const Filament& filament = filament_of(machine, static_cast<int>(material));
  std::string text;
  append_extruder_move(text, -filament.retract_mm, filament.retract_mm_s);
  return text;
}

std::string unload_work(const Machine& machine, int loaded) {
  std::string text;
  if (loaded < 0) return text;
  const Filament& filament = filament_of(machine, loaded);
  append_extruder_move(text, filament.retract_mm, filament.retract_mm_s);
  append_extruder_move(text, -filament.unload_mm, filament.load_mm_s);
  return text;
}

std::string finish_work(const Machine& machine) {
  std::string text = "M400\n";
  append_fan(text, machine, 0.0);
  for (int material = 0; material < kMaterialCount; ++material) {
    const int tool = filament_of(machine, material).tool;
    if (material > 0 && tool == filament_of(machine, 0).tool) continue;
    append_tool(text, "G10 P", tool, " S0 R0\n");
  }
  return text + "T-1 P0\nM83\n";
}

std::string duet_part_start(const Machine& machine, int part, const DuetState& state, long first_signal) {
  const DuetLinkText link(machine);
  std::string text = ";PART:" + std::to_string(part) + "\n";
  link.part_start(text, part, first_signal);
  text += part_work(machine, state);
  link.part_ready(text, part);
  return text;
}

std::string duet_end(const Machine& machine, const DuetState& state, const DuetHeader& header, long first_signal) {
  const DuetLinkText link(machine);
  std::string text = ";END\n";
  link.start(text, first_signal);
  text += unload_work(machine, state.loaded);
  link.started(text, first_signal);
  link.end(text, first_signal + 1);
  link.ended(text, first_signal + 1);
  return text + finish_work(machine) + footer(header);
}

std::string duet_end_of_stream_job(const DuetHeader& header) {
  return "; the robot sends every command: this job only describes the print\nM400\n" + footer(header);
}

}  // namespace curvesup::emit
