#pragma once

#include <string>

#include "curvesup/emit/emit.h"
#include "emit/text.h"

// The Duet's side of barriers and gates, for each kind of link.
namespace curvesup::emit {

class DuetLinkText {
 public:
  explicit DuetLinkText(const Machine& machine)
      : wait_("M577 P" + std::to_string(machine.link.duet_barrier_input)),
        gate_("M577 P" + std::to_string(machine.link.duet_gate_input)),
        answer_("M42 P" + std::to_string(machine.link.duet_acknowledge_output)) {}

  void reset(std::string& text) const { text += answer_ + " S0\n"; }

  // Work of the part's start barrier stands between these two.
  void part_start(std::string& text, int) const { barrier(text, true); }
  void part_ready(std::string& text, int, long) const {
    acknowledge(text, true);
    barrier(text, false);
    acknowledge(text, false);
  }

  void start(std::string& text, long) const { barrier(text, true); }
  void started(std::string& text, long) const { acknowledge(text, true); }
  void end(std::string& text, long) const { barrier(text, false); }
  void ended(std::string& text, long) const { acknowledge(text, false); }
  void gate(std::string& text, int number, long) const {
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

  std::string wait_, gate_, answer_;
};

}  // namespace curvesup::emit
