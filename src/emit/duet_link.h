#pragma once

#include <string>

#include "curvesup/emit/emit.h"
#include "emit/text.h"

// The Duet's side of barriers and gates, for the links in which the Duet runs a job of its own.
namespace curvesup::emit {

class DuetLinkText {
 public:
  explicit DuetLinkText(const Machine& machine)
      : counted_(machine.link.kind == DuetLink::telnet),
        wait_("M577 P" + std::to_string(machine.link.duet_barrier_input)),
        gate_("M577 P" + std::to_string(machine.link.duet_gate_input)),
        answer_("M42 P" + std::to_string(machine.link.duet_acknowledge_output)) {}

  // The work of the part's start barrier stands between these two. `first_signal` is the first one after them.
  void part_start(std::string& text, int part, long first_signal) const {
    if (!counted_) {
      acknowledge(text, false);
      barrier(text, true);
      return;
    }
    text += "M400\nset global.rpart = 0\nwhile global.rpart != ";
    append_integer(text, part);
    text += "\n  G4 P20\nset global.rc = ";
    append_integer(text, first_signal - 1);
    text += '\n';
  }
  void part_ready(std::string& text, int part) const {
    if (counted_) {
      answer(text, "part ", part);
      return;
    }
    acknowledge(text, true);
    barrier(text, false);
    acknowledge(text, false);
  }

  void start(std::string& text, long signal) const { counted_ ? await(text, signal) : barrier(text, true); }
  void started(std::string& text, long signal) const { counted_ ? answer(text, "rc ", signal) : acknowledge(text, true); }
  void end(std::string& text, long signal) const { counted_ ? await(text, signal) : barrier(text, false); }
  void ended(std::string& text, long signal) const { counted_ ? answer(text, "rc ", signal) : acknowledge(text, false); }

  void gate(std::string& text, int number, long signal) const {
    if (counted_) {
      // G4 would wait for standstill; this body only passes the time.
      text += "while global.rc < ";
      append_integer(text, signal);
      text += "\n  set global.rw = 0\n";
      return;
    }
    text += gate_;
    text += number % 2 == 1 ? " S1\n" : " S0\n";
  }

 private:
  void barrier(std::string& text, bool level) const {
    text += "M400\n";
    text += wait_;
    text += level ? " S1\n" : " S0\n";
  }
  void acknowledge(std::string& text, bool level) const {
    text += answer_;
    text += level ? " S1\n" : " S0\n";
  }
  static void await(std::string& text, long signal) {
    text += "M400\nwhile global.rc < ";
    append_integer(text, signal);
    text += "\n  G4 P4\n";
  }
  static void answer(std::string& text, const char* word, long number) {
    text += "M400\nM118 P4 S\"<";
    text += word;
    append_integer(text, number);
    text += ">\"\n";
  }

  bool counted_;
  std::string wait_, gate_, answer_;
};

}  // namespace curvesup::emit
