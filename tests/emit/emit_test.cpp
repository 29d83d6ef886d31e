#include "curvesup/emit/emit.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

#include "curvesup/core/error.h"
#include "helpers/temp_folder.h"

namespace curvesup {
namespace {

// A print of three layers, each a model and a support path; the model path of the last layer is cut into two sections.
struct Print {
  Toolpaths toolpaths;
  Motion motion;
  Machine machine;
};

// Adds the toolpath `tips` and its chains; `cuts` are the points at which a section ends.
class PrintBuilder {
 public:
  explicit PrintBuilder(Print& print) : print_(print) {}

  void add_path(Index layer, Material material, const std::vector<Vec3>& tips, const std::vector<std::size_t>& cuts = {},
                double speed = 10.0) {
    Path path;
    path.layer = layer;
    path.group = layer;
    path.material = material;
    path.first_point = static_cast<Index>(print_.toolpaths.points.size());
    path.point_count = static_cast<Index>(tips.size());
    for (std::size_t i = 0; i < tips.size(); ++i) {
      PathPoint point;
      point.position = tips[i] - Vec3(0, 0, 0.2);
      point.tip_offset_mm = 0.2;
      point.height_mm = 0.4;
      point.width_mm = 0.8;
      point.feed_mm_s = speed;
      if (i > 0) point.volume_mm3 = 0.4 * 0.8 * (tips[i] - tips[i - 1]).norm();
      print_.toolpaths.points.push_back(point);
    }
    print_.toolpaths.paths.push_back(path);
    std::vector<std::size_t> ends = cuts;
    ends.push_back(tips.size() - 1);
    std::size_t begin = 0;
    for (std::size_t s = 0; s < ends.size(); begin = ends[s++]) {
      add_chain(path, tips, begin, ends[s], static_cast<int>(s), static_cast<int>(ends.size()), speed);
    }
  }

  void finish() {
    print_.motion.final_travel = static_cast<Index>(print_.motion.travels.size());
    add_travel(TravelKind::linear, TravelStep::lift, last_tip_ + Vec3(0, 0, 40));
    add_travel(TravelKind::joint, TravelStep::to_home, Vec3(0, 0, 200));
  }

 private:
  Pose pose_at(const Vec3& tip) const { return {print_.machine.platform.pose.position_m + tip / 1000.0, Vec3(0.1, -0.2, 0.05)}; }
  static Joints joints_at(const Vec3& tip) { return {0.001 * tip.x(), -1.5, 1.6, -1.7, -1.5, 0.001 * tip.y()}; }

  void add_travel(TravelKind kind, TravelStep step, const Vec3& tip) {
    Travel travel;
    travel.kind = kind;
    travel.step = step;
    travel.tip_mm = tip;
    travel.pose = pose_at(tip);
    travel.joints = joints_at(tip);
    travel.speed_mm_s = 60.0;
    travel.duration_s = 1.5;
    print_.motion.travels.push_back(travel);
  }

  void add_chain(const Path& path, const std::vector<Vec3>& tips, std::size_t begin, std::size_t end, int section, int sections,
                 double speed) {
    Motion& motion = print_.motion;
    PathMotion chain;
    chain.path = static_cast<Index>(print_.toolpaths.paths.size()) - 1;
    chain.section = section;
    chain.sections = sections;
    chain.material = path.material;
    chain.layer = path.layer;
    chain.group = path.group;
    chain.material_change_before = motion.paths.empty() || motion.paths.back().material != path.material;
    chain.first_travel = static_cast<Index>(motion.travels.size());
    add_travel(TravelKind::linear, TravelStep::lift, last_tip_ + Vec3(0, 0, 40));
    if (chain.material_change_before) {
      add_travel(TravelKind::joint, TravelStep::purge, Vec3(0, 300, 100));
      add_travel(TravelKind::joint, TravelStep::from_purge, tips[begin] + Vec3(0, 0, 60));
    }
    add_travel(TravelKind::linear, TravelStep::cross, tips[begin] + Vec3(0, 0, 40));
    add_travel(TravelKind::linear, TravelStep::lower, tips[begin]);
    chain.travel_count = static_cast<Index>(motion.travels.size()) - chain.first_travel;
    chain.first_waypoint = static_cast<Index>(motion.waypoints.size());
    for (std::size_t i = begin; i <= end; ++i) {
      Waypoint waypoint;
      waypoint.tip_mm = tips[i];
      waypoint.pose = pose_at(tips[i]);
      waypoint.joints = joints_at(tips[i]);
      if (i > begin) {
        const double length = (tips[i] - tips[i - 1]).norm();
        waypoint.volume_mm3 = 0.4 * 0.8 * length;
        waypoint.speed_mm_s = speed;
        waypoint.duration_s = length / speed;
        if (i < end) {
          const Vec3 in = (tips[i] - tips[i - 1]).normalized(), out = (tips[i + 1] - tips[i]).normalized();
          const double room = 0.4 * std::min(length, (tips[i + 1] - tips[i]).norm());
          waypoint.blend_mm = in.dot(out) < -0.2 ? 0.0 : std::min(0.2, room);
        }
      }
      motion.waypoints.push_back(waypoint);
    }
    chain.waypoint_count = static_cast<Index>(motion.waypoints.size()) - chain.first_waypoint;
    motion.paths.push_back(chain);
    last_tip_ = tips[end];
  }

  Print& print_;
  Vec3 last_tip_ = Vec3::Zero();
};

std::vector<Vec3> circle(double radius, double z, int count) {
  std::vector<Vec3> points;
  for (int i = 0; i <= count; ++i) {
    const double a = 2.0 * std::numbers::pi * i / count;
    points.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
  }
  return points;
}

// Sharp reversals: every inner point is a stop.
std::vector<Vec3> zigzag(double z) {
  std::vector<Vec3> points;
  for (int i = 0; i < 12; ++i) points.emplace_back(i % 2 == 0 ? 0.0 : 7.0, 0.5 * i, z);
  return points;
}

Print small_print() {
  Print print;
  PrintBuilder builder(print);
  builder.add_path(0, Material::support, circle(10, 0.4, 60));
  builder.add_path(0, Material::model, {Vec3(20, 0, 0.4), Vec3(60, 0, 0.4), Vec3(60, 30, 0.4)});
  builder.add_path(1, Material::model, zigzag(0.8));
  builder.add_path(1, Material::support, circle(10, 0.8, 60));
  builder.add_path(2, Material::support, circle(8, 1.2, 90), {}, 12.0);
  builder.add_path(2, Material::model, circle(25, 1.2, 300), {140});
  builder.finish();
  print.machine.program.max_moves_per_part = 200;
  return print;
}

const EmittedFile& file(const EmittedFiles& out, const std::string& name) {
  for (const EmittedFile& f : out.files) {
    if (f.name == name) return f;
  }
  throw std::runtime_error("no file " + name);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

bool starts(const std::string& line, const std::string& prefix) { return line.rfind(prefix, 0) == 0; }

std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> numbers;
  for (const char* p = text.c_str(); *p;) {
    char* end = nullptr;
    const double value = std::strtod(p, &end);
    if (end == p) {
      ++p;
    } else {
      numbers.push_back(value);
      p = end;
    }
  }
  return numbers;
}

double word(const std::string& line, char letter, double missing = NAN) {
  const auto at = line.find(std::string(" ") + letter);
  return at == std::string::npos ? missing : std::strtod(line.c_str() + at + 2, nullptr);
}

// One event of either program that the other must answer, or a printing move.
struct Event {
  std::string kind;  // barrier0/1, acknowledge0/1, gate0/1, move
  Vec3 tip = Vec3::Zero();
  double speed = 0.0, blend = 0.0, e = 0.0;
  bool stop_before = false;  // Duet
};

struct RobotMove {
  Vec3 position;
  double blend_m = 0.0, speed = 0.0;
};

std::vector<Event> robot_events(const EmittedFiles& out, const Machine& machine) {
  std::vector<Event> events;
  for (const EmittedPart& part : out.parts) {
    int depth = 0;
    bool first_wait = true;
    for (const std::string& line : lines_of(text_of(file(out, part.file)))) {
      const auto text = line.substr(line.find_first_not_of(' '));
      if (starts(text, "def ")) ++depth;
      if (depth == 1) {
        if (starts(text, "set_standard_digital_out(0, True)")) events.push_back({"barrier1"});
        if (starts(text, "set_standard_digital_out(0, False)")) events.push_back({"barrier0"});
        if (starts(text, "set_standard_digital_out(2, True)")) events.push_back({"gate1"});
        if (starts(text, "set_standard_digital_out(2, False)")) events.push_back({"gate0"});
        if (starts(text, "wait_acknowledge(True")) events.push_back({"acknowledge1"});
        if (starts(text, "wait_acknowledge(False")) {
          if (!first_wait) events.push_back({"acknowledge0"});
          first_wait = false;
        }
        if (starts(text, "movep(")) {
          const auto n = numbers_in(text.substr(6));
          Event e{"move"};
          e.tip = 1000.0 * (Vec3(n[0], n[1], n[2]) - machine.platform.pose.position_m);
          e.speed = 1000.0 * n[7];
          e.blend = 1000.0 * n[8];
          events.push_back(e);
        }
      }
      if (text == "end" && line.size() > 3 && line[1] != ' ') --depth;
    }
  }
  return events;
}

std::vector<Event> duet_events(const std::string& job) {
  std::vector<Event> events;
  double feed = 0.0;
  bool stop = false;
  bool part_begins = false;
  for (const std::string& line : lines_of(job)) {
    if (line == "M577 P0 S1") events.push_back({"barrier1"});
    if (line == "M577 P0 S0") events.push_back({"barrier0"});
    if (line == "M577 P2 S1") events.push_back({"gate1"});
    if (line == "M577 P2 S0") events.push_back({"gate0"});
    if (line == "M42 P0 S1") events.push_back({"acknowledge1"});
    if (line == "M42 P0 S0") {
      if (!part_begins) events.push_back({"acknowledge0"});
    }
    part_begins = starts(line, ";PART:");
    if (line == "M400") stop = true;
    if (starts(line, "G1 X")) {
      feed = word(line, 'F', feed);
      Event e{"move"};
      e.tip = Vec3(word(line, 'X'), word(line, 'Y'), word(line, 'Z'));
      e.speed = feed / 60.0;
      e.e = word(line, 'E');
      e.stop_before = stop;
      events.push_back(e);
      stop = false;
    }
  }
  return events;
}

// Robot gates come a chunk earlier than those of the Duet, so they are compared apart.
std::vector<Event> without_gates(const std::vector<Event>& events) {
  std::vector<Event> out;
  for (const Event& e : events) {
    if (!starts(e.kind, "gate")) out.push_back(e);
  }
  return out;
}

TEST(EmitRobot, BothFilesHoldTheSameBarriersAndMoves) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  const auto robot = without_gates(robot_events(out, print.machine));
  // Robot resets its outputs at both ends of each part: those are no barriers.
  std::vector<Event> signalled;
  for (std::size_t i = 0; i < robot.size(); ++i) {
    const bool reset = robot[i].kind == "barrier0" && (i + 1 == robot.size() || robot[i + 1].kind != "acknowledge0");
    if (!reset) signalled.push_back(robot[i]);
  }
  const auto duet = without_gates(duet_events(text_of(file(out, "duet/print.g"))));
  ASSERT_EQ(signalled.size(), duet.size());
  std::string level = "0";
  std::size_t moves = 0;
  for (std::size_t i = 0; i < duet.size(); ++i) {
    ASSERT_EQ(signalled[i].kind, duet[i].kind) << i;
    if (starts(duet[i].kind, "barrier")) {
      EXPECT_NE(duet[i].kind.substr(7), level) << "levels alternate";
      level = duet[i].kind.substr(7);
    } else if (duet[i].kind == "move") {
      ++moves;
      EXPECT_EQ(level, "1");
      EXPECT_LT((signalled[i].tip - duet[i].tip).norm(), 1e-3);
      EXPECT_NEAR(signalled[i].speed / duet[i].speed, 1.0, 1e-3);
      const bool robot_stops = signalled[i - 1].kind != "move" || signalled[i - 1].blend == 0.0;
      EXPECT_EQ(duet[i].stop_before, robot_stops) << "both stop or none, move " << i;
    }
  }
  EXPECT_EQ(moves, out.report.moves);
  EXPECT_EQ(level, "0");
}

TEST(EmitRobot, RobotSetsEachGateOneChunkAhead) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  // Moves of the chain before which the gates lie: on the Duet gate j before chunk j, on the robot before chunk j - 1.
  const auto positions = [](const std::vector<Event>& events) {
    std::vector<std::vector<std::pair<int, std::string>>> chains;
    int moves = 0;
    for (const Event& e : events) {
      if (e.kind == "barrier1") chains.emplace_back(), moves = 0;
      if (e.kind == "move") ++moves;
      if (starts(e.kind, "gate") && !chains.empty()) chains.back().push_back({moves, e.kind});
    }
    return chains;
  };
  auto robot = positions(robot_events(out, print.machine));
  const auto duet = positions(duet_events(text_of(file(out, "duet/print.g"))));
  ASSERT_EQ(robot.size(), duet.size());
  std::size_t gates = 0;
  for (std::size_t c = 0; c < duet.size(); ++c) {
    // The last ones on the robot are resets to 0.
    while (robot[c].size() > duet[c].size()) {
      EXPECT_EQ(robot[c].back().second, "gate0");
      robot[c].pop_back();
    }
    ASSERT_EQ(robot[c].size(), duet[c].size());
    gates += duet[c].size();
    for (std::size_t j = 0; j < duet[c].size(); ++j) {
      EXPECT_EQ(duet[c][j].second, j % 2 == 0 ? "gate1" : "gate0");
      EXPECT_EQ(robot[c][j].second, duet[c][j].second);
      EXPECT_EQ(robot[c][j].first, j == 0 ? 0 : duet[c][j - 1].first);
    }
  }
  EXPECT_EQ(gates, out.report.gates);
  EXPECT_GT(gates, 20u);
}

TEST(EmitRobot, ChunksAreShortInMovesAndTime) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  struct Chunk {
    double seconds = 0.0;
    int moves = 0;
  };
  std::vector<Chunk> chunks(1);
  Vec3 last = Vec3::Zero();
  double speed = 0.0;
  bool standing = true;
  std::size_t moved = 0;  // chunk of the last move
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    if (starts(line, "M577")) chunks.emplace_back();
    if (line == "M400" && !standing) chunks[moved].seconds += speed / 500.0 / 2.0, standing = true;
    if (starts(line, "G0 X") || starts(line, "G92 X")) last = Vec3(word(line, 'X'), word(line, 'Y'), word(line, 'Z'));
    if (!starts(line, "G1 X")) continue;
    speed = word(line, 'F', 60.0 * speed) / 60.0;
    const Vec3 tip(word(line, 'X'), word(line, 'Y'), word(line, 'Z'));
    moved = chunks.size() - 1;
    chunks[moved].seconds += (tip - last).norm() / speed + (standing ? speed / 500.0 / 2.0 : 0.0);
    ++chunks[moved].moves;
    last = tip;
    standing = false;
  }
  double longest = 0.0, sum = 0.0;
  int most = 0;
  for (const Chunk& chunk : chunks) {
    longest = std::max(longest, chunk.seconds);
    most = std::max(most, chunk.moves);
    sum += chunk.seconds;
  }
  EXPECT_LE(longest, 1.0 + 1e-4);
  EXPECT_GT(longest, 0.9);
  EXPECT_LE(most, 18);
  EXPECT_GT(most, 5);
  double others = 0.0;  // than printing
  for (const Travel& travel : print.motion.travels) others += travel.duration_s;
  others += print.motion.paths.size() * 2 * 0.8 / 25.0 + 4 * (26.0 + 20.0 + 2 * 0.8 / 25.0);
  EXPECT_NEAR(out.report.time_s, sum + others, 1e-2);
}

// Ten moves of 0.0995 s fit into a second, but not with the start from rest.
TEST(EmitRobot, ChunkTimeCountsTheStart) {
  Print print;
  PrintBuilder builder(print);
  std::vector<Vec3> tips;
  for (int i = 0; i <= 40; ++i) tips.emplace_back(0.995 * i, 0.0, 0.4);
  builder.add_path(0, Material::model, tips);
  builder.finish();
  std::vector<int> moves(1);
  for (const Event& e : duet_events(text_of(file(emit_robot(print.toolpaths, print.motion, print.machine), "duet/print.g")))) {
    if (e.kind == "move") ++moves.back();
    if (starts(e.kind, "gate")) moves.push_back(0);
  }
  EXPECT_EQ(moves, (std::vector<int>{9, 10, 10, 10, 1}));
}

TEST(EmitRobot, FilamentIsBeadVolumeOverFilamentArea) {
  Print print = small_print();
  print.machine.filaments[0].flow = 1.3;
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  double volume[2] = {}, printed[2] = {}, all[2] = {};
  for (const Path& path : print.toolpaths.paths) {
    for (Index i = 0; i < path.point_count; ++i) volume[static_cast<int>(path.material)] += print.toolpaths.points[path.first_point + i].volume_mm3;
  }
  int tool = -1;
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    if (line.size() == 2 && line[0] == 'T') tool = line[1] - '0';
    if (starts(line, "G1 ")) {
      ASSERT_GE(tool, 0);
      all[tool] += word(line, 'E');
      if (starts(line, "G1 X")) printed[tool] += word(line, 'E');
    }
  }
  const double area = std::numbers::pi / 4 * 1.75 * 1.75;
  for (int t = 0; t < 2; ++t) {
    EXPECT_NEAR(printed[t], volume[t] * print.machine.filaments[t].flow / area, 4e-6) << "rounding does not add up";
    EXPECT_NEAR(all[t], out.report.filament_mm[t], 1e-3);
  }
}

TEST(EmitRobot, ExtruderMovesAloneAreBalanced) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  double standing = 0.0;  // retracted by this much
  int loads = 0, unloads = 0;
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    if (!starts(line, "G1 E")) continue;
    const double e = word(line, 'E');
    EXPECT_GE(word(line, 'F'), 30.0);
    if (e == 26.0) {
      ++loads;
      EXPECT_EQ(standing, 0.0);
    } else if (e == -20.0) {
      ++unloads;
      EXPECT_EQ(standing, 0.0);
    } else {
      standing -= e;
      EXPECT_TRUE(standing == 0.0 || standing == 0.8) << "never two retracts in a row";
    }
  }
  EXPECT_EQ(loads, 4);    // S M S M
  EXPECT_EQ(unloads, 4);
  EXPECT_EQ(standing, 0.0);
  EXPECT_EQ(out.report.material_changes, 3);
}

TEST(EmitRobot, PartsKeepCapsAndStartOnTheirOwn) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  ASSERT_GE(out.parts.size(), 3u);
  const std::string job = text_of(file(out, "duet/print.g"));
  std::vector<std::pair<Index, int>> printed;
  int travels = 0;
  for (std::size_t p = 0; p < out.parts.size(); ++p) {
    const EmittedPart& part = out.parts[p];
    const std::string text = text_of(file(out, part.file));
    const auto lines = lines_of(text);
    EXPECT_TRUE(starts(lines.front(), "def part_000" + std::to_string(p + 1) + "():"));
    EXPECT_EQ(lines.back(), "part_000" + std::to_string(p + 1) + "()");
    EXPECT_EQ(lines[lines.size() - 2], "end");
    int moves = 0, paths = 0;
    bool tcp = false, payload = false;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      for (const char c : lines[i]) ASSERT_TRUE(c >= 0x20 && c <= 0x7e);
      if (i > 0 && i + 2 < lines.size()) { EXPECT_EQ(lines[i][0], ' '); }
      tcp |= starts(lines[i], " set_tcp(");
      payload |= starts(lines[i], " set_payload(");
      travels += starts(lines[i], " movej(") || starts(lines[i], " movel(");
      if (starts(lines[i], " move")) {
        EXPECT_TRUE(tcp && payload);
        if (moves == 0) { EXPECT_TRUE(starts(lines[i], " movej(")); }
        ++moves;
      }
      paths += starts(lines[i], " # path ");
    }
    EXPECT_EQ(moves, part.moves);
    EXPECT_LE(moves, print.machine.program.max_moves_per_part);
    EXPECT_LE(text.size(), 900000u);
    EXPECT_EQ(paths, static_cast<int>(part.chains.size()));
    for (const EmittedChain& chain : part.chains) printed.push_back({chain.path, chain.section});
    EXPECT_EQ(job.substr(part.duet_offset, 9), ";PART:" + std::to_string(p + 1) + "\nM");
  }
  EXPECT_EQ(travels, static_cast<int>(print.motion.travels.size() + out.parts.size())) << "one movej more to start each part";
  const std::vector<std::pair<Index, int>> expected = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}, {5, 1}};
  EXPECT_EQ(printed, expected);
}

TEST(EmitRobot, ExpectedSecondsAddUpToTheHeader) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  double sum = 0.0;
  for (const EmittedPart& part : out.parts) sum += part.expected_s;
  EXPECT_NEAR(sum, out.report.time_s, 1e-6);
  const std::string job = text_of(file(out, "duet/print.g"));
  const std::string time = ";TIME:" + std::to_string(std::lround(sum)) + "\n";
  EXPECT_NE(job.find(time), std::string::npos);
  EXPECT_NE(job.find(time, job.size() - 4000), std::string::npos);
  EXPECT_NE(job.find("; num_layers = 3\n", job.size() - 4000), std::string::npos);
  EXPECT_NE(job.find("; layer_height = 0.400\n"), std::string::npos);
  EXPECT_LT(job.find("; filament used [mm] = "), 1000u);
}

TEST(EmitRobot, NumbersAreInRangeAndLinesShort) {
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  for (const EmittedPart& part : out.parts) {
    std::vector<RobotMove> run;
    for (const std::string& line : lines_of(text_of(file(out, part.file)))) {
      const auto at = line.find("p[");
      if (at != std::string::npos && line.find("move") != std::string::npos) {
        EXPECT_EQ(line.find('e', line.find("p[") + 2) < line.find(']'), false);
        const auto n = numbers_in(line.substr(at + 2));
        for (int i = 0; i < 3; ++i) EXPECT_LT(std::abs(n[i]), 1.3);
        for (int i = 3; i < 6; ++i) EXPECT_LT(std::abs(n[i]), 2 * std::numbers::pi);
      }
      if (!starts(line, " movep(")) {
        if (!starts(line, " set_standard_digital_out(2")) run.clear();
        continue;
      }
      const auto n = numbers_in(line.substr(line.find("p[") + 2));
      ASSERT_EQ(n.size(), 9u);
      EXPECT_TRUE(n[6] > 0.0 && n[6] <= 3.0 && n[7] > 0.0 && n[7] <= 0.5);
      EXPECT_TRUE(n[8] == 0.0 || n[8] >= 1e-4);
      run.push_back({Vec3(n[0], n[1], n[2]), n[8], n[7]});
      if (run.size() > 1) {
        const double d = (run.back().position - run[run.size() - 2].position).norm();
        EXPECT_LT(run.back().blend_m + run[run.size() - 2].blend_m, d);
        EXPECT_LE(run.back().blend_m, 0.45 * d);
      }
    }
  }
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    EXPECT_LE(line.size(), 255u);
    EXPECT_EQ(line.find("e-"), std::string::npos);
  }
}

TEST(EmitRobot, SameBytesThroughASpoolFolderAsInMemory) {
  const TempFolder folder;
  const Print print = small_print();
  const EmittedFiles in_memory = emit_robot(print.toolpaths, print.motion, print.machine);
  const EmittedFiles spooled = emit_robot(print.toolpaths, print.motion, print.machine, {.spool_folder = folder.path()});
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  ASSERT_EQ(in_memory.files.size(), spooled.files.size());
  for (std::size_t i = 0; i < in_memory.files.size(); ++i) EXPECT_EQ(text_of(in_memory.files[i]), text_of(spooled.files[i])) << in_memory.files[i].name;
}

TEST(EmitRobot, SameBytesForAnyLocaleAndThreadCount) {
  const Print print = small_print();
  const EmittedFiles one = emit_robot(print.toolpaths, print.motion, print.machine);
  const char* german = std::setlocale(LC_ALL, "de_DE.UTF-8");
  RunContext run;
  run.threads = 2;
  const EmittedFiles two = emit_robot(print.toolpaths, print.motion, print.machine, {}, run);
  if (german) std::setlocale(LC_ALL, "C");
  ASSERT_EQ(one.files.size(), two.files.size());
  for (std::size_t i = 0; i < one.files.size(); ++i) {
    EXPECT_EQ(one.files[i].name, two.files[i].name);
    EXPECT_EQ(text_of(one.files[i]), text_of(two.files[i])) << one.files[i].name;
  }
}

TEST(EmitRobot, TelnetCountsTheSameSignalsOnBothSides) {
  Print print = small_print();
  print.machine.link.kind = DuetLink::telnet;
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  const auto number_after = [](const std::string& line, const std::string& key) {
    return std::stol(line.substr(line.find(key) + key.size()));
  };
  std::vector<long> sent, awaited, answers, heard;
  for (const EmittedPart& part : out.parts) {
    for (const std::string& line : lines_of(text_of(file(out, part.file)))) {
      if (starts(line, " exchange(\"set global.rc=")) {
        sent.push_back(number_after(line, "global.rc="));
        heard.push_back(number_after(line, "\"rc "));
      }
      if (starts(line, " gate = ")) sent.push_back(number_after(line, "gate = "));
    }
  }
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    if (starts(line, "while global.rc < ")) awaited.push_back(number_after(line, "< "));
    if (starts(line, "M118 P4 S\"<rc ")) answers.push_back(number_after(line, "<rc "));
    EXPECT_FALSE(starts(line, "M577"));
  }
  EXPECT_EQ(sent, awaited);
  EXPECT_EQ(heard, answers);
  for (std::size_t i = 0; i < sent.size(); ++i) ASSERT_EQ(sent[i], static_cast<long>(i) + 1);
}

TEST(EmitRobot, StreamSendsAllFilamentFromTheRobot) {
  Print print = small_print();
  print.machine.link.kind = DuetLink::stream;
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  double printed = 0.0, balance = 0.0;
  for (const EmittedPart& part : out.parts) {
    for (const std::string& line : lines_of(text_of(file(out, part.file)))) {
      if (line.find("\"G1 X") != std::string::npos) printed += word(line, 'E');
      if (line.find("\"G1 E") != std::string::npos) balance += word(line, 'E');
      EXPECT_LE(line.size(), 255u);
    }
  }
  EXPECT_NEAR(printed, out.report.printed_filament_mm[0] + out.report.printed_filament_mm[1], 1e-4);
  EXPECT_NEAR(balance, 4 * 6.0, 1e-9) << "four loads, purging 6 mm each";
  EXPECT_EQ(text_of(file(out, "duet/print.g")).find("\nG1"), std::string::npos);
}

// Stops closer to each other than a gate may follow: gates go as far behind a stop as they can.
TEST(EmitRobot, GatesKeepAwayFromStops) {
  Print print;
  PrintBuilder builder(print);
  std::vector<Vec3> tips = {Vec3(0, 0, 0.4)};
  for (int i = 0; i < 40; ++i) {  // long ways with a spike of two stops at each end
    const double x = tips.back().x(), y = tips.back().y();
    tips.emplace_back(x + 9.2, y, 0.4);
    tips.emplace_back(x + 9.0, y + 0.01, 0.4);
    tips.emplace_back(x + 9.4, y + 0.02, 0.4);
  }
  builder.add_path(0, Material::model, tips);
  builder.finish();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  EXPECT_GT(out.report.stops, 70u);
  EXPECT_EQ(out.report.tight_gates, 0u);
  double since_stop = 1.0, feed = 0.0;
  Vec3 last = Vec3::Zero();
  for (const std::string& line : lines_of(text_of(file(out, "duet/print.g")))) {
    if (line == "M400") since_stop = 0.0;
    if (starts(line, "M577 P2")) { EXPECT_GE(since_stop, 0.15); }
    if (starts(line, "G0 X")) last = Vec3(word(line, 'X'), word(line, 'Y'), word(line, 'Z'));
    if (!starts(line, "G1 X")) continue;
    feed = word(line, 'F', feed);
    const Vec3 tip(word(line, 'X'), word(line, 'Y'), word(line, 'Z'));
    since_stop += 60.0 * (tip - last).norm() / feed;
    last = tip;
  }
}

TEST(EmitRobot, ChainAboveTheCapIsAnError) {
  Print print = small_print();
  print.machine.program.max_moves_per_part = 100;
  try {
    (void)emit_robot(print.toolpaths, print.motion, print.machine);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::usage) << "a setting, not a bug";
    EXPECT_EQ(error.where(), "config key machine.program.max_moves_per_part");
  }
}

TEST(EmitRobot, ChangeOfMaterialNeedsThePurgeStation) {
  Print print = small_print();
  for (Travel& travel : print.motion.travels) {
    if (travel.step == TravelStep::purge) travel.step = TravelStep::cross;
  }
  EXPECT_THROW(emit_robot(print.toolpaths, print.motion, print.machine), Error);
}

// The player against a robot of sockets: it must send bare functions in order, and stop when a part says it stopped.
constexpr const char* kFakeRobot = R"PY(
import re, socket, subprocess, sys, threading
folder, stop_at = sys.argv[1], int(sys.argv[2])
def listen():
    s = socket.socket(); s.bind(("127.0.0.1", 0)); s.listen(); return s
program, watch = listen(), listen()
seen = []
def serve():
    while True:
        w, _ = watch.accept()
        p, _ = program.accept()
        text = b""
        while not text.endswith(b"\nend\n"):
            text += p.recv(65536)
        p.sendall(b"x" * 100)
        number = int(re.match(rb"def part_(\d+)", text)[1])
        seen.append(number)
        w.sendall(b"noise" * 20 + (b"curvesup stopped: ..." if number == stop_at else b"curvesup part %04d finished" % number))
threading.Thread(target=serve, daemon=True).start()
code = subprocess.call([sys.executable, folder + "/play_parts.py", "127.0.0.1", "--from", "2", "--port",
    str(program.getsockname()[1]), "--watch-port", str(watch.getsockname()[1])], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
print(seen, code)
)PY";

std::string play(const std::filesystem::path& folder, int stop_at) {
  const std::string command = "python3 " + (folder / "fake_robot.py").string() + " " + (folder / "robot").string() + " " + std::to_string(stop_at);
  std::string said;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return said;
  char buffer[200];
  while (std::fgets(buffer, sizeof buffer, pipe)) said += buffer;
  pclose(pipe);
  return said;
}

TEST(PlayParts, SendsInOrderAndStopsWithTheRobot) {
  if (std::system("python3 -c pass") != 0) GTEST_SKIP() << "no python3";
  const Print print = small_print();
  const EmittedFiles out = emit_robot(print.toolpaths, print.motion, print.machine);
  const auto folder = std::filesystem::path(CURVESUP_BINARY_DIR) / "play_parts_test";
  std::filesystem::create_directories(folder / "robot");
  for (const EmittedFile& f : out.files) {
    if (starts(f.name, "robot/")) std::ofstream(folder / f.name) << text_of(f);
  }
  std::ofstream(folder / "fake_robot.py") << kFakeRobot;
  ASSERT_EQ(out.parts.size(), 4u);
  EXPECT_EQ(play(folder, 0), "[2, 3, 4] 0\n");
  EXPECT_EQ(play(folder, 3), "[2, 3] 1\n");
  std::filesystem::remove_all(folder);
}

TEST(EmitWaypoints, RowsHoldNozzleTipsAndFilamentSoFar) {
  const Print print = small_print();
  const auto files = emit_waypoints(print.toolpaths, print.motion, print.machine);
  ASSERT_EQ(files.size(), 6u);
  EXPECT_EQ(files[0].name, "waypoints/00001S.txt");
  EXPECT_EQ(files[5].name, "waypoints/00006.txt");
  const auto rows = lines_of(text_of(files[5]));
  ASSERT_EQ(rows.size(), 302u);  // the point of the cut stands twice
  int jumps = 0;
  for (const std::string& row : rows) {
    const auto n = numbers_in(row);
    ASSERT_EQ(n.size(), 9u);
    EXPECT_NEAR(n[2], 1.2, 1e-9);
    jumps += n[7] == 1.0;
    EXPECT_EQ(n[8], 1.0);
  }
  EXPECT_EQ(jumps, 2);
  EXPECT_EQ(numbers_in(rows.front())[6], 0.0);
  const double length = 300 * 2 * 25 * std::sin(std::numbers::pi / 300);
  EXPECT_NEAR(numbers_in(rows.back())[6], 0.32 * length / (std::numbers::pi / 4 * 1.75 * 1.75), 1e-4);
  // Without a motion the layer's own points and normals stand in.
  const Motion standing;
  const auto plain = emit_waypoints(print.toolpaths, standing, print.machine);
  EXPECT_EQ(lines_of(text_of(plain[5])).size(), 301u);
}

}  // namespace
}  // namespace curvesup
