#pragma once

#include <string>

#include "curvesup/emit/emit.h"
#include "emit/text.h"

// The robot's side of barriers and gates, for each kind of link.
namespace curvesup::emit {

class RobotLink {
 public:
  explicit RobotLink(const Machine& machine) : link_(machine.link) {}

  // Resets and the functions that the other lines call.
  void define(std::string& text, double lift_m, double acceleration, double speed) const {
    reset(text, " ");
    text += " set_runstate_standard_digital_output_to_value(";
    append_integer(text, link_.robot_run_output);
    text += ", 3)\n";
    text += " def lift_and_halt(message):\n";
    reset(text, "  ");
    text += "  lifted = pose_trans(get_actual_tcp_pose(), p[0,0," + fixed(lift_m, 6) + ",0,0,0])\n";
    text += "  if get_inverse_kin_has_solution(lifted):\n";
    text += "   movel(lifted, a=" + fixed(acceleration, 4) + ", v=" + fixed(speed, 7) + ")\n";
    text += "  end\n";
    text += "  textmsg(\"curvesup stopped: \", message)\n";
    text += "  popup(message, title=\"curvesup\", error=True, blocking=True)\n";
    text += "  halt\n";
    text += " end\n";
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

  void part_barrier(std::string& text, int part) const {
    text += " # barrier part " + std::to_string(part) + "\n";
    start(text, link_.heating_timeout_s);
    end(text, link_.timeout_s);
  }

  // A whole barrier pair without moves in between.
  void work_barrier(std::string& text, long, double seconds) const {
    start(text, seconds);
    end(text, link_.timeout_s);
  }

  void chain_start(std::string& text, long, double seconds) const {
    start(text, seconds);
    if (link_.duet_lead_s > 0.0) text += " sleep(" + fixed(link_.duet_lead_s, 3) + ")\n";
  }
  void chain_end(std::string& text, long, double seconds) const {
    end(text, seconds);
    output(text, " ", link_.robot_gate_output, false);
  }
  void gate(std::string& text, int number, long) const { output(text, " ", link_.robot_gate_output, number % 2 == 1); }

  void close(std::string& text) const { reset(text, " "); }

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

  const Link& link_;
};

}  // namespace curvesup::emit
