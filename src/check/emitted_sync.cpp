#include "check/emitted_sync.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/parallel.h"

namespace curvesup::emitted {

namespace {

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

// One chain in both programs: the same moves in the same time, gate by gate.
class TwinCheck {
 public:
  TwinCheck(const Programs& programs, const Machine& machine, Findings& findings, EmittedFigures& figures)
      : programs_(programs), machine_(machine), findings_(findings), figures_(figures), platform_(frame_of(machine.platform.pose)) {}

  void compare(const BarrierPair& robot, const BarrierPair& job, Chain& chain) {
    check_moves(robot, job, chain);
    check_gates(robot, job, chain);
  }

 private:
  [[nodiscard]] const RobotPart& part(std::size_t i) const { return programs_.parts[i]; }
  [[nodiscard]] Place job_place(int line) const { return {programs_.job.file, line}; }

  [[nodiscard]] Vec3 in_platform(const Vec3& metres) const { return 1000.0 * (platform_.rotation.transpose() * (metres - platform_.position)); }

  void check_tip(double apart, double limit, const Place& place, const RobotPart& program, const RobotMove& move) {
    findings_.at_most(Rule::same_polyline, apart, limit, place,
                      apart <= limit ? std::string() : "the nozzle is elsewhere than in " + program.file + ":" + std::to_string(move.line));
  }

  void check_moves(const BarrierPair& robot, const BarrierPair& job, Chain& chain) {
    const RobotPart& program = part(robot.part);
    const double acceleration = machine_.speeds.print_acceleration_m_s2;
    chain.robot_s.resize(chain.moves);
    chain.job_s.resize(chain.moves);
    rest_s_.assign(chain.moves, 0.0);
    for (const Rest& rest : robot.rests) rest_s_[static_cast<std::size_t>(rest.move) - 1] += rest.seconds;
    std::size_t stop = 0;
    bool begins = true;
    Pose before = program.moves[chain.robot_first - 1].pose;
    Vec3 tip_before = programs_.job.from_mm(chain.job_first);
    const RobotMove& start = program.moves[chain.robot_first - 1];
    check_tip((in_platform(before.position_m) - tip_before).norm(), 1e-3 + 5e-3 * (start.kind == RobotMove::Kind::joint),
              job_place(programs_.job.moves[chain.job_first].line), program, start);
    for (std::size_t k = 0; k < chain.moves; ++k) {
      const RobotMove& move = program.moves[chain.robot_first + k];
      const JobMove& twin = programs_.job.moves[chain.job_first + k];
      const Place place = job_place(twin.line);
      const Pose pose = move.pose;
      const Vec3 tip = twin.tip_mm;
      check_tip((in_platform(pose.position_m) - tip).norm(), 1e-3, place, program, move);
      const double length = (tip - tip_before).norm(), feed = static_cast<double>(twin.feed_mm_s);
      double job_s = feed > 0.0 ? length / feed : 0.0;
      const double planned = planned_length_m(before, pose, machine_.speeds.rotation_rad_per_m);
      const double way = (pose.position_m - before.position_m).norm();
      check_speed(move, way, planned, feed, job_s, place);
      double robot_s = (move.marked ? planned : way) / std::max(static_cast<double>(move.v), 1e-9);
      const bool stops_here = k + 1 == chain.moves || move.r == 0.0f;
      // Both ends of a stretch between stops take half of v / a each, in both machines.
      const double ramp = 0.5 * feed / (1000.0 * acceleration) * (begins + stops_here);
      job_s += ramp;
      robot_s += ramp;
      if (!stops_here) robot_s -= saved_seconds(program, chain.robot_first + k, feed);
      chain.job_s[k] = static_cast<float>(job_s);
      chain.robot_s[k] = static_cast<float>(robot_s);
      const bool job_stops = stop < job.stops.size() && job.stops[stop] == static_cast<int>(k) + 1;
      if (job_stops) ++stop;
      if (k + 1 < chain.moves && job_stops != stops_here) findings_.fail(Rule::same_speed, place, "only one of the machines stops");
      begins = stops_here;
      before = pose;
      tip_before = tip;
    }
  }

  void check_speed(const RobotMove& move, double way, double planned, double feed_mm_s, double job_s, const Place& place) {
    const double feed = feed_mm_s / 1000.0, v = static_cast<double>(move.v);
    if (!move.marked) {
      findings_.at_most(Rule::same_speed, std::abs(v - feed) / std::max(feed, 1e-9), 1e-3, place, "feed and speed differ");
      return;
    }
    const double wanted = planned / std::max(job_s, 1e-9);
    const double rounding = 2e-7 / std::max(way, 1e-7) + 3e-6 / std::max(planned * machine_.speeds.rotation_rad_per_m, 1e-6);
    findings_.at_most(Rule::same_speed, std::max(0.0, std::abs(v - wanted) / wanted - rounding), 1e-3, place,
                      "the speed of a rotation-limited move does not keep its duration");
  }

  // The way through a blend of turn phi is 2 r - R phi shorter.
  [[nodiscard]] static double saved_seconds(const RobotPart& program, std::size_t i, double feed_mm_s) {
    const Vec3 here = program.moves[i].pose.position_m;
    const Vec3 in = here - program.moves[i - 1].pose.position_m.vec(), out = program.moves[i + 1].pose.position_m.vec() - here;
    const double half = in.cross(out).norm() / std::max(in.norm() * out.norm() + in.dot(out), 1e-300);  // tangent of half the turn
    if (half < 5e-7 || feed_mm_s <= 0.0) return 0.0;
    const double r = static_cast<double>(program.moves[i].r);
    return std::max(0.0, 2000.0 * r * (1.0 - std::atan(half) / half) / feed_mm_s);
  }

  void check_gates(const BarrierPair& robot, const BarrierPair& job, const Chain& chain) {
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
      job_until[k + 1] = job_until[k] + static_cast<double>(chain.job_s[k]);
      robot_until[k + 1] = robot_until[k] + static_cast<double>(chain.robot_s[k]) + rest_s_[k];
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

  const Programs& programs_;
  const Machine& machine_;
  Findings& findings_;
  EmittedFigures& figures_;
  ArmFrame platform_;
  std::vector<double> rest_s_;  // of the chain at hand, behind each move
};

// The meeting points of both programs, pair by pair: makes the chains.
class SyncCheck {
 public:
  SyncCheck(Programs& programs, const Machine& machine, Findings& findings, EmittedFigures& figures)
      : programs_(programs), machine_(machine), findings_(findings), figures_(figures) {}

  void run(const RunContext& run) {
    parallel_for(2, 1, run, [&](std::size_t side, std::size_t, std::size_t) {
      if (side == 0) robot_ = RobotPairs(programs_, machine_, robot_findings_).read();
      else job_ = JobPairs(programs_.job, machine_, job_findings_).read();
    });
    findings_.merge(robot_findings_);
    findings_.merge(job_findings_);
    const std::size_t count = std::min(robot_.size(), job_.size());
    findings_.expect(robot_.size() == job_.size(), Rule::barriers, {programs_.job.file, 0}, "the programs hold different numbers of barrier pairs");
    for (std::size_t i = 0; i < count; ++i) compare(i);
    compare_chains(run);
    figures_.chains = programs_.chains.size();
  }

 private:
  [[nodiscard]] const RobotPart& part(std::size_t i) const { return programs_.parts[i]; }
  [[nodiscard]] Place job_place(int line) const { return {programs_.job.file, line}; }

  void compare(std::size_t i) {
    const BarrierPair &robot = robot_[i], &job = job_[i];
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
    programs_.chains.push_back(std::move(chain));
    pair_of_chain_.push_back(i);
  }

  void compare_chains(const RunContext& run) {
    constexpr std::size_t kTogether = 64;
    std::vector<Findings> found(chunk_count(programs_.chains.size(), kTogether));
    std::vector<EmittedFigures> figures(found.size());
    parallel_for(programs_.chains.size(), kTogether, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      TwinCheck twins(programs_, machine_, found[chunk], figures[chunk]);
      for (std::size_t c = begin; c < end; ++c) twins.compare(robot_[pair_of_chain_[c]], job_[pair_of_chain_[c]], programs_.chains[c]);
    });
    for (std::size_t i = 0; i < found.size(); ++i) {
      findings_.merge(found[i]);
      figures_.gates += figures[i].gates;
      figures_.max_chunk_mismatch_s = std::max(figures_.max_chunk_mismatch_s, figures[i].max_chunk_mismatch_s);
      figures_.max_chain_mismatch_s = std::max(figures_.max_chain_mismatch_s, figures[i].max_chain_mismatch_s);
    }
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

  Programs& programs_;
  const Machine& machine_;
  Findings& findings_;
  EmittedFigures& figures_;
  Findings robot_findings_, job_findings_;
  std::vector<BarrierPair> robot_, job_;
  std::vector<std::size_t> pair_of_chain_;
};

}  // namespace

void check_sync(Programs& programs, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures) {
  SyncCheck(programs, machine, findings, figures).run(run);
  run_clocks(programs, machine, run, findings, figures);
  for (Chain& chain : programs.chains) {
    std::vector<float>().swap(chain.robot_s);
    std::vector<float>().swap(chain.job_s);
  }
  std::vector<JobEvent>().swap(programs.job.events);
  for (RobotPart& part : programs.parts) std::vector<RobotEvent>().swap(part.events);
}

}  // namespace curvesup::emitted
