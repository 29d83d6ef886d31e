#include "emit/companions.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/format.h"
#include "emit/text.h"

namespace curvesup::emit {

namespace {

bool two_tools(const Machine& machine) { return machine.filaments[0].tool != machine.filaments[1].tool; }

// The filaments, one a tool.
std::vector<Filament> tools_of(const Machine& machine) {
  std::vector<Filament> tools{machine.filaments[0]};
  if (two_tools(machine)) tools.push_back(machine.filaments[1]);
  std::sort(tools.begin(), tools.end(), [](const Filament& a, const Filament& b) { return a.tool < b.tool; });
  return tools;
}

// Per extruder drive, in the order of the drives: "60:60".
std::string per_drive(const std::string& value, std::size_t drives) {
  std::string text = value;
  for (std::size_t i = 1; i < drives; ++i) text += ":" + value;
  return text;
}

std::string link_pins(const Machine& machine) {
  const Link& link = machine.link;
  std::string text;
  if (link.kind == DuetLink::dio) {
    text += "M950 J" + std::to_string(link.duet_barrier_input) + " C\"" + link.duet_barrier_pin + "\"   ; from robot DO" +
            std::to_string(link.robot_start_output) + ": barriers\n";
    text += "M950 J" + std::to_string(link.duet_gate_input) + " C\"" + link.duet_gate_pin + "\"   ; from robot DO" +
            std::to_string(link.robot_gate_output) + ": gates\n";
    text += "M950 P" + std::to_string(link.duet_acknowledge_output) + " C\"" + link.duet_acknowledge_pin +
            "\"   ; to robot DI" + std::to_string(link.robot_acknowledge_input) + ": acknowledge\n";
  } else {
    text += "M586 P2 S1 T0   ; telnet on; no password (M551 without P)\n";
    text += "if !exists(global.rc)\n  global rc = 0\nif !exists(global.rpart)\n  global rpart = 0\nif !exists(global.rw)\n  global rw = 0\n";
  }
  text += "M950 J" + std::to_string(link.duet_run_input) + " C\"" + link.duet_run_pin + "\"   ; from robot DO" +
          std::to_string(link.robot_run_output) + ": program runs\n";
  text += "M581 P" + std::to_string(link.duet_run_input) + " T1 S0 R1   ; pause the job when the robot program stops\n";
  return text;
}

std::string wiring_table(const Machine& machine) {
  const Link& link = machine.link;
  std::string text = "| robot | Duet | meaning |\n| --- | --- | --- |\n";
  if (link.kind == DuetLink::dio) {
    text += format("| DO%d | %s (J%d) | barrier: 1 at the start of a path, 0 at its end |\n", link.robot_start_output,
                   link.duet_barrier_pin.c_str(), link.duet_barrier_input);
    text += format("| DO%d | %s (J%d) | gates inside a path |\n", link.robot_gate_output, link.duet_gate_pin.c_str(), link.duet_gate_input);
    text += format("| DI%d | %s (P%d) | acknowledge |\n", link.robot_acknowledge_input, link.duet_acknowledge_pin.c_str(),
                   link.duet_acknowledge_output);
  } else {
    text += format("| Ethernet | %s, telnet port %d | barriers, gates, acknowledge |\n", link.duet_ip.c_str(), link.telnet_port);
  }
  text += format("| DO%d | %s (J%d) | robot program runs; the Duet pauses when it drops |\n", link.robot_run_output,
                 link.duet_run_pin.c_str(), link.duet_run_input);
  text += "\nRobot outputs are 24 V PNP. Inputs of a Duet 3 expansion header take them; a Duet 2 has 3.3 V inputs and needs an\n"
          "opto-coupler or divider. A Duet output reaches the robot's 24 V input through a relay or opto-coupler. Join the grounds.\n";
  if (link.kind != DuetLink::dio) {
    text += "Router and cables only: telnet must be on, without a password. Nobody else may use the Duet's telnet meanwhile.\n";
  }
  return text;
}

std::string start_section(const Machine& machine) {
  std::string text = "## Start\n\n";
  text += "1. Park the filaments with their tips at the Y-junction. Clear the platform. Arm near its home pose.\n";
  if (machine.link.kind == DuetLink::stream) {
    text += "2. Run `duet/print.g` on the Duet (it prepares the board and ends).\n";
  } else {
    text += "2. Start `duet/print.g` on the Duet: it waits for the robot. Do not simulate it (it would wait for ever).\n";
  }
  text += "3. `python3 robot/play_parts.py ROBOT_IP` with the robot in remote control, or load the parts one after another on the\n"
          "   pendant as *Script: File* nodes (form `file`).\n"
          "4. Speed slider at 100 %, no reduced mode, `M220 S100` on the Duet. `pause.g` and `resume.g` must not move X, Y, Z.\n\n";
  return text;
}

std::string stop_section(const Machine& machine) {
  std::string text = "## After a stop\n\n";
  text += "When an answer stays away the robot lifts the nozzle along its axis, says so and halts. After a protective stop do it by\n"
          "hand. Then, to resume from part N:\n\n"
          "1. Pause and cancel the Duet job. Jog the arm clear of the print and towards home; a part starts with a joint move to the\n"
          "   place where the part before ended, lifted.\n";
  text += "2. The nozzle must hold the filament that part N starts with, **retracted** by " +
          fixed(machine.filaments[0].retract_mm, 2) + " mm (" + machine.filaments[0].name + ") or " +
          fixed(machine.filaments[1].retract_mm, 2) + " mm (" + machine.filaments[1].name + "). If part N starts with a change, it is\n"
          "   the filament before the change. Remove what was printed of part N's first path, or accept it twice.\n";
  if (machine.link.kind != DuetLink::stream) {
    text += "3. On the Duet: `M23 \"print.g\"`, `M26 S<byte offset of part N>`, `M24`. Offsets: table below, `manifest.json`.\n";
  } else {
    text += "3. Run `duet/print.g` on the Duet again.\n";
  }
  text += "4. `python3 robot/play_parts.py ROBOT_IP --from N`.\n\n";
  return text;
}

std::string part_rows(const std::vector<EmittedPart>& parts) {
  // One page: the first parts and the last; the manifest lists all.
  constexpr std::size_t kRows = 12;
  std::string text = "| part | paths | minutes | byte offset in print.g |\n| --- | --- | --- | --- |\n";
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts.size() > kRows && p == kRows - 2) {
      text += "| ... | see `manifest.json` | | |\n";
      p = parts.size() - 1;
    }
    const EmittedPart& part = parts[p];
    text += format("| %zu | %d to %d | %.1f | %zu |\n", p + 1, part.chains.front().path, part.chains.back().path,
                   part.expected_s / 60.0, part.duet_offset);
  }
  return text;
}

}  // namespace

std::string config_snippet(const Machine& machine) {
  const std::vector<Filament> tools = tools_of(machine);
  const std::size_t drives = tools.size();
  const int driver = machine.extruder.driver;
  std::string text = "; Into config.g of the Duet, once. X, Y and Z have no motors: they carry the nozzle's way so that the extruder\n"
                     "; keeps step with it. Adapt driver and pin names to the board.\n";
  text += "M584 X" + std::to_string(driver + 2) + " Y" + std::to_string(driver + 3) + " Z" + std::to_string(driver + 4) + " E" +
          std::to_string(driver) + (drives > 1 ? ":" + std::to_string(driver + 1) : "") + "\n";
  text += "M350 X16 Y16 Z16\nM92 X80 Y80 Z80\nM906 X0 Y0 Z0\n";
  text += "M203 X60000 Y60000 Z60000 E" + per_drive(fixed(60.0 * machine.extruder.max_e_mm_s, 1), drives) + " I0.6\n";
  text += "M201 X20000 Y20000 Z20000 E" + per_drive(fixed(machine.extruder.e_acceleration_mm_s2, 1), drives) + "\n";
  text += "M566 X60000 Y60000 Z60000 E" + per_drive(fixed(60.0 * machine.extruder.e_jerk_mm_s, 1), drives) + "\n";
  text += "M564 H0 S0\n";
  double cold = tools.front().min_temperature_c;
  for (std::size_t i = 0; i < drives; ++i) {
    const Filament& tool = tools[i];
    cold = std::min(cold, tool.min_temperature_c);
    text += "M563 P" + std::to_string(tool.tool) + " S\"" + tool.name + "\" D" + std::to_string(i) + " H" +
            std::to_string(machine.extruder.heater) + " F" + std::to_string(machine.extruder.fan) + "\n";
    text += "M572 D" + std::to_string(i) + " S" + fixed(tool.pressure_advance_s, 3) + "\n";
  }
  text += "M302 S" + fixed(cold, 0) + " R" + fixed(std::max(90.0, cold - 70.0), 0) + "\n";
  return text + link_pins(machine);
}

EmittedFile small_file(std::string name, std::string description, std::string text) {
  return {std::move(name), std::move(description), [text = std::move(text)](const ByteSink& sink) { sink(text); }};
}

std::vector<EmittedFile> tool_macros(const Machine& machine) {
  std::vector<EmittedFile> files;
  for (const Filament& tool : tools_of(machine)) {
    const std::string number = std::to_string(tool.tool);
    const auto add = [&](const std::string& stem, const std::string& what, const std::string& commands) {
      files.push_back(small_file("duet/" + stem + number + ".g", "tool macro of the Duet, " + what + " tool " + number,
                                 "; " + what + " tool " + number + " (" + tool.name + "): the job itself unloads and loads the filament\n" + commands));
    };
    add("tfree", "before leaving", "M106 P" + std::to_string(machine.extruder.fan) + " S0\n");
    add("tpre", "before taking", "M83\n");
    add("tpost", "after taking", "M83\n");
  }
  return files;
}

std::string operator_page(const Machine& machine, const EmitOptions& options, const std::vector<EmittedPart>& parts,
                          const EmitReport& report) {
  const char* link = machine.link.kind == DuetLink::dio ? "dio" : machine.link.kind == DuetLink::telnet ? "telnet" : "stream";
  std::string text = "# " + options.title + " on " + machine.name + "\n\n";
  text += format("%zu parts, %d layers, about %.1f h; filament %.1f m %s, %.1f m %s; %d changes of material. Link: `%s`.\n\n",
                 parts.size(), report.layers, report.time_s / 3600.0, report.filament_mm[0] / 1000.0, machine.filaments[0].name.c_str(),
                 report.filament_mm[1] / 1000.0, machine.filaments[1].name.c_str(), report.material_changes, link);
  text += "## Once\n\nPut `duet/config_snippet.g` into the Duet's `config.g`, the other `duet/*.g` but `print.g` into its `/sys`.\n"
          "Calibrate the TCP on the pendant and compare with `set_tcp` in a part: the nozzle tip, Z away from the part.\n\n";
  text += wiring_table(machine) + "\n";
  text += "## Calibration prints\n\n"
          "1. A straight single bead of 200 mm at print speed: the end barrier must close within 50 ms of the robot's stop, and the\n"
          "   bead must weigh what `toolpaths.vtp` says. Correct `flow`.\n"
          "2. An arc with 45 degrees of tilt: if the robot is slower than planned, lower `machine.speeds.rotation_rad_per_m`; if a\n"
          "   blend is skipped or a stop is reported, raise `machine.tolerances.min_blend_mm`.\n"
          "3. Ten short beads: ooze or gaps at the starts set `retract_mm` and `machine.link.duet_lead_s`.\n\n";
  text += start_section(machine) + stop_section(machine) + part_rows(parts);
  return text;
}

std::string player_script() {
  return R"PY(#!/usr/bin/env python3
"""Send the parts of a print to a UR robot, one after another.

    play_parts.py ROBOT_IP [--from N] [--to N] [--folder F] [--port 30002] [--watch-port 30001]

Each part is sent to the secondary interface (30002); its message "curvesup part NNNN finished" on the primary interface
(30001) starts the next. "curvesup stopped" or a lost connection ends the run: see OPERATOR.md, "After a stop".
"""
import argparse
import pathlib
import re
import socket
import sys
import time


def parts_in(folder, first, last):
    parts = []
    for path in sorted(folder.glob("part_*.script")):
        match = re.fullmatch(r"part_(\d+)\.script", path.name)
        if match and first <= int(match[1]) and (last is None or int(match[1]) <= last):
            parts.append((int(match[1]), path))
    return sorted(parts)


def program_text(path):
    """The bare function: the interface runs it without a trailing call."""
    text = path.read_text(encoding="ascii")
    name = re.match(r"def (\w+)\(\):\n", text)[1]
    call = name + "()\n"
    if text.endswith("\nend\n" + call):
        text = text[:-len(call)]
    if not text.endswith("\nend\n"):
        raise ValueError(str(path) + ": not a whole program")
    return text


def wait_for_end(watch, number, quiet_s):
    """Read the primary interface until this part says how it ended."""
    finished = b"curvesup part %04d finished" % number
    tail = b""
    last_data = time.monotonic()
    while True:
        try:
            data = watch.recv(65536)
        except socket.timeout:
            data = None
        if data == b"":
            raise ConnectionError("the robot closed the connection")
        if data:
            last_data = time.monotonic()
            tail += data
            if finished in tail:
                return True
            if b"curvesup stopped" in tail:
                return False
            tail = tail[-200:]
        elif time.monotonic() - last_data > quiet_s:
            raise ConnectionError("nothing heard from the robot for %d s" % quiet_s)


def main():
    parser = argparse.ArgumentParser(description="Send robot parts in order.")
    parser.add_argument("robot_ip")
    parser.add_argument("--from", dest="first", type=int, default=1, help="first part (default 1)")
    parser.add_argument("--to", dest="last", type=int, default=None, help="last part (default: all)")
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent)
    parser.add_argument("--port", type=int, default=30002, help="port that takes the programs")
    parser.add_argument("--watch-port", type=int, default=30001, help="port that carries the messages")
    parser.add_argument("--quiet", type=float, default=30.0, help="seconds of silence that count as a lost robot")
    arguments = parser.parse_args()

    parts = parts_in(arguments.folder, arguments.first, arguments.last)
    if not parts:
        print("no part_*.script from part %d in %s" % (arguments.first, arguments.folder), file=sys.stderr)
        return 2
    for number, path in parts:
        text = program_text(path)
        with socket.create_connection((arguments.robot_ip, arguments.watch_port), timeout=5) as watch:
            watch.settimeout(1.0)
            with socket.create_connection((arguments.robot_ip, arguments.port), timeout=5) as send:
                send.sendall(text.encode("ascii"))
                # The interface wants some of its own bytes read before the socket closes.
                received = 0
                while received < 79:
                    data = send.recv(4096)
                    if not data:
                        break
                    received += len(data)
                print("part %d of %d started" % (number, parts[-1][0]), flush=True)
                if not wait_for_end(watch, number, arguments.quiet):
                    print("part %d stopped; resume with --from %d" % (number, number), file=sys.stderr)
                    return 1
        print("part %d finished" % number, flush=True)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (OSError, ValueError) as error:
        print("play_parts: %s" % error, file=sys.stderr)
        sys.exit(1)
)PY";
}

}  // namespace curvesup::emit
