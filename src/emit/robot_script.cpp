#include "emit/robot_script.h"

#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/parallel.h"
#include "emit/robot_link.h"
#include "emit/text.h"

namespace curvesup::emit {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

// End of a movej or movel line.
void append_dynamics(std::string& text, double acceleration, double speed) {
  text += ", a=";
  append_fixed(text, acceleration, 4);
  text += ", v=";
  append_fixed(text, speed, 7);
}

void append_movej(std::string& text, const Joints& joints, const Pose* pose, const Speeds& speeds) {
  text += " movej(";
  if (pose) {
    text += "get_inverse_kin(";
    append_pose(text, *pose);
    text += ", ";
  }
  append_joints(text, joints);
  if (pose) text += ')';
  append_dynamics(text, speeds.joint_acceleration_deg_s2 * kRadians, speeds.joint_speed_deg_s * kRadians);
  text += ")\n";
}

void append_travel(std::string& text, const Travel& travel, bool is_last, const Speeds& speeds) {
  if (travel.kind == TravelKind::joint) {
    append_movej(text, travel.joints, is_last ? &travel.pose : nullptr, speeds);
    return;
  }
  text += " movel(";
  append_pose(text, travel.pose);
  append_dynamics(text, speeds.travel_acceleration_m_s2, travel.speed_mm_s / 1000.0);
  text += ")\n";
}

void append_print_move(std::string& text, const Move& move, const Speeds& speeds) {
  text += " movep(";
  append_pose(text, move.pose);
  append_dynamics(text, speeds.print_acceleration_m_s2, move.speed_mm_s / 1000.0);
  text += ", r=";
  append_fixed(text, move.blend_mm / 1000.0, 6);
  text += move.rotation_limited ? ") # rotation\n" : ")\n";
  if (move.rest_s == 0.0) return;
  text += " sleep(";
  append_fixed(text, move.rest_s, 3);
  text += ")\n";
}

void append_path_comment(std::string& text, const PathMotion& path) {
  text += " # path ";
  append_integer(text, path.path);
  text += " section ";
  append_integer(text, path.section + 1);
  text += " of ";
  append_integer(text, path.sections);
  text += " layer ";
  append_integer(text, path.layer);
  text += " group ";
  append_integer(text, path.group);
  text += path.material == Material::model ? " model\n" : " support\n";
}

class ChainWriter {
 public:
  ChainWriter(const Motion& motion, const Machine& machine) : motion_(motion), machine_(machine), link_(machine) {}

  RobotChain write(const Chain& chain, const DuetState& state, const Signals& signals, const Joints& before) const {
    const PathMotion& path = *chain.motion;
    RobotChain out;
    out.start = before;
    Index travel = path.first_travel;
    const Index end = path.first_travel + path.travel_count;
    out.text.reserve(400 + 110 * (chain.moves.size() + static_cast<std::size_t>(end - travel)));
    while (travel < end && motion_.travels[travel].step == TravelStep::lift) append_lift(motion_.travels[travel++], out);
    out.lift_bytes = out.text.size();
    append_path_comment(out.text, path);
    long signal = signals.first;
    bool changed = false;
    for (; travel < end; ++travel) {
      const Travel& step = motion_.travels[travel];
      append_travel(out.text, step, travel + 1 == end, machine_.speeds);
      ++out.body_moves;
      out.body_s += step.duration_s;
      if (path.material_change_before && !changed && step.step == TravelStep::purge) {
        append_change(state.loaded, path.material, signal, out.text);
        signal += 2;
        changed = true;
      }
    }
    if (path.material_change_before && !changed) {
      throw Error(ErrorKind::internal, "emit, path " + std::to_string(path.path),
                  "the material changes but no travel reaches the purge station");
    }
    append_print(chain, signal, out);
    out.body_bytes = out.text.size() - out.lift_bytes;
    return out;
  }

  RobotChain write_end(const DuetState& state, long signal) const {
    RobotChain out;
    for (Index travel = motion_.final_travel; travel < static_cast<Index>(motion_.travels.size()); ++travel) {
      append_travel(out.text, motion_.travels[travel], false, machine_.speeds);
      ++out.body_moves;
      out.body_s += motion_.travels[travel].duration_s;
    }
    out.text += " # barrier unload\n";
    link_.work_barrier(out.text, signal, work([&] { return unload_work(machine_, state.loaded) + finish_work(machine_); }),
                       machine_.link.tool_change_timeout_s);
    out.body_bytes = out.text.size();
    return out;
  }

 private:
  // The Duet's lines, where the robot has to send them.
  template <class Lines>
  [[nodiscard]] std::string work(const Lines& lines) const {
    return link_.streams() ? lines() : std::string();
  }

  void append_lift(const Travel& travel, RobotChain& out) const {
    append_travel(out.text, travel, false, machine_.speeds);
    ++out.lift_moves;
    out.lift_s += travel.duration_s;
    out.start = travel.joints;
  }

  void append_change(int loaded, Material material, long signal, std::string& text) const {
    text += " # barrier change tool ";
    append_integer(text, filament(material).tool);
    text += '\n';
    link_.work_barrier(text, signal, work([&] { return change_work(machine_, loaded, static_cast<int>(material)); }),
                       machine_.link.tool_change_timeout_s + machine_.link.heating_timeout_s);
  }

  void append_print(const Chain& chain, long signal, RobotChain& out) const {
    const PathMotion& path = *chain.motion;
    const double timeout = machine_.link.timeout_s + 2.0 * filament(path.material).retract_mm / filament(path.material).retract_mm_s;
    out.text += " # barrier path ";
    append_integer(out.text, path.path);
    out.text += " section ";
    append_integer(out.text, path.section + 1);
    out.text += '\n';
    link_.chain_start(out.text, signal++, work([&] { return chain_start_work(machine_, path.material) + "G92 X0\n"; }), timeout);
    std::vector<std::string> lines;
    if (link_.streams()) {
      lines = chunk_lines(chain);
      if (!lines.empty()) RobotLink::send(out.text, lines.front());
    }
    const int chunks = static_cast<int>(chain.chunks.size());
    int chunk = 0;
    for (int k = 0; k < static_cast<int>(chain.moves.size()); ++k) {
      if (chunk < chunks && chain.chunks[chunk] == k) {
        ++chunk;
        if (chunk < chunks) {
          if (link_.streams()) link_.send_in_motion(out.text, lines[chunk], signal);
          if (!link_.streams()) link_.gate(out.text, chunk, signal);
          ++signal;
        }
      }
      append_print_move(out.text, chain.moves[k], machine_.speeds);
    }
    link_.chain_end(out.text, signal, work([&] { return chain_end_work(machine_, path.material); }), timeout);
    out.body_moves += static_cast<int>(chain.moves.size());
    out.body_s += chain.duet_s;
  }

  // Link `stream`: one command for each chunk; X is the way along the chain.
  [[nodiscard]] std::vector<std::string> chunk_lines(const Chain& chain) const {
    const double per_mm3 = filament_per_mm3(machine_, chain.motion->material);
    std::vector<std::string> lines;
    double x = 0.0;
    for (std::size_t c = 0; c < chain.chunks.size(); ++c) {
      const int end = c + 1 < chain.chunks.size() ? chain.chunks[c + 1] : static_cast<int>(chain.moves.size());
      double length = 0.0, volume = 0.0, seconds = 0.0;
      for (int k = chain.chunks[c]; k < end; ++k) {
        const Move& move = chain.moves[static_cast<std::size_t>(k)];
        length += move.length_mm;
        volume += move.volume_mm3;
        seconds += move.duration_s;
        // The Duet runs through where the robot stops: it takes the stop's time over the whole chunk.
        if (k + 1 < static_cast<int>(chain.moves.size()) && move.blend_mm == 0.0) {
          seconds += move.feed_mm_s / (1000.0 * machine_.speeds.print_acceleration_m_s2);
        }
      }
      x += length;
      lines.push_back("G1 X" + fixed(x, 4) + " E" + fixed(volume * per_mm3, 6) + " F" +
                      fixed(60.0 * length / seconds, 2));
    }
    return lines;
  }

  [[nodiscard]] const Filament& filament(Material material) const {
    return machine_.filaments[static_cast<std::size_t>(material)];
  }

  const Motion& motion_;
  const Machine& machine_;
  RobotLink link_;
};

// Where the arm stands when the chain before `index` has ended.
Joints joints_before(const Motion& motion, std::size_t index, const Machine& machine) {
  if (index > 0) {
    const PathMotion& previous = motion.paths[index - 1];
    if (previous.waypoint_count > 0) return motion.waypoints[previous.first_waypoint + previous.waypoint_count - 1].joints;
  }
  return home_joints(machine);
}

}  // namespace

Joints home_joints(const Machine& machine) {
  Joints home{};
  for (std::size_t i = 0; i < 6; ++i) home[i] = machine.stations.home_deg[i] * kRadians;
  return home;
}

std::vector<RobotChain> write_robot_chains(const Motion& motion, std::size_t first, const std::vector<Chain>& chains,
                                           const std::vector<DuetState>& states, const std::vector<Signals>& signals,
                                           const Machine& machine, const RunContext& run) {
  const ChainWriter writer(motion, machine);
  std::vector<RobotChain> out(chains.size());
  parallel_for(chains.size(), 16, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t c = first + i;
      out[i] = writer.write(chains[i], states[c], signals[c], joints_before(motion, c, machine));
    }
  });
  return out;
}

RobotChain write_robot_end(const Motion& motion, const DuetState& state, const Machine& machine, long first_signal) {
  return ChainWriter(motion, machine).write_end(state, first_signal);
}

std::string robot_part_header(const Machine& machine, const EmitOptions& options, int part, int parts,
                              const DuetState& state, const Joints& start) {
  std::string text = "def part_" + padded(part, 4) + "():\n";
  text += " # " + options.title + " part " + std::to_string(part) + " of " + std::to_string(parts) + ", machine " +
          machine.name + "\n";
  text += " set_tcp(p[";
  for (int i = 0; i < 3; ++i) text += fixed(machine.tool.tcp.position_m[i], 6) + ",";
  for (int i = 0; i < 3; ++i) text += fixed(machine.tool.tcp.rotation_vector[i], 6) + (i < 2 ? "," : "])\n");
  text += " set_payload(" + fixed(machine.tool.payload_kg, 3) + ", [";
  for (int i = 0; i < 3; ++i) text += fixed(machine.tool.centre_of_gravity_m[i], 4) + (i < 2 ? ", " : "])\n");
  const RobotLink link(machine);
  link.define(text, options.stop_lift_mm / 1000.0);
  append_movej(text, start, nullptr, machine.speeds);
  link.part_barrier(text, part, link.streams() ? part_work(machine, state) : std::string());
  return text;
}

std::string robot_part_footer(const Machine& machine, int part) {
  std::string text;
  RobotLink(machine).close(text);
  text += " textmsg(\"curvesup part " + padded(part, 4) + " finished\")\nend\n";
  if (machine.program.form == ScriptForm::file) text += "part_" + padded(part, 4) + "()\n";
  return text;
}

}  // namespace curvesup::emit
