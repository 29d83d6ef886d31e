#include "check/emitted_job.h"

#include <cmath>
#include <map>
#include <numbers>

#include "check/emitted_lines.h"
#include "check/emitted_text.h"

namespace curvesup::emitted {

namespace {

constexpr std::size_t kMaxLine = 255;
constexpr double kMinFeed = 30.0;        // mm/min of the extruder alone
constexpr double kMaxFeed = 60.0 * 500;  // mm/min
constexpr double kStandbyLimit = 400.0;  // degrees

struct Command {
  std::string_view code;
  std::string_view parameters;  // letters
};

// What a job may hold.
constexpr Command kJobCommands[] = {
    {"G0", "XYZF"}, {"G1", "XYZEF"}, {"G4", "SP"}, {"G10", "PSR"}, {"G21", ""}, {"G90", ""}, {"G92", "XYZE"}, {"G94", ""},
    {"M42", "PS"}, {"M83", ""}, {"M104", "ST"}, {"M106", "PS"}, {"M107", ""}, {"M116", "PS"}, {"M117", ""}, {"M118", "PS"},
    {"M203", "XYZEI"}, {"M204", "PT"}, {"M221", "DS"}, {"M400", ""}, {"M564", "HS"}, {"M566", "XYZE"}, {"M568", "PSRA"},
    {"M572", "DS"}, {"M577", "PS"}, {"T0", "P"}, {"T1", "P"}, {"T2", "P"}, {"T3", "P"}, {"T-1", "P"}};
// What settings may hold besides.
constexpr Command kSettingsCommands[] = {
    {"M92", "XYZE"}, {"M201", "XYZE"}, {"M302", "SRP"}, {"M350", "XYZEI"}, {"M563", "PSDHF"}, {"M581", "PTSR"}, {"M584", "XYZE"},
    {"M586", "PST"}, {"M906", "XYZE"}, {"M950", "JPCSFH"}};

const Command* find_command(std::string_view code, bool settings) {
  for (const Command& command : kJobCommands) {
    if (command.code == code) return &command;
  }
  if (settings) {
    for (const Command& command : kSettingsCommands) {
      if (command.code == code) return &command;
    }
  }
  return nullptr;
}

bool is_meta(std::string_view line) {
  for (const std::string_view word : {"while ", "if ", "global ", "set ", "break", "elif ", "else", "var ", "echo "}) {
    if (starts_with(line, word)) return true;
  }
  return false;
}

// Code and words of a command line.
struct Words {
  std::string_view code;
  double value[26] = {};
  int decimals[26] = {};
  std::uint32_t present = 0;
  std::string_view text;  // of S"..."
  bool good = true;

  [[nodiscard]] bool has(char letter) const { return (present >> (letter - 'A') & 1u) != 0; }
  [[nodiscard]] double get(char letter) const { return value[letter - 'A']; }
  [[nodiscard]] int digits(char letter) const { return decimals[letter - 'A']; }
};

Words read_words(std::string_view line) {
  Words words;
  const std::size_t code_end = std::min(line.find(' '), line.size());
  words.code = line.substr(0, code_end);
  std::size_t at = code_end;
  while (at < line.size()) {
    if (line[at] != ' ' || at + 1 >= line.size()) return words.good = false, words;
    ++at;
    const char letter = line[at++];
    if (letter < 'A' || letter > 'Z' || words.has(letter)) return words.good = false, words;
    words.present |= 1u << (letter - 'A');
    if (at < line.size() && line[at] == '"') {
      const std::size_t end = line.find('"', at + 1);
      if (end == std::string_view::npos) return words.good = false, words;
      words.text = line.substr(at + 1, end - at - 1);
      at = end + 1;
      continue;
    }
    Number number;
    if (!read_number(line, at, number) || !number.plain) return words.good = false, words;
    words.value[letter - 'A'] = number.value;
    words.decimals[letter - 'A'] = number.decimals;
    // Lists of drives: only the first counts here.
    while (at < line.size() && line[at] == ':') {
      ++at;
      if (!read_number(line, at, number)) return words.good = false, words;
    }
  }
  return words;
}

void check_line(std::string_view line, const Place& place, Findings& findings) {
  findings.expect(is_printable(line), Rule::job_lines, place, "a byte that is not printable ASCII");
  const std::size_t command = std::min(line.find(';'), line.size());
  findings.expect(command <= kMaxLine, Rule::job_lines, place, "more than 255 characters before the comment");
}

void check_parameters(const Words& words, bool settings, const Place& place, Findings& findings) {
  const Command* command = find_command(words.code, settings);
  if (!command) return findings.fail(Rule::job_commands, place, "unknown command " + std::string(words.code));
  findings.expect(words.good, Rule::job_commands, place, "words that cannot be read");
  std::uint32_t unknown = words.present;
  for (const char letter : command->parameters) unknown &= ~(1u << (letter - 'A'));
  for (char letter = 'A'; unknown != 0; ++letter, unknown >>= 1) {
    if (unknown & 1u) findings.fail(Rule::job_commands, place, std::string(words.code) + " has no parameter " + letter);
  }
}

long seconds_of(std::string_view text) {
  long total = 0;
  std::size_t at = 0;
  while (at < text.size()) {
    if (text[at] == ' ') {
      ++at;
      continue;
    }
    int value = 0;
    if (!read_integer(text, at, value) || at >= text.size()) return -1;
    const char unit = text[at++];
    if (unit != 'h' && unit != 'm' && unit != 's') return -1;
    total += value * (unit == 'h' ? 3600 : unit == 'm' ? 60 : 1);
  }
  return total;
}

class JobReader {
 public:
  JobReader(Job& job, const Machine& machine) : job_(job), machine_(machine) {
    const double diameter = machine.extruder.filament_diameter_mm;
    filament_area_ = std::numbers::pi / 4.0 * diameter * diameter;
  }

  void read(const std::filesystem::path& folder) {
    FileLines lines(folder / job_.file);
    // A line of a move has 30 characters or more. What is not used costs no memory.
    job_.moves.reserve(lines.size() / 30);
    job_.events.reserve(lines.size() / 24);
    std::string_view line;
    while (lines.next(line)) {
      place_.line = lines.number();
      if (place_.line == 1) expect(starts_with(line, "; generated by "), Rule::header, "the first line does not name the program");
      check_line(line, place_, job_.findings);
      if (line.empty()) continue;
      if (line[0] == ';') {
        read_comment(line, lines.offset());
      } else if (line[0] == ' ' || is_meta(line)) {
        read_meta(line);
      } else {
        read_command(line);
      }
    }
    expect(lines.ended(), Rule::job_lines, "the last line has no line feed");
    job_.bytes = lines.bytes();
    job_.sha256 = lines.sha256();
    finish();
  }

 private:
  void fail(Rule rule, std::string_view what) { job_.findings.fail(rule, place_, what); }
  void expect(bool ok, Rule rule, std::string_view what) {
    if (!ok) fail(rule, what);
  }
  void add(JobEvent::Kind kind, int number = 0, bool level = false) {
    job_.events.push_back({kind, level, number, place_.line});
  }

  // ---- comments

  void read_comment(std::string_view line, std::uint64_t offset) {
    std::size_t at = 0;
    int number = 0;
    if (read_literal(line, at, ";PART:")) {
      expect(read_integer(line, at, number) && at == line.size(), Rule::path_order, "a part comment that cannot be read");
      job_.part_offsets.push_back(offset);
      job_.part_numbers.push_back(number);
      return add(JobEvent::Kind::part, number);
    }
    if (read_literal(line, at, ";CHANGE:")) {
      expect(read_integer(line, at, number), Rule::tool_change, "a change comment that cannot be read");
      return add(JobEvent::Kind::change, number);
    }
    if (read_literal(line, at, ";END")) return add(JobEvent::Kind::end);
    if (read_literal(line, at, ";LAYER:")) {
      expect(read_integer(line, at, number) && number == group_ + 1, Rule::layers, "groups do not count 0, 1, ...");
      group_ = number;
      layer_known_ = false;
      return;
    }
    if (read_literal(line, at, ";K:")) {
      expect(read_integer(line, at, layer_), Rule::layers, "a layer comment that cannot be read");
      layer_known_ = true;
      return;
    }
    if (read_literal(line, at, ";PATH:")) return read_path(line, at);
    if (read_literal(line, at, ";TYPE:")) {
      if (!job_.paths.empty()) job_.paths.back().type = std::string(line.substr(at));
      return;
    }
    read_header(line, offset);
  }

  void read_path(std::string_view line, std::size_t at) {
    JobPath path;
    const bool good = read_integer(line, at, path.path) && read_literal(line, at, " section ") && read_integer(line, at, path.section) &&
                      read_literal(line, at, " of ") && read_integer(line, at, path.sections) && at == line.size();
    expect(good, Rule::path_order, "a path comment that cannot be read");
    expect(group_ >= 0 && layer_known_, Rule::layers, "a path without layer comments before it");
    path.group = group_;
    path.layer = layer_;
    path.line = place_.line;
    add(JobEvent::Kind::path, static_cast<int>(job_.paths.size()));
    job_.paths.push_back(path);
  }

  void read_header(std::string_view line, std::uint64_t offset) {
    std::size_t at = 0;
    Number number;
    JobHeader& header = job_.header;
    if (read_literal(line, at, "; layer_height = ") && read_number(line, at, number)) header.layer_height_mm = number.value;
    at = 0;
    if (read_literal(line, at, "; filament used [mm] = ")) {
      while (read_number(line, at, number)) {
        header.filament_mm.push_back(number.value);
        read_literal(line, at, ", ");
      }
    }
    at = 0;
    if (read_literal(line, at, ";TIME:") && read_number(line, at, number)) {
      (job_.events.empty() ? header.time_s : header.end_time_s) = static_cast<long>(number.value);
    }
    at = 0;
    if (read_literal(line, at, "; estimated printing time (normal mode) = ")) header.written_time_s = seconds_of(line.substr(at));
    at = 0;
    if (!read_literal(line, at, "; num_layers = ")) return;
    read_integer(line, at, header.layers);
    layers_offset_ = offset;
  }

  // ---- commands of links without wires

  void read_meta(std::string_view line) {
    int number = 0;
    std::size_t at = 0;
    if (machine_.link.kind == DuetLink::dio) return fail(Rule::job_lines, "a leading space or a meta command");
    if (read_literal(line, at, "while global.rc < ") && read_integer(line, at, number)) return add(JobEvent::Kind::wait_signal, number);
    if (read_literal(line, at, "while global.rpart != ") && read_integer(line, at, number)) {
      return add(JobEvent::Kind::wait_signal, -number);
    }
    const bool in_loop = !job_.events.empty() && job_.events.back().kind == JobEvent::Kind::wait_signal;
    if (in_loop && starts_with(line, "  G4 P")) {
      job_.events.back().level = true;
      return;
    }
    if (in_loop && line == "  set global.rw = 0") return;
    if (line == "set global.rpart = 0" || starts_with(line, "set global.rc = ")) return;
    fail(Rule::job_commands, "a meta command that is not part of the link");
  }

  // ---- commands

  void read_command(std::string_view line) {
    line = line.substr(0, line.find(';'));
    while (!line.empty() && line.back() == ' ') line.remove_suffix(1);
    const Words words = read_words(line);
    check_parameters(words, false, place_, job_.findings);
    if (!words.good || words.code.empty()) return;
    const std::string_view code = words.code;
    if (code == "G1" || code == "G0") return read_move(words);
    if (code[0] == 'T') return read_tool(words);
    if (code == "M577") return read_wait(words);
    if (code == "M42") return read_output(words);
    if (code == "M400") return add(JobEvent::Kind::stop);
    if (code == "M118") return read_answer(words);
    if (code == "G21") millimetres_ = true;
    if (code == "G90") absolute_ = true;
    if (code == "M83") relative_ = true;
    if (code == "M564") free_axes_ = words.has('H') && words.get('H') == 0.0 && words.has('S') && words.get('S') == 0.0;
    if (code == "M204") read_acceleration(words);
    if (code == "G92") read_position(words);
    if (code == "G10") read_temperature(words);
    if (code == "M116") read_heat_wait(words);
    if (code == "M106") read_fan(words);
    if (code == "M107") fan_ = 0.0;
    add(JobEvent::Kind::other);
  }

  void read_acceleration(const Words& words) {
    const double wanted = 1000.0 * machine_.speeds.print_acceleration_m_s2;
    expect(words.has('P') && std::abs(words.get('P') - wanted) <= 0.1, Rule::prelude, "the acceleration is not the arm's");
    acceleration_set_ = true;
  }

  void read_position(const Words& words) {
    expect(!words.has('E'), Rule::prelude, "the extruder's position is set");
    expect(words.has('X') && words.has('Y') && words.has('Z'), Rule::prelude, "G92 without all axes");
    const Vec3 there(words.get('X'), words.get('Y'), words.get('Z'));
    expect(!placed_ || (there - tip_).norm() < 1e-3, Rule::prelude, "G92 shifts the axes");
    tip_ = there;
    placed_ = true;
  }

  void read_temperature(const Words& words) {
    if (!words.has('P') || !words.has('S')) return fail(Rule::tool_and_heat, "G10 needs tool and temperature");
    expect(words.get('S') <= kStandbyLimit, Rule::tool_and_heat, "a temperature beyond 400 degrees");
    target_[static_cast<int>(words.get('P'))] = words.get('S');
    hot_[static_cast<int>(words.get('P'))] = false;
  }

  void read_heat_wait(const Words& words) {
    if (!words.has('P')) {
      for (auto& [tool, degrees] : target_) hot_[tool] = true;
    } else {
      hot_[static_cast<int>(words.get('P'))] = true;
    }
    add(JobEvent::Kind::heat_wait, words.has('P') ? static_cast<int>(words.get('P')) : -1);
  }

  void read_fan(const Words& words) {
    const bool good = words.has('P') && static_cast<int>(words.get('P')) == machine_.extruder.fan && words.has('S');
    expect(good, Rule::final_state, "M106 needs the machine's fan and a share");
    expect(words.get('S') >= 0.0 && words.get('S') <= 1.0, Rule::final_state, "a fan share outside 0 and 1");
    fan_ = words.get('S');
  }

  void read_tool(const Words& words) {
    std::size_t at = 1;
    int tool = -1;
    if (!read_integer(words.code, at, tool)) return fail(Rule::job_commands, "a tool that cannot be read");
    expect(tool == -1 || material_of(tool) >= 0, Rule::tool_and_heat, "a tool that the machine does not have");
    tool_ = tool;
    add(JobEvent::Kind::tool, tool);
  }

  void read_wait(const Words& words) {
    const bool good = words.has('P') && (!words.has('S') || words.get('S') == 0.0 || words.get('S') == 1.0);
    expect(good, Rule::barriers, "M577 needs an input and a level");
    add(JobEvent::Kind::wait_input, static_cast<int>(words.get('P')), !words.has('S') || words.get('S') == 1.0);
  }
  void read_output(const Words& words) {
    const bool good = words.has('P') && words.has('S') && (words.get('S') == 0.0 || words.get('S') == 1.0);
    expect(good, Rule::barriers, "M42 needs an output and a level");
    add(JobEvent::Kind::output, static_cast<int>(words.get('P')), words.get('S') == 1.0);
  }
  void read_answer(const Words& words) {
    std::size_t at = 0;
    int number = 0;
    const bool part = read_literal(words.text, at, "<part ");
    const bool good = (part || read_literal(words.text, at, "<rc ")) && read_integer(words.text, at, number) && words.text.substr(at) == ">";
    expect(good, Rule::barriers, "an answer that cannot be read");
    add(JobEvent::Kind::answer, part ? -number : number);
  }

  // ---- moves

  void read_move(const Words& words) {
    expect(millimetres_ && absolute_ && relative_ && free_axes_ && placed_ && acceleration_set_, Rule::prelude,
           "a move before G21, G90, M83, M564 H0 S0, M204 and G92");
    JobMove move;
    move.line = place_.line;
    move.rapid = words.code == "G0";
    const Vec3 from = tip_;
    const bool x = words.has('X'), y = words.has('Y'), z = words.has('Z');
    move.has_xyz = x || y || z;
    expect(!move.has_xyz || (x && y && z), Rule::same_polyline, "a move without all of X, Y and Z");
    if (x) tip_.x() = words.get('X');
    if (y) tip_.y() = words.get('Y');
    if (z) tip_.z() = words.get('Z');
    if (words.has('F')) feed_ = words.get('F');
    move.tip_mm = tip_;
    move.feed_mm_s = static_cast<float>(feed_ / 60.0);
    move.has_e = words.has('E');
    move.e_mm = move.has_e ? static_cast<float>(words.get('E')) : 0.0f;
    move.tool = static_cast<std::int8_t>(tool_);
    expect(feed_ > 0.0, Rule::feeds, "a move before any feed");
    expect(feed_ <= kMaxFeed, Rule::feeds, "a feed beyond 500 mm/s");
    if (move.has_e) check_filament(words, move.has_xyz, (tip_ - from).norm());
    if (job_.moves.empty()) job_.start_mm = from;
    add(JobEvent::Kind::move, static_cast<int>(job_.moves.size()));
    job_.moves.push_back(move);
  }

  [[nodiscard]] int material_of(int tool) const {
    for (int m = 0; m < kMaterialCount; ++m) {
      if (machine_.filaments[static_cast<std::size_t>(m)].tool == tool) return m;
    }
    return -1;
  }

  void check_filament(const Words& words, bool along, double length_mm) {
    expect(words.digits('E') >= 5, Rule::volume, "E with fewer than five decimals");
    const int material = material_of(tool_);
    if (material < 0) return fail(Rule::tool_and_heat, "filament moves without a tool");
    const Filament& filament = machine_.filaments[static_cast<std::size_t>(material)];
    const double e = words.get('E'), speed = feed_ / 60.0;
    expect(heated(filament), Rule::tool_and_heat, "filament moves before the tool is hot");
    if (along) {
      expect(e >= 0.0, Rule::volume, "a printing move takes filament back");
      const double seconds = length_mm / speed;
      const double rounding = 0.5e-6 * filament_area_ / std::max(seconds, 1e-9);
      const double flow = seconds > 0.0 ? e * filament_area_ / filament.flow / seconds : 1e9;
      // Coordinates of four decimals: a short move may be 0.0001 mm shorter than meant.
      const double shorter = 2e-4 / std::max(length_mm, 1e-4);
      job_.findings.at_most(Rule::flow, (flow - rounding) / filament.max_flow_mm3_s / (1.0 + shorter), 1.002, place_,
                            "more melt a second than the filament allows");
      expect(retracted_ == 0.0, Rule::retraction, "printing with retracted filament");
      return;
    }
    expect(feed_ >= kMinFeed, Rule::feeds, "the extruder alone moves slower than 30 mm/min");
    expect(speed <= machine_.extruder.max_e_mm_s + 1e-6, Rule::feeds, "the extruder alone moves too fast");
    check_balance(e, filament);
  }

  [[nodiscard]] bool heated(const Filament& filament) const {
    const auto hot = hot_.find(tool_);
    const auto target = target_.find(tool_);
    return hot != hot_.end() && hot->second && target != target_.end() && target->second >= filament.min_temperature_c;
  }

  // The extruder alone: retract and un-retract in turn; load and unload between them.
  void check_balance(double e, const Filament& filament) {
    const double tolerance = 2e-5;
    const bool is_retract = std::abs(e + filament.retract_mm) < tolerance, is_return = std::abs(e - filament.retract_mm) < tolerance;
    const bool is_load = std::abs(e - filament.load_mm - filament.purge_mm) < tolerance;
    const bool is_unload = std::abs(e + filament.unload_mm) < tolerance;
    if (is_return && retracted_ > 0.0) {
      retracted_ = 0.0;
    } else if (is_retract && retracted_ == 0.0 && loaded_ == tool_) {
      retracted_ = filament.retract_mm;
    } else if (is_load && loaded_ < 0) {
      loaded_ = tool_;
      retracted_ = 0.0;
    } else if (is_unload && loaded_ == tool_ && retracted_ == 0.0) {
      loaded_ = -1;
    } else {
      fail(Rule::retraction, "a move of the extruder alone that is no retract, return, load or unload at its place");
    }
  }

  void finish() {
    place_.line = 0;
    expect(fan_ == 0.0, Rule::final_state, "the fan stays on");
    for (const auto& [tool, degrees] : target_) expect(degrees == 0.0, Rule::final_state, "a heater stays on");
    expect(tool_ == -1, Rule::final_state, "a tool stays selected");
    expect(loaded_ == -1, Rule::retraction, "filament stays loaded");
    expect(relative_, Rule::final_state, "M83 is not restored");
    const JobHeader& header = job_.header;
    expect(header.layer_height_mm > 0.0, Rule::header, "no layer height");
    expect(header.layers == group_ + 1, Rule::header, "num_layers is not the number of groups");
    expect(header.time_s > 0 && header.time_s == header.end_time_s && header.time_s == header.written_time_s, Rule::header,
           "the times in header and footer do not agree");
    // Found by the firmware only within the last 4 kB.
    expect(header.layers >= 0 && layers_offset_ + 4096 >= job_.bytes, Rule::header, "num_layers is not near the end");
    check_header_filament();
  }

  // Everything that the extruder moves: the header counts loads, unloads and prints.
  void check_header_filament() {
    std::map<int, double> moved;
    for (const JobMove& move : job_.moves) {
      if (move.has_e) moved[move.tool] += static_cast<double>(move.e_mm);
    }
    for (const auto& [tool, e] : moved) {
      const auto row = static_cast<std::size_t>(std::max(tool, 0));
      const bool listed = row < job_.header.filament_mm.size();
      const bool agrees = listed && std::abs(job_.header.filament_mm[row] - e) <= 0.02 + 1e-3 * std::abs(e);
      expect(agrees, Rule::header, "the filament of tool " + std::to_string(tool) + " is not what the job moves");
    }
  }

  Job& job_;
  const Machine& machine_;
  Place place_{job_.file, 0};
  double filament_area_ = 1.0;
  bool millimetres_ = false, absolute_ = false, relative_ = false, free_axes_ = false, placed_ = false, acceleration_set_ = false;
  Vec3 tip_ = Vec3::Zero();
  double feed_ = 0.0, fan_ = 0.0, retracted_ = 0.0;
  int tool_ = -1, loaded_ = -1, group_ = -1, layer_ = -1;
  bool layer_known_ = false;
  std::uint64_t layers_offset_ = 0;
  std::map<int, double> target_;
  std::map<int, bool> hot_;
};

}  // namespace

void read_job(Job& job, const std::filesystem::path& folder, const Machine& machine) { JobReader(job, machine).read(folder); }

void read_settings(std::string_view file, std::string_view text, Findings& findings) {
  Lines lines(text);
  std::string_view line;
  while (lines.next(line)) {
    const Place place{file, lines.number()};
    check_line(line, place, findings);
    if (line.empty() || line[0] == ';' || is_meta(line) || starts_with(line, "  ")) continue;
    findings.expect(line[0] != ' ', Rule::job_lines, place, "a leading space");
    line = line.substr(0, line.find(';'));
    while (!line.empty() && line.back() == ' ') line.remove_suffix(1);
    check_parameters(read_words(line), true, place, findings);
  }
}

}  // namespace curvesup::emitted
