#pragma once

#include <string>
#include <string_view>

#include "curvesup/emit/emit.h"
#include "emit/text.h"

// The robot's side of barriers and gates, for each kind of link. `work` are the Duet's lines at a barrier: the robot sends
// them itself where the link is `stream`, and else only waits for them.
namespace curvesup::emit {

class RobotLink {
 public:
  explicit RobotLink(const Machine& machine) : link_(machine.link), speeds_(machine.speeds) {}

  [[nodiscard]] bool streams() const { return link_.kind == DuetLink::stream; }

  // Resets and the functions that the other lines call.
  void define(std::string& text, double lift_m) const {
    reset(text, " ");
    run_state(text, 3);
    define_stop(text, lift_m);
    switch (link_.kind) {
      case DuetLink::dio: define_inputs(text); break;
      case DuetLink::telnet: define_socket(text); break;
      case DuetLink::stream: define_socket(text); break;
    }
  }

  void part_barrier(std::string& text, int part, std::string_view work) const {
    const std::string number = std::to_string(part);
    text += " # barrier part " + number + "\n";
    switch (link_.kind) {
      case DuetLink::dio: pair(text, link_.heating_timeout_s); break;
      case DuetLink::telnet: exchange(text, "set global.rpart=" + number, "part " + number, link_.heating_timeout_s); break;
      case DuetLink::stream: send_and_ask(text, work, 0, link_.heating_timeout_s); break;
    }
  }

  // A whole barrier pair without moves in between.
  void work_barrier(std::string& text, long signal, std::string_view work, double seconds) const {
    if (link_.kind == DuetLink::dio) {
      pair(text, seconds);
    } else {
      one_side(text, signal, work, seconds);
      if (!streams()) one_side(text, signal + 1, {}, link_.timeout_s);
    }
  }

  void chain_start(std::string& text, long signal, std::string_view work, double seconds) const {
    if (link_.kind == DuetLink::dio) {
      start(text, seconds);
    } else {
      one_side(text, signal, work, seconds);
    }
    if (link_.duet_lead_s > 0.0) text += " sleep(" + fixed(link_.duet_lead_s, 3) + ")\n";
  }
  void chain_end(std::string& text, long signal, std::string_view work, double seconds) const {
    if (link_.kind == DuetLink::dio) {
      end(text, seconds);
      output(text, " ", link_.robot_gate_output, false);
    } else {
      one_side(text, signal, work, seconds);
    }
  }

  void gate(std::string& text, int number, long signal) const {
    if (link_.kind == DuetLink::dio) {
      output(text, " ", link_.robot_gate_output, number % 2 == 1);
    } else {
      text += " gate = ";
      append_integer(text, signal);
      text += '\n';
    }
  }

  // Link `stream`: one extruder command, at a stop or, by way of the sender, between blended moves.
  static void send(std::string& text, std::string_view line) {
    text += " socket_send_line(\"";
    text += line;
    text += "\", \"duet\")\n";
  }
  void send_in_motion(std::string& text, std::string_view line, long signal) const {
    text += " line = \"";
    text += line;
    text += "\"\n";
    gate(text, 0, signal);
  }

  void close(std::string& text) const {
    reset(text, " ");
    if (link_.kind != DuetLink::dio) text += " kill sender\n socket_close(\"duet\")\n";
    // The Duet pauses when this output drops: keep it up between parts.
    run_state(text, 0);
  }

 private:
  static void output(std::string& text, const char* indent, int number, bool level) {
    text += indent;
    text += "set_standard_digital_out(";
    append_integer(text, number);
    text += level ? ", True)\n" : ", False)\n";
  }
  void reset(std::string& text, const char* indent) const {
    output(text, indent, link_.robot_start_output, false);
    output(text, indent, link_.robot_gate_output, false);
  }
  void run_state(std::string& text, int value) const {
    text += " set_runstate_standard_digital_output_to_value(";
    append_integer(text, link_.robot_run_output);
    text += ", ";
    append_integer(text, value);
    text += ")\n";
  }

  void define_stop(std::string& text, double lift_m) const {
    text += " def lift_and_halt(message):\n";
    reset(text, "  ");
    text += "  lifted = pose_trans(get_actual_tcp_pose(), p[0,0," + fixed(lift_m, 6) + ",0,0,0])\n";
    text += "  if get_inverse_kin_has_solution(lifted):\n";
    text += "   movel(lifted, a=" + fixed(speeds_.travel_acceleration_m_s2, 4) + ", v=" + fixed(speeds_.approach_mm_s / 1000.0, 7) + ")\n";
    text += "  end\n";
    text += "  textmsg(\"curvesup stopped: \", message)\n";
    text += "  popup(message, title=\"curvesup\", error=True, blocking=True)\n";
    text += "  halt\n";
    text += " end\n";
  }
  void define_inputs(std::string& text) const {
    text += " def wait_acknowledge(level, seconds):\n";
    text += "  waited = 0.0\n";
    text += "  while get_standard_digital_in(" + std::to_string(link_.robot_acknowledge_input) + ") != level:\n";
    text += "   sleep(0.004)\n";
    text += "   waited = waited + 0.004\n";
    text += "   if waited > seconds:\n";
    text += "    lift_and_halt(\"No answer from the extruder. See OPERATOR.md: after a stop.\")\n";
    text += "   end\n";
    text += "  end\n";
    text += " end\n";
    wait(text, false, link_.timeout_s);
  }
  // `exchange` repeats its command until the answer comes; the thread sends what changes while the arm moves, because a
  // blended move must not be followed by a socket call.
  void define_socket(std::string& text) const {
    const bool repeats = !streams();
    text += " global gate = 0\n global line = \"\"\n";
    text += " def exchange(command, answer, seconds):\n";
    text += "  waited = 0.0\n  heard = \"\"\n";
    if (!repeats) text += "  socket_send_line(command, \"duet\")\n";
    text += "  while heard != answer:\n";
    if (repeats) text += "   socket_send_line(command, \"duet\")\n";
    text += "   heard = socket_read_string(\"duet\", \"<\", \">\", False, 1.0)\n";
    text += "   sync()\n";
    text += "   if heard == \"\":\n    waited = waited + 1.0\n   end\n";
    text += "   if waited > seconds:\n";
    text += "    lift_and_halt(\"No answer from the extruder. See OPERATOR.md: after a stop.\")\n";
    text += "   end\n  end\n end\n";
    text += " thread send_changes():\n  sent = 0\n  while True:\n   if gate != sent:\n    sent = gate\n";
    text += streams() ? "    socket_send_line(line, \"duet\")\n"
                      : "    socket_send_line(str_cat(\"set global.rc=\", to_str(sent)), \"duet\")\n";
    text += "   end\n   sync()\n  end\n end\n";
    text += " tries = 0\n while not socket_open(\"" + link_.duet_ip + "\", " + std::to_string(link_.telnet_port) + ", \"duet\"):\n";
    text += "  sleep(1.0)\n  tries = tries + 1\n  if tries > 5:\n";
    text += "   lift_and_halt(\"No connection to the extruder board.\")\n  end\n end\n";
    // The board drops the first bytes after a connection.
    text += " sleep(1.5)\n socket_send_line(\"\", \"duet\")\n sleep(0.5)\n";
    text += " sender = run send_changes()\n";
  }

  static void wait(std::string& text, bool level, double seconds) {
    text += level ? " wait_acknowledge(True, " : " wait_acknowledge(False, ";
    append_fixed(text, seconds, 1);
    text += ")\n";
  }
  void start(std::string& text, double seconds) const {
    output(text, " ", link_.robot_start_output, true);
    wait(text, true, seconds);
  }
  void end(std::string& text, double seconds) const {
    output(text, " ", link_.robot_start_output, false);
    wait(text, false, seconds);
  }
  void pair(std::string& text, double seconds) const {
    start(text, seconds);
    end(text, link_.timeout_s);
  }
  void one_side(std::string& text, long signal, std::string_view work, double seconds) const {
    if (streams()) {
      send_and_ask(text, work, signal, seconds);
    } else {
      const std::string number = std::to_string(signal);
      exchange(text, "set global.rc=" + number, "rc " + number, seconds);
    }
  }
  static void exchange(std::string& text, std::string_view command, std::string_view answer, double seconds) {
    text += " exchange(\"";
    text += command;
    text += "\", \"";
    text += answer;
    text += "\", ";
    append_fixed(text, seconds, 1);
    text += ")\n";
  }
  // A string cannot hold a quote: byte 34.
  static void send_and_ask(std::string& text, std::string_view work, long signal, double seconds) {
    while (!work.empty()) {
      const std::size_t end = work.find('\n');
      send(text, work.substr(0, end));
      work.remove_prefix(end + 1);
    }
    const std::string answer = "rc " + std::to_string(signal);
    send(text, "M400");
    text += " socket_send_string(\"M118 P4 S\", \"duet\")\n socket_send_byte(34, \"duet\")\n socket_send_string(\"<" + answer +
            ">\", \"duet\")\n socket_send_byte(34, \"duet\")\n";
    exchange(text, "", answer, seconds);
  }

  const Link& link_;
  const Speeds& speeds_;
};

}  // namespace curvesup::emit
