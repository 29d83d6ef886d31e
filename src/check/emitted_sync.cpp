#include "check/emitted_sync.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

namespace curvesup::emitted {

namespace {

constexpr double kLate_s = 0.02;          // of a slow extruder board behind each acknowledge
constexpr std::size_t kQueuedMoves = 40;  // of the smaller boards

// ---- meeting points of the robot's programs

class RobotPairs {
 public:
  RobotPairs(const Programs& programs, const Machine& machine, Findings& findings) : programs_(programs), link_(machine.link), findings_(findings) {}

  std::vector<BarrierPair> read() {
    for (part_ = 0; part_ < programs_.parts.size(); ++part_) read_part(programs_.parts[part_]);
    return std::move(pairs_);
  }

 private:
  enum class State { idle, starting, open, ending };

  void read_part(const RobotPart& part) {
    state_ = State::idle;
    bool moved = false;
    barrier_ = -1;
    comment_ = -1;
    for (const RobotEvent& event : part.events) {
      place_ = {part.file, event.line};
      switch (event.kind) {
        case RobotEvent::Kind::barrier: barrier_ = event.number; break;
        case RobotEvent::Kind::path: comment_ = event.number; break;
        case RobotEvent::Kind::sleep: rest(event); break;
        case RobotEvent::Kind::output: output(event); break;
        case RobotEvent::Kind::wait: wait(event, moved); break;
        case RobotEvent::Kind::exchange: exchange(event); break;
        case RobotEvent::Kind::set_gate: gate(event.number, event.line); break;
        case RobotEvent::Kind::move: move(part, event); moved = true; break;
      }
    }
    findings_.expect(state_ == State::idle, Rule::barriers, place_, "the part ends inside a barrier pair");
  }

  void fail(std::string_view what) { findings_.fail(Rule::barriers, place_, what); }

  void start(int line) {
    if (state_ != State::idle) fail("a barrier starts before the one before has ended");
    state_ = State::starting;
    BarrierPair pair;
    pair.kind = barrier_ == 1 ? PairKind::path : barrier_ == 2 ? PairKind::change : barrier_ == 3 ? PairKind::unload : PairKind::part;
    if (barrier_ < 0) fail("a barrier without its comment");
    pair.part = part_;
    pair.comment = pair.kind == PairKind::path ? comment_ : -1;
    pair.line = line;
    barrier_ = -1;
    pairs_.push_back(std::move(pair));
  }

  void output(const RobotEvent& event) {
    if (event.number == link_.robot_gate_output && event.number != link_.robot_start_output) {
      if (state_ == State::open) return gate(event.level, event.line);
      if (event.level) fail("a gate outside a chain");
      return;
    }
    if (event.number != link_.robot_start_output) return fail("an output that the link does not use");
    if (event.level) return start(event.line);
    if (state_ == State::idle) return;  // reset
    if (state_ != State::open) return fail("a barrier ends before its start was acknowledged");
    state_ = State::ending;
  }

  void wait(const RobotEvent& event, bool moved) {
    if (event.level && state_ == State::starting) {
      state_ = State::open;
    } else if (!event.level && state_ == State::ending) {
      state_ = State::idle;
    } else if (event.level || moved || state_ != State::idle) {
      fail("an acknowledge that no barrier asks for");
    }
  }

  void exchange(const RobotEvent& event) {
    if (event.number < 0) {
      if (state_ != State::idle) fail("the part's barrier inside another one");
      start(event.line);
      pairs_.back().gates.push_back({0, event.number, event.line});
      state_ = State::idle;
      return;
    }
    if (event.number != ++signal_) fail("signals do not count 1, 2, ...");
    if (state_ == State::idle) {
      start(event.line);
      state_ = State::open;
    } else {
      state_ = State::idle;
    }
  }

  void gate(int number, int line) {
    if (state_ != State::open) return fail("a gate outside a chain");
    if (link_.kind == DuetLink::telnet && number != ++signal_) fail("signals do not count 1, 2, ...");
    pairs_.back().gates.push_back({static_cast<int>(pairs_.back().moves), number, line});
  }

  // Before the first move of a chain it is the lead that the board is given.
  void rest(const RobotEvent& event) {
    if (state_ == State::open && pairs_.back().moves > 0) pairs_.back().rests.push_back({static_cast<int>(pairs_.back().moves), event.seconds});
  }

  void move(const RobotPart& part, const RobotEvent& event) {
    const bool process = part.moves[static_cast<std::size_t>(event.number)].kind == RobotMove::Kind::process;
    if (state_ == State::starting || state_ == State::ending) return fail("a move before the acknowledge");
    if (process != (state_ == State::open)) return fail(process ? "a printing move outside a barrier pair" : "a travel inside a barrier pair");
    if (!process) return;
    if (pairs_.back().kind != PairKind::path) return fail("a printing move outside a chain");
    if (pairs_.back().moves++ == 0) pairs_.back().first_move = static_cast<std::size_t>(event.number);
  }

  const Programs& programs_;
  const Link& link_;
  Findings& findings_;
  std::vector<BarrierPair> pairs_;
  State state_ = State::idle;
  std::size_t part_ = 0;
  Place place_;
  int barrier_ = -1, comment_ = -1, signal_ = 0;
};

// ---- meeting points of the job

class JobPairs {
 public:
  JobPairs(const Job& job, const Machine& machine, Findings& findings) : job_(job), link_(machine.link), findings_(findings) {}

  std::vector<BarrierPair> read() {
    const JobEvent* before = nullptr;
    for (const JobEvent& event : job_.events) {
      place_ = {job_.file, event.line};
      read_event(event, before && before->kind == JobEvent::Kind::stop);
      if (event.kind == JobEvent::Kind::path || event.kind == JobEvent::Kind::part || event.kind == JobEvent::Kind::change) {
        check_idle();
      }
      before = &event;
    }
    if (state_ != State::idle) fail("the job ends inside a barrier pair");
    return std::move(pairs_);
  }

 private:
  enum class State { idle, starting, open, ending };

  void fail(std::string_view what) { findings_.fail(Rule::barriers, place_, what); }
  void check_idle() {
    if (state_ != State::idle) fail("a new part of the job inside a barrier pair");
  }

  void read_event(const JobEvent& event, bool stands) {
    switch (event.kind) {
      case JobEvent::Kind::part: next_ = PairKind::part; ++parts_; break;
      case JobEvent::Kind::change: next_ = PairKind::change; break;
      case JobEvent::Kind::end: next_ = PairKind::unload; break;
      case JobEvent::Kind::path: next_ = PairKind::path; comment_ = event.number; break;
      case JobEvent::Kind::wait_input: wait(event, stands); break;
      case JobEvent::Kind::wait_signal: signal(event, stands); break;
      case JobEvent::Kind::output: acknowledge(event.number == link_.duet_acknowledge_output, event.level); break;
      case JobEvent::Kind::answer: answer(event.number); break;
      case JobEvent::Kind::stop:
        if (state_ == State::open && pairs_.back().moves > 0) pairs_.back().stops.push_back(static_cast<int>(pairs_.back().moves));
        break;
      case JobEvent::Kind::move: move(event); break;
      case JobEvent::Kind::tool: tool(); break;
      case JobEvent::Kind::heat_wait:
      case JobEvent::Kind::other: break;
    }
  }

  void begin(bool stands, int line) {
    if (!stands) fail("a barrier without M400 before it");
    if (state_ != State::idle) fail("a barrier starts inside another one");
    BarrierPair pair;
    pair.kind = next_;
    pair.part = parts_ > 0 ? parts_ - 1 : 0;
    pair.comment = next_ == PairKind::path ? comment_ : -1;
    pair.line = line;
    pairs_.push_back(std::move(pair));
    state_ = State::starting;
  }

  void finish(bool stands) {
    if (!stands) fail("a barrier without M400 before it");
    if (state_ != State::open) return fail("a barrier ends that was not acknowledged");
    // The M400 of the barrier is no stop inside the chain.
    BarrierPair& pair = pairs_.back();
    if (!pair.stops.empty() && pair.stops.back() == static_cast<int>(pair.moves)) pair.stops.pop_back();
    state_ = State::ending;
  }

  void wait(const JobEvent& event, bool stands) {
    if (event.number == link_.duet_gate_input && event.number != link_.duet_barrier_input) return gate(event.level, event.line);
    if (event.number != link_.duet_barrier_input) return fail("an input that the link does not use");
    if (event.level) return begin(stands, event.line);
    finish(stands);
  }

  void acknowledge(bool right_output, bool level) {
    if (!right_output) return fail("an output that the link does not use");
    if (level && state_ == State::starting) {
      state_ = State::open;
    } else if (!level && state_ == State::ending) {
      state_ = State::idle;
    } else if (level || state_ != State::idle || next_ != PairKind::part) {
      fail("an acknowledge that no barrier asks for");
    }
  }

  void signal(const JobEvent& event, bool stands) {
    if (event.number < 0) {
      begin(stands, event.line);
      pairs_.back().gates.push_back({0, event.number, event.line});
      return;
    }
    if (event.number != ++signal_) fail("signals do not count 1, 2, ...");
    if (!event.level) return gate(event.number, event.line);
    if (state_ == State::idle) return begin(stands, event.line);
    finish(stands);
  }

  void answer(int number) {
    if (number < 0) {
      if (state_ != State::starting || pairs_.back().gates.empty() || pairs_.back().gates.back().number != number) fail("an answer to no part");
      state_ = State::idle;
      return;
    }
    if (number != signal_) fail("an answer with the wrong number");
    if (state_ == State::starting) {
      state_ = State::open;
    } else if (state_ == State::ending) {
      state_ = State::idle;
    } else {
      fail("an answer that no barrier asks for");
    }
  }

  void gate(int number, int line) {
    if (state_ != State::open) return fail("a gate outside a chain");
    pairs_.back().gates.push_back({static_cast<int>(pairs_.back().moves), number, line});
  }

  void move(const JobEvent& event) {
    const JobMove& move = job_.moves[static_cast<std::size_t>(event.number)];
    const bool prints = move.has_xyz && !move.rapid;
    if (state_ == State::open) {
      if (!prints || !move.has_e) return fail("a move inside a chain that does not print");
      if (pairs_.back().kind != PairKind::path) return fail("a printing move outside a chain");
      if (pairs_.back().moves++ == 0) pairs_.back().first_move = static_cast<std::size_t>(event.number);
      return;
    }
    if (prints) return fail("a printing move that no acknowledge precedes");
    if (!move.has_xyz && state_ == State::idle) fail("the extruder moves outside a barrier pair");
    if (move.rapid && state_ != State::idle) fail("a travel inside a barrier pair");
    if (move.rapid && move.has_e) fail("a travel that extrudes");
  }

  void tool() {
    const bool right = state_ == State::starting && (next_ == PairKind::change || next_ == PairKind::part);
    if (!right && next_ != PairKind::unload) findings_.fail(Rule::tool_change, place_, "a tool change outside a change of material");
  }

  const Job& job_;
  const Link& link_;
  Findings& findings_;
  std::vector<BarrierPair> pairs_;
  State state_ = State::idle;
  PairKind next_ = PairKind::part;
  std::size_t parts_ = 0;
  int comment_ = -1, signal_ = 0;
  Place place_;
};

// ---- comparing

class SyncCheck {
 public:
  SyncCheck(Programs& programs, const Machine& machine, Findings& findings, EmittedFigures& figures)
      : programs_(programs), machine_(machine), findings_(findings), figures_(figures) {}

  void run() {
    robot_ = RobotPairs(programs_, machine_, findings_).read();
    job_ = JobPairs(programs_.job, machine_, findings_).read();
    const std::size_t count = std::min(robot_.size(), job_.size());
    findings_.expect(robot_.size() == job_.size(), Rule::barriers, {programs_.job.file, 0}, "the programs hold different numbers of barrier pairs");
    for (std::size_t i = 0; i < count; ++i) compare(robot_[i], job_[i]);
    figures_.chains = programs_.chains.size();
  }

 private:
  [[nodiscard]] const RobotPart& part(std::size_t i) const { return programs_.parts[i]; }
  [[nodiscard]] Place job_place(int line) const { return {programs_.job.file, line}; }

  void compare(const BarrierPair& robot, const BarrierPair& job) {
    const Place place = job_place(job.line);
    if (robot.kind != job.kind || robot.part != job.part) {
      return findings_.fail(Rule::barriers, place, "the barrier pair is another one than in " + part(robot.part).file + ":" + std::to_string(robot.line));
    }
    if (robot.kind != PairKind::path) return check_station(robot);
    if (robot.moves != job.moves) {
      findings_.fail(Rule::same_polyline, place, "a chain of other moves than in " + part(robot.part).file + ":" + std::to_string(robot.line));
      return;
    }
    if (robot.comment < 0 || job.comment < 0) return;
    Chain chain;
    chain.part = robot.part;
    chain.robot_first = robot.first_move;
    chain.job_first = job.first_move;
    chain.moves = robot.moves;
    chain.robot_comment = robot.comment;
    chain.job_comment = job.comment;
    const PathComment& said = part(robot.part).paths[static_cast<std::size_t>(robot.comment)];
    const JobPath& path = programs_.job.paths[static_cast<std::size_t>(job.comment)];
    const bool same = said.path == path.path && said.section == path.section && said.sections == path.sections;
    findings_.expect(same, Rule::path_order, place, "the programs name different paths");
    // Groups are counted over all layers in the script, over those that print in the job.
    findings_.expect(said.layer == path.layer, Rule::layers, place, "the programs name different layers");
    chain.path = path.path;
    chain.section = path.section;
    chain.sections = path.sections;
    if (chain.moves == 0 || chain.robot_first == 0) {
      findings_.fail(Rule::path_order, place, "a chain without moves, or at the very start of a part");
      return;
    }
    check_moves(robot, job, chain);
    check_gates(robot, job, chain);
    programs_.chains.push_back(std::move(chain));
  }

  // Materials change at the purge station.
  void check_station(const BarrierPair& robot) {
    if (robot.kind != PairKind::change) return;
    const RobotPart& program = part(robot.part);
    const RobotMove* last = nullptr;
    for (const RobotMove& move : program.moves) {
      if (move.line < robot.line) last = &move;
    }
    bool there = last && last->solved;
    for (std::size_t i = 0; there && i < 6; ++i) {
      there = std::abs(last->reached[i] - machine_.stations.purge_deg[i] * std::numbers::pi / 180.0) < 1e-3;
    }
    findings_.expect(there, Rule::tool_change, {program.file, robot.line}, "the arm is not at the purge station");
  }

  void check_moves(const BarrierPair& robot, const BarrierPair& job, Chain& chain) {
    const RobotPart& program = part(robot.part);
    const ArmFrame platform = frame_of(machine_.platform.pose);
    const double acceleration = machine_.speeds.print_acceleration_m_s2;
    chain.robot_s.resize(chain.moves);
    chain.job_s.resize(chain.moves);
    chain.rest_s.assign(chain.moves, 0.0);
    for (const Rest& rest : robot.rests) chain.rest_s[static_cast<std::size_t>(rest.move) - 1] += rest.seconds;
    std::size_t stop = 0;
    bool begins = true;
    for (std::size_t k = 0; k < chain.moves; ++k) {
      const RobotMove& from = program.moves[chain.robot_first + k - 1];
      const RobotMove& move = program.moves[chain.robot_first + k];
      const JobMove& twin = programs_.job.moves[chain.job_first + k];
      const Place place = job_place(twin.line);
      const Vec3 tip = 1000.0 * (platform.rotation.transpose() * (move.pose.position_m - platform.position));
      findings_.at_most(Rule::same_polyline, (tip - twin.tip_mm).norm(), 1e-3, place, "the nozzle goes elsewhere than in " + program.file + ":" + std::to_string(move.line));
      if (k == 0) {
        const Vec3 start = 1000.0 * (platform.rotation.transpose() * (from.pose.position_m - platform.position));
        findings_.at_most(Rule::same_polyline, (start - twin.from_mm).norm(), 1e-3 + 5e-3 * (from.kind == RobotMove::Kind::joint), place, "the chain starts elsewhere than in the script");
      }
      const double length = twin.length_mm();
      chain.job_s[k] = twin.feed_mm_s > 0.0 ? length / twin.feed_mm_s : 0.0;
      const double planned = planned_length_m(from.pose, move.pose, machine_.speeds.rotation_rad_per_m);
      const double way = (move.pose.position_m - from.pose.position_m).norm();
      check_speed(move, way, planned, twin, chain.job_s[k], place);
      chain.robot_s[k] = (move.marked ? planned : way) / std::max(move.v, 1e-9);
      const bool stops_here = k + 1 == chain.moves || move.r == 0.0;
      // Both ends of a stretch between stops take half of v / a each, in both machines.
      const double ramp = 0.5 * twin.feed_mm_s / (1000.0 * acceleration) * (begins + stops_here);
      chain.job_s[k] += ramp;
      chain.robot_s[k] += ramp;
      if (!stops_here) chain.robot_s[k] -= saved_seconds(program, chain.robot_first + k, twin.feed_mm_s);
      const bool job_stops = stop < job.stops.size() && job.stops[stop] == static_cast<int>(k) + 1;
      if (job_stops) ++stop;
      if (k + 1 < chain.moves && job_stops != stops_here) findings_.fail(Rule::same_speed, place, "only one of the machines stops");
      begins = stops_here;
    }
  }

  void check_speed(const RobotMove& move, double way, double planned, const JobMove& twin, double job_s, const Place& place) {
    const double feed = twin.feed_mm_s / 1000.0;
    if (!move.marked) {
      findings_.at_most(Rule::same_speed, std::abs(move.v - feed) / std::max(feed, 1e-9), 1e-3, place, "feed and speed differ");
      return;
    }
    const double wanted = planned / std::max(job_s, 1e-9);
    const double rounding = 2e-7 / std::max(way, 1e-7) + 3e-6 / std::max(planned * machine_.speeds.rotation_rad_per_m, 1e-6);
    findings_.at_most(Rule::same_speed, std::max(0.0, std::abs(move.v - wanted) / wanted - rounding), 1e-3, place,
                      "the speed of a rotation-limited move does not keep its duration");
  }

  // The way through a blend of turn phi is 2 r - R phi shorter.
  [[nodiscard]] static double saved_seconds(const RobotPart& program, std::size_t i, double feed_mm_s) {
    const RobotMove &from = program.moves[i - 1], &move = program.moves[i], &to = program.moves[i + 1];
    const Vec3 in = move.pose.position_m - from.pose.position_m, out = to.pose.position_m - move.pose.position_m;
    const double turn = std::atan2(in.cross(out).norm(), in.dot(out));
    if (turn < 1e-6 || feed_mm_s <= 0.0) return 0.0;
    const double radius = move.r / std::tan(0.5 * turn);
    return std::max(0.0, 1000.0 * (2.0 * move.r - radius * turn) / feed_mm_s);
  }

  void check_gates(const BarrierPair& robot, const BarrierPair& job, Chain& chain) {
    const Place place = job_place(job.line);
    figures_.gates += job.gates.size();
    const bool counted = machine_.link.kind == DuetLink::telnet;
    if (robot.gates.size() != job.gates.size()) {
      findings_.fail(Rule::gates, place, "other gates than in " + part(robot.part).file + ":" + std::to_string(robot.line));
    }
    for (std::size_t j = 0; j < job.gates.size(); ++j) {
      const Place gate = job_place(job.gates[j].line);
      if (!counted) findings_.expect(job.gates[j].number == static_cast<int>((j + 1) % 2), Rule::gates, gate, "levels of gates do not alternate from 1");
      if (j >= robot.gates.size()) continue;
      findings_.expect(robot.gates[j].number == job.gates[j].number, Rule::gates, gate, "the level of the gate differs from the script's");
      const int ahead = j == 0 ? 0 : job.gates[j - 1].move;
      findings_.expect(robot.gates[j].move == ahead, Rule::gates, gate, "the script does not set the gate one chunk ahead");
    }
    check_chunks(robot, job, chain, place);
  }

  void check_chunks(const BarrierPair& robot, const BarrierPair& job, const Chain& chain, const Place& place) {
    std::vector<double> job_until(chain.moves + 1, 0.0), robot_until(chain.moves + 1, 0.0);
    for (std::size_t k = 0; k < chain.moves; ++k) {
      job_until[k + 1] = job_until[k] + chain.job_s[k];
      robot_until[k + 1] = robot_until[k] + chain.robot_s[k] + chain.rest_s[k];
    }
    const auto bound = [&](std::size_t j) {
      return j == 0 ? std::size_t{0} : j <= job.gates.size() ? static_cast<std::size_t>(job.gates[j - 1].move) : chain.moves;
    };
    const Link& link = machine_.link;
    for (std::size_t j = 0; j <= job.gates.size(); ++j) {
      const std::size_t begin = bound(j), end = bound(j + 1);
      if (begin >= end) {
        findings_.fail(Rule::gates, place, "a chunk without moves");
        continue;
      }
      const double seconds = job_until[end] - job_until[begin], difference = std::abs(seconds - robot_until[end] + robot_until[begin]);
      findings_.expect(static_cast<int>(end - begin) <= link.gate_moves, Rule::chunk_size, place, "more moves between two gates than link.gate_moves");
      // A single move may be longer than a chunk only if it cannot be divided: none is.
      findings_.at_most(Rule::chunk_size, seconds, link.gate_interval_s * 1.001 + 1e-3, place, "more seconds between two gates than link.gate_interval_s");
      findings_.at_most(Rule::chunk_time, difference / std::max(0.05, 0.02 * seconds), 1.0, place, "a chunk takes the machines different times");
      figures_.max_chunk_mismatch_s = std::max(figures_.max_chunk_mismatch_s, difference);
    }
    const double total = job_until.back(), difference = std::abs(total - robot_until.back());
    findings_.at_most(Rule::chain_time, difference / std::max(0.05, 0.02 * total), 1.0, place, "a chain takes the machines different times");
    figures_.max_chain_mismatch_s = std::max(figures_.max_chain_mismatch_s, difference);
    // The arm stands where it sets gate j + 1: the board may run up to gate j + 2.
    for (std::size_t j = 0; j < robot.gates.size() && j < job.gates.size(); ++j) {
      const auto at = static_cast<std::size_t>(std::min<int>(robot.gates[j].move, static_cast<int>(chain.moves)));
      const double ahead = job_until[bound(j + 2)] - job_until[std::min(at, bound(j + 2))];
      findings_.at_most(Rule::overrun, ahead, 2.0 * link.gate_interval_s * 1.001 + 2e-3, place, "the extruder may run far ahead of the arm");
    }
  }

  Programs& programs_;
  const Machine& machine_;
  Findings& findings_;
  EmittedFigures& figures_;
  std::vector<BarrierPair> robot_, job_;
};

// ---- one clock

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
      case RobotEvent::Kind::sleep: time_ += event.seconds; return true;
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
    if (time_ - begin > event.seconds && too_late_.empty()) {
      too_late_ = programs_.parts[part_].file + ":" + std::to_string(event.line) + ": the answer comes after the timeout";
    }
    return true;
  }

  double seconds_of(const RobotPart& part, std::size_t i) {
    const RobotMove& move = part.moves[i];
    if (move.kind == RobotMove::Kind::process) return next_print_ < printing_.size() ? printing_[next_print_++] : 0.0;
    if (i == 0) return 0.0;  // the arm stands there
    const RobotMove& from = part.moves[i - 1];
    if (move.kind == RobotMove::Kind::linear) {
      const double way = planned_length_m(from.pose, move.pose, machine_.speeds.rotation_rad_per_m);
      return way / std::max(move.v, 1e-9) + move.v / std::max(move.a, 1e-9);
    }
    double turn = 0.0;
    for (std::size_t j = 0; j < 6; ++j) turn = std::max(turn, std::abs(move.reached[j] - from.reached[j]));
    const double v = std::max(move.v, 1e-9), a = std::max(move.a, 1e-9);
    return turn > v * v / a ? turn / v + v / a : 2.0 * std::sqrt(turn / a);
  }

  const Programs& programs_;
  const Machine& machine_;
  Wires& wires_;
  std::vector<double> printing_;  // of all printing moves in order
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
      : job_(programs.job), machine_(machine), wires_(wires), late_(late_s), seconds_(job_.moves.size(), -1.0) {
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
    double seconds = seconds_[i];
    if (seconds < 0.0) {
      const double way = move.has_xyz ? move.length_mm() : std::abs(move.e_mm);
      seconds = move.feed_mm_s > 0.0 ? way / move.feed_mm_s : 0.0;
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
  std::vector<double> seconds_;  // of each move of a chain, else < 0
  std::size_t event_ = 0, gates_ = 0, slips_ = 0;
  int first_slip_ = 0;
  double time_ = 0.0, motion_ = 0.0;
  std::deque<double> ends_;
};

void simulate(Programs& programs, const Machine& machine, double late_s, Findings& findings, EmittedFigures& figures) {
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
  if (late_s > 0.0) return;
  programs.part_s = robot.part_s();
  figures.simulated_s = std::max(robot.time(), board.time());
  figures.header_s = static_cast<double>(programs.job.header.time_s);
  const double error = std::abs(figures.simulated_s - figures.header_s) - 0.5;
  findings.at_most(Rule::total_time, std::max(0.0, error) / std::max(1.0, figures.simulated_s), 0.01, {programs.job.file, 0}, "the time in the header is not what the print takes");
}

}  // namespace

void check_sync(Programs& programs, const Machine& machine, Findings& findings, EmittedFigures& figures) {
  SyncCheck(programs, machine, findings, figures).run();
  simulate(programs, machine, 0.0, findings, figures);
  simulate(programs, machine, kLate_s, findings, figures);
}

}  // namespace curvesup::emitted
