#include <algorithm>
#include <cmath>
#include <deque>

#include "check/emitted_sync.h"
#include "curvesup/core/parallel.h"

namespace curvesup::emitted {

namespace {

constexpr double kLate_s = 0.02;          // of a slow extruder board behind each acknowledge
constexpr std::size_t kQueuedMoves = 40;  // of the smaller boards

// Values that a signal takes, by time.
class Signal {
 public:
  void set(double time, int value) { changes_.push_back({time, value}); }

  // The first time from `time` on at which the signal holds; false when it does not yet. Calls come in order of time.
  template <class Holds>
  bool when(double& time, const Holds& holds) {
    while (at_ + 1 < changes_.size() && changes_[at_ + 1].time <= time) ++at_;
    if (holds(changes_[at_].value)) return true;
    for (std::size_t k = at_ + 1; k < changes_.size(); ++k) {
      if (!holds(changes_[k].value)) continue;
      at_ = k;
      time = changes_[k].time;
      return true;
    }
    return false;
  }

 private:
  struct Change {
    double time;
    int value;
  };
  std::vector<Change> changes_ = {{-1.0, 0}};
  std::size_t at_ = 0;
};

struct Wires {
  Signal barrier, gate, acknowledge, part;
  std::vector<double> gate_times;  // of all gates of all chains, when the arm set them
};

// The arm: runs until it waits for something that has not happened.
class RobotProcess {
 public:
  RobotProcess(const Programs& programs, const Machine& machine, Wires& wires) : programs_(programs), machine_(machine), wires_(wires) {
    for (const Chain& chain : programs.chains) {
      for (std::size_t k = 0; k < chain.moves; ++k) printing_.push_back(chain.robot_s[k]);
    }
    part_s_.resize(programs.parts.size());
  }

  // True when it did something.
  bool run() {
    const std::size_t before = steps_;
    while (part_ < programs_.parts.size()) {
      const RobotPart& part = programs_.parts[part_];
      if (event_ == part.events.size()) {
        part_s_[part_] = time_ - part_begin_;
        part_begin_ = time_;
        ++part_;
        event_ = 0;
        open_ = false;
        continue;
      }
      if (!step(part, part.events[event_])) break;
      ++event_;
      ++steps_;
    }
    return steps_ != before;
  }
  [[nodiscard]] bool done() const { return part_ == programs_.parts.size(); }
  [[nodiscard]] double time() const { return time_; }
  [[nodiscard]] const std::vector<double>& part_s() const { return part_s_; }
  [[nodiscard]] const std::string& too_late() const { return too_late_; }
  [[nodiscard]] Place place() const {
    if (done()) return {};
    return {programs_.parts[part_].file, programs_.parts[part_].events[event_].line};
  }

 private:
  bool step(const RobotPart& part, const RobotEvent& event) {
    const Link& link = machine_.link;
    switch (event.kind) {
      case RobotEvent::Kind::path:
      case RobotEvent::Kind::barrier: return true;
      case RobotEvent::Kind::sleep: time_ += static_cast<double>(event.seconds); return true;
      case RobotEvent::Kind::move: time_ += seconds_of(part, static_cast<std::size_t>(event.number)); return true;
      case RobotEvent::Kind::output:
        if (event.number == link.robot_start_output) {
          open_ = event.level;
          wires_.barrier.set(time_, event.level);
        } else if (event.number == link.robot_gate_output) {
          wires_.gate.set(time_, event.level);
          if (open_) wires_.gate_times.push_back(time_);
        }
        return true;
      case RobotEvent::Kind::set_gate:
        wires_.barrier.set(time_, event.number);
        wires_.gate_times.push_back(time_);
        return true;
      case RobotEvent::Kind::wait: return wait(event, [&](int level) { return level == static_cast<int>(event.level); });
      case RobotEvent::Kind::exchange:
        if (!asked_) {
          (event.number < 0 ? wires_.part : wires_.barrier).set(time_, std::abs(event.number));
          asked_ = true;
        }
        if (!wait(event, [&](int answer) { return answer == event.number; })) return false;
        asked_ = false;
        return true;
    }
    return true;
  }

  template <class Holds>
  bool wait(const RobotEvent& event, const Holds& holds) {
    const double begin = time_;
    if (!wires_.acknowledge.when(time_, holds)) return false;
    if (time_ - begin > static_cast<double>(event.seconds) && too_late_.empty()) {
      too_late_ = programs_.parts[part_].file + ":" + std::to_string(event.line) + ": the answer comes after the timeout";
    }
    return true;
  }

  double seconds_of(const RobotPart& part, std::size_t i) {
    const RobotMove& move = part.moves[i];
    if (move.kind == RobotMove::Kind::process) return next_print_ < printing_.size() ? static_cast<double>(printing_[next_print_++]) : 0.0;
    if (i == 0) return 0.0;  // the arm stands there
    const RobotMove& from = part.moves[i - 1];
    const double v = std::max(static_cast<double>(move.v), 1e-9), a = std::max(static_cast<double>(move.a), 1e-9);
    if (move.kind == RobotMove::Kind::linear) {
      const double way = planned_length_m(from.pose, move.pose, machine_.speeds.rotation_rad_per_m);
      return way / v + v / a;
    }
    double turn = 0.0;
    for (std::size_t j = 0; j < 6; ++j) turn = std::max(turn, std::abs(move.reached[j] - from.reached[j]));
    return turn > v * v / a ? turn / v + v / a : 2.0 * std::sqrt(turn / a);
  }

  const Programs& programs_;
  const Machine& machine_;
  Wires& wires_;
  std::vector<float> printing_;  // of all printing moves in order
  std::vector<double> part_s_;
  std::size_t next_print_ = 0, part_ = 0, event_ = 0, steps_ = 0;
  double time_ = 0.0, part_begin_ = 0.0;
  bool open_ = false, asked_ = false;
  std::string too_late_;
};

// The board: reads ahead of what it moves, up to its queue.
class BoardProcess {
 public:
  BoardProcess(const Programs& programs, const Machine& machine, Wires& wires, double late_s)
      : job_(programs.job), machine_(machine), wires_(wires), late_(late_s), seconds_(job_.moves.size(), -1.0f) {
    for (const Chain& chain : programs.chains) {
      for (std::size_t k = 0; k < chain.moves; ++k) seconds_[chain.job_first + k] = chain.job_s[k];
    }
  }

  bool run() {
    const std::size_t before = event_;
    while (event_ < job_.events.size() && step(job_.events[event_])) ++event_;
    return event_ != before;
  }
  [[nodiscard]] bool done() const { return event_ == job_.events.size(); }
  [[nodiscard]] double time() const { return std::max(time_, motion_); }
  [[nodiscard]] std::size_t slips() const { return slips_; }
  [[nodiscard]] int first_slip_line() const { return first_slip_; }
  [[nodiscard]] int line() const { return done() ? 0 : job_.events[event_].line; }

 private:
  bool step(const JobEvent& event) {
    const Link& link = machine_.link;
    switch (event.kind) {
      case JobEvent::Kind::move: queue(static_cast<std::size_t>(event.number)); return true;
      case JobEvent::Kind::stop: time_ = std::max(time_, motion_); return true;
      case JobEvent::Kind::output:
        wires_.acknowledge.set(std::max(time_, motion_), event.level);
        if (event.level) time_ = std::max(time_, motion_) + late_;
        return true;
      case JobEvent::Kind::wait_input: {
        const auto holds = [&](int level) { return level == static_cast<int>(event.level); };
        if (event.number == link.duet_barrier_input) return wires_.barrier.when(time_, holds);
        return wires_.gate.when(time_, holds) && pass_gate(event.line);
      }
      case JobEvent::Kind::wait_signal: {
        const auto holds = [&](int signal) { return signal >= std::abs(event.number); };
        if (event.number < 0) return wires_.part.when(time_, holds);
        if (!wires_.barrier.when(time_, holds)) return false;
        return event.level || pass_gate(event.line);
      }
      case JobEvent::Kind::answer:
        wires_.acknowledge.set(std::max(time_, motion_), event.number);
        time_ = std::max(time_, motion_) + late_;
        return true;
      default: return true;
    }
  }

  // The n-th gate of the job must be passed while the arm's n-th stands: not before it, not after the next but one.
  bool pass_gate(int line) {
    const std::size_t n = gates_++;
    const bool early = n >= wires_.gate_times.size() || wires_.gate_times[n] > time_ + 1e-9;
    const bool late = machine_.link.kind == DuetLink::dio && n + 2 < wires_.gate_times.size() && wires_.gate_times[n + 2] <= time_ + 1e-9;
    if (early || late) {
      if (slips_++ == 0) first_slip_ = line;
    }
    return true;
  }

  void queue(std::size_t i) {
    const JobMove& move = job_.moves[i];
    double seconds = static_cast<double>(seconds_[i]);
    if (seconds < 0.0) {
      const double way = move.has_xyz ? job_.length_mm(i) : static_cast<double>(std::abs(move.e_mm));
      seconds = move.feed_mm_s > 0.0f ? way / static_cast<double>(move.feed_mm_s) : 0.0;
    }
    while (!ends_.empty() && ends_.front() <= time_) ends_.pop_front();
    if (ends_.size() >= kQueuedMoves) {
      time_ = ends_.front();
      ends_.pop_front();
    }
    motion_ = std::max(motion_, time_) + seconds;
    ends_.push_back(motion_);
  }

  const Job& job_;
  const Machine& machine_;
  Wires& wires_;
  double late_;
  std::vector<float> seconds_;  // of each move of a chain, else < 0
  std::size_t event_ = 0, gates_ = 0, slips_ = 0;
  int first_slip_ = 0;
  double time_ = 0.0, motion_ = 0.0;
  std::deque<double> ends_;
};

// What a run on one clock tells.
struct Simulated {
  Findings findings;
  std::vector<double> part_s;
  double seconds = 0.0;
  bool ended = false;
};

void simulate(const Programs& programs, const Machine& machine, double late_s, Simulated& result) {
  Findings& findings = result.findings;
  Wires wires;
  RobotProcess robot(programs, machine, wires);
  BoardProcess board(programs, machine, wires, late_s);
  while (true) {
    const bool moved = robot.run();
    if (!board.run() && !moved) break;
  }
  const Place place{programs.job.file, board.line()};
  if (!robot.done() || !board.done()) {
    findings.fail(Rule::deadlock, place, "both programs wait for each other; the script at " + std::string(robot.place().file) + ":" + std::to_string(robot.place().line));
    return;
  }
  if (!robot.too_late().empty()) findings.fail(Rule::deadlock, {}, robot.too_late());
  if (board.slips() > 0) {
    findings.fail(Rule::deadlock, {programs.job.file, board.first_slip_line()}, "a gate is passed at the wrong time, " + std::to_string(board.slips()) + " in all");
  }
  result.ended = true;
  result.part_s = robot.part_s();
  result.seconds = std::max(robot.time(), board.time());
}

}  // namespace

void run_clocks(Programs& programs, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures) {
  Simulated results[2];
  parallel_for(2, 1, run, [&](std::size_t i, std::size_t, std::size_t) { simulate(programs, machine, i == 0 ? 0.0 : kLate_s, results[i]); });
  for (const Simulated& result : results) findings.merge(result.findings);
  if (!results[0].ended) return;
  programs.part_s = results[0].part_s;
  figures.simulated_s = results[0].seconds;
  figures.header_s = static_cast<double>(programs.job.header.time_s);
  const double error = std::abs(figures.simulated_s - figures.header_s) - 0.5;
  findings.at_most(Rule::total_time, std::max(0.0, error) / std::max(1.0, figures.simulated_s), 0.01, {programs.job.file, 0}, "the time in the header is not what the print takes");
}

}  // namespace curvesup::emitted
