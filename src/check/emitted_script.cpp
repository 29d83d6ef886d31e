#include "check/emitted_script.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "check/emitted_text.h"

namespace curvesup::emitted {

namespace {

constexpr int kPositionDecimals = 6;
constexpr int kMaxString = 254;

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_word(char c) { return is_letter(c) || c == '_' || (c >= '0' && c <= '9'); }

// What a call may look like. `names` are the parameters in order.
struct Builtin {
  std::string_view name;
  int least = 0, most = 0;
  std::vector<std::string_view> names;
};

const std::vector<Builtin>& builtins() {
  static const std::vector<Builtin> list = {
      {"movej", 1, 5, {"q", "a", "v", "t", "r"}},
      {"movel", 1, 5, {"pose", "a", "v", "t", "r"}},
      {"movep", 1, 4, {"pose", "a", "v", "r"}},
      {"set_tcp", 1, 1, {"pose"}},
      {"set_payload", 1, 2, {"m", "cog"}},
      {"get_inverse_kin", 1, 5, {"x", "qnear", "maxPositionError", "maxOrientationError", "tcp"}},
      {"get_inverse_kin_has_solution", 1, 5, {"x", "qnear", "maxPositionError", "maxOrientationError", "tcp"}},
      {"set_standard_digital_out", 2, 2, {"n", "b"}},
      {"get_standard_digital_in", 1, 1, {"n"}},
      {"set_runstate_standard_digital_output_to_value", 2, 2, {"outputId", "state"}},
      {"sleep", 1, 1, {"t"}},
      {"sync", 0, 0, {}},
      {"textmsg", 1, 2, {"s1", "s2"}},
      {"popup", 1, 5, {"s", "title", "warning", "error", "blocking"}},
      {"pose_trans", 2, 2, {"p_from", "p_from_to"}},
      {"get_actual_tcp_pose", 0, 0, {}},
      {"socket_open", 2, 3, {"address", "port", "socket_name"}},
      {"socket_close", 0, 1, {"socket_name"}},
      {"socket_send_line", 1, 2, {"str", "socket_name"}},
      {"socket_send_string", 1, 2, {"str", "socket_name"}},
      {"socket_send_byte", 1, 2, {"value", "socket_name"}},
      {"socket_read_string", 0, 5, {"socket_name", "prefix", "suffix", "interpret_escape", "timeout"}},
      {"str_cat", 2, 2, {"op1", "op2"}},
      {"to_str", 1, 1, {"val"}},
  };
  return list;
}

const Builtin* find_builtin(std::string_view name) {
  for (const Builtin& builtin : builtins()) {
    if (builtin.name == name) return &builtin;
  }
  return nullptr;
}

// Expressions of one line.
class ExpressionReader {
 public:
  explicit ExpressionReader(std::string_view text) : text_(text) {}

  bool read(Expression& out) { return infix(out, 0); }
  bool at_end() {
    skip();
    return at_ == text_.size();
  }
  bool accept(std::string_view literal) {
    skip();
    return read_literal(text_, at_, literal);
  }
  std::string_view word() {
    skip();
    const std::size_t begin = at_;
    if (at_ < text_.size() && is_letter(text_[at_])) {
      while (at_ < text_.size() && is_word(text_[at_])) ++at_;
    }
    return text_.substr(begin, at_ - begin);
  }

 private:
  void skip() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }

  std::string_view operator_at(int level) {
    static constexpr std::string_view kLevels[][6] = {
        {"or"}, {"and"}, {"==", "!=", "<=", ">=", "<", ">"}, {"+", "-"}, {"*", "/", "%"}};
    skip();
    if (at_ == text_.size() || text_[at_] == ',' || text_[at_] == ')' || text_[at_] == ']') return {};
    for (const std::string_view op : kLevels[level]) {
      if (op.empty() || text_.substr(at_, op.size()) != op) continue;
      if (is_letter(op[0]) && at_ + op.size() < text_.size() && is_word(text_[at_ + op.size()])) continue;
      return op;
    }
    return {};
  }

  bool infix(Expression& out, int level) {
    if (level == 5) return prefix(out);
    if (!infix(out, level + 1)) return false;
    for (std::string_view op = operator_at(level); !op.empty(); op = operator_at(level)) {
      at_ += op.size();
      Expression right;
      if (!infix(right, level + 1)) return false;
      Expression both;
      both.kind = Expression::Kind::infix;
      both.word = op;
      both.children.push_back(std::move(out));
      both.children.push_back(std::move(right));
      out = std::move(both);
    }
    return true;
  }

  bool prefix(Expression& out) {
    skip();
    if (text_.substr(at_, 4) == "not ") {
      at_ += 4;
      out.kind = Expression::Kind::prefix;
      out.word = "not";
      return infix(out.children.emplace_back(), 2);
    }
    return primary(out);
  }

  bool list(Expression& out, char close) {
    skip();
    if (at_ < text_.size() && text_[at_] == close) return ++at_, true;
    while (true) {
      Expression& child = out.children.emplace_back();
      if (!argument(child)) return false;
      skip();
      if (at_ >= text_.size()) return false;
      const char c = text_[at_++];
      if (c == close) return true;
      if (c != ',') return false;
    }
  }

  // An argument may be named.
  bool argument(Expression& out) {
    skip();
    const std::size_t begin = at_;
    const std::string_view name = word();
    skip();
    if (!name.empty() && at_ + 1 < text_.size() && text_[at_] == '=' && text_[at_ + 1] != '=') {
      ++at_;
      out.kind = Expression::Kind::named;
      out.word = name;
      return read(out.children.emplace_back());
    }
    at_ = begin;
    return read(out);
  }

  bool primary(Expression& out) {
    skip();
    if (at_ >= text_.size()) return false;
    const char c = text_[at_];
    if (c == '"') return text(out);
    if (c == '[') {
      ++at_;
      out.kind = Expression::Kind::list;
      return list(out, ']');
    }
    if (c == '(') {
      ++at_;
      return read(out) && accept(")");
    }
    if (c == '-' || (c >= '0' && c <= '9')) {
      Number number;
      if (!read_number(text_, at_, number)) return false;
      out.kind = Expression::Kind::number;
      out.value = number.value;
      out.plain = number.plain;
      out.decimals = number.decimals;
      return true;
    }
    const std::string_view name = word();
    if (name.empty()) return false;
    if (name == "p" && accept("[")) {
      out.kind = Expression::Kind::pose;
      return list(out, ']');
    }
    out.word = name;
    if (name == "True" || name == "False") {
      out.kind = Expression::Kind::boolean;
      out.value = name == "True";
      return true;
    }
    if (accept("(")) {
      out.kind = Expression::Kind::call;
      return list(out, ')');
    }
    out.kind = Expression::Kind::name;
    return true;
  }

  bool text(Expression& out) {
    const std::size_t end = text_.find('"', at_ + 1);
    if (end == std::string_view::npos) return false;
    out.kind = Expression::Kind::text;
    out.word = text_.substr(at_ + 1, end - at_ - 1);
    at_ = end + 1;
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

bool six_numbers(const Expression& list, double* out) {
  if (list.children.size() != 6) return false;
  for (std::size_t i = 0; i < 6; ++i) {
    if (list.children[i].kind != Expression::Kind::number) return false;
    out[i] = list.children[i].value;
  }
  return true;
}

class ScriptReader {
 public:
  ScriptReader(RobotPart& part, int parts, const Machine& machine) : part_(part), parts_(parts), machine_(machine) {}

  void read() {
    Lines lines(part_.text);
    std::string_view line;
    while (lines.next(line)) {
      place_.line = lines.number();
      check_bytes(line);
      if (fast_move(line)) continue;
      read_line(line);
    }
    place_.line = lines.number();
    expect(lines.ended(), Rule::bytes, "the last line has no line feed");
    finish();
  }

 private:
  void fail(Rule rule, std::string_view what) { part_.findings.fail(rule, place_, what); }
  void expect(bool ok, Rule rule, std::string_view what) {
    if (!ok) fail(rule, what);
  }

  void check_bytes(std::string_view line) {
    expect(is_printable(line), Rule::bytes, "a byte that is not printable ASCII");
  }

  // "movep(p[..6], a=, v=, r=)" as nearly all lines are; false for everything else.
  bool fast_move(std::string_view line) {
    std::size_t at = 0;
    if (closed_ || !open_.empty() || place_.line == 1 || !read_literal(line, at, " movep(p[")) return false;
    double values[9];
    Number number;
    for (int i = 0; i < 6; ++i) {
      if (!read_number(line, at, number) || !number.plain || number.decimals < kPositionDecimals) return false;
      values[i] = number.value;
      if (i < 5 ? !read_literal(line, at, ",") : !read_literal(line, at, "]")) return false;
    }
    const auto named = [&](const auto& name, double& value) {
      if (!read_literal(line, at, name) || !read_number(line, at, number) || !number.plain) return false;
      value = number.value;
      return true;
    };
    if (!named(", a=", values[6]) || !named(", v=", values[7]) || !named(", r=", values[8]) || !read_literal(line, at, ")")) return false;
    const std::string_view rest = line.substr(at);
    if (!rest.empty() && rest != " # rotation") return false;
    RobotMove move;
    move.has_pose = true;
    move.marked = !rest.empty();
    take_pose(values, move);
    move.a = static_cast<float>(values[6]);
    move.v = static_cast<float>(values[7]);
    move.r = static_cast<float>(values[8]);
    add_move(move, nullptr);
    return true;
  }

  void read_line(std::string_view line) {
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    std::string_view text = line.substr(indent);
    std::string_view comment;
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
      quoted ^= text[i] == '"';
      if (text[i] != '#' || quoted) continue;
      comment = text.substr(i);
      text = text.substr(0, i);
      break;
    }
    expect(!quoted, Rule::strings, "a string does not end");
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    if (text.empty() && comment.empty()) return;
    if (closed_) return after_end(line);
    if (place_.line == 1) return first_line(line);
    if (line == "end") {
      expect(open_.empty(), Rule::blocks, "the program ends inside a block");
      open_.clear();
      closed_ = true;
      return;
    }
    expect(indent > 0, Rule::bytes, "a line inside the program does not start with a space");
    if (text.empty()) return read_comment(comment);
    marked_ = comment == "# rotation";
    read_statement(text);
  }

  void first_line(std::string_view line) {
    const std::size_t open = line.find('(');
    bool good = starts_with(line, "def ") && open != std::string_view::npos && line.substr(open) == "():";
    if (good) {
      name_ = line.substr(4, open - 4);
      good = !name_.empty() && is_letter(name_[0]);
      for (const char c : name_) good &= is_word(c);
    }
    expect(good, Rule::frame, "the first line is not def name():");
  }

  void after_end(std::string_view line) {
    const bool call = !called_ && machine_.program.form == ScriptForm::file && line.size() == name_.size() + 2 &&
                      starts_with(line, name_) && line.substr(name_.size()) == "()";
    expect(call, Rule::frame, "text behind the program's end");
    called_ = called_ || call;
  }

  void read_comment(std::string_view comment) {
    if (starts_with(comment, "# path ")) return read_path(comment);
    if (starts_with(comment, "# barrier ")) {
      const bool part = starts_with(comment, "# barrier part "), change = starts_with(comment, "# barrier change ");
      const int kind = part ? 0 : change ? 2 : starts_with(comment, "# barrier path ") ? 1 : 3;
      add_event({RobotEvent::Kind::barrier, place_.line, kind, false, 0.0f});
    }
  }

  void read_path(std::string_view comment) {
    PathComment path;
    std::size_t at = 0;
    const bool good = read_literal(comment, at, "# path ") && read_integer(comment, at, path.path) &&
                      read_literal(comment, at, " section ") && read_integer(comment, at, path.section) &&
                      read_literal(comment, at, " of ") && read_integer(comment, at, path.sections) &&
                      read_literal(comment, at, " layer ") && read_integer(comment, at, path.layer) &&
                      read_literal(comment, at, " group ") && read_integer(comment, at, path.group);
    const std::string_view material = comment.substr(std::min(at, comment.size()));
    path.material = material == " model" ? 0 : material == " support" ? 1 : -1;
    path.line = place_.line;
    if (!good || path.material < 0) return fail(Rule::path_order, "a path comment that cannot be read");
    add_event({RobotEvent::Kind::path, place_.line, static_cast<int>(part_.paths.size()), false, 0.0f});
    part_.paths.push_back(path);
  }

  // ---- statements

  struct Open {
    Statement statement;
    bool in_otherwise = false;
  };

  void read_statement(std::string_view text) {
    Statement statement;
    statement.line = place_.line;
    ExpressionReader reader(text);
    if (text == "end") return close_block();
    if (text == "else:") {
      if (open_.empty() || open_.back().statement.kind != Statement::Kind::branch) return fail(Rule::blocks, "else without if");
      open_.back().in_otherwise = true;
      return;
    }
    if (text == "halt" || text == "return" || text == "break") {
      statement.kind = Statement::Kind::leave;
      statement.name = text;
      return add(std::move(statement));
    }
    if (starts_with(text, "def ") || starts_with(text, "thread ")) return open_function(text, std::move(statement));
    const bool loop = starts_with(text, "while ");
    if (loop || starts_with(text, "if ")) {
      ExpressionReader condition(text.substr(loop ? 6 : 3));
      statement.kind = loop ? Statement::Kind::loop : Statement::Kind::branch;
      if (!condition.read(statement.expression) || !condition.accept(":") || !condition.at_end()) {
        fail(Rule::calls, "a condition that cannot be read");
      }
      check_calls(statement.expression);
      open_.push_back({std::move(statement)});
      return;
    }
    if (starts_with(text, "kill ") || starts_with(text, "join ")) {
      expect(text.substr(5) == sender_, Rule::calls, "a thread that was not started");
      if (starts_with(text, "kill ")) sender_ = {};
      return;
    }
    read_simple(text, std::move(statement));
  }

  void read_simple(std::string_view text, Statement statement) {
    const bool global = starts_with(text, "global ");
    if (global) text.remove_prefix(7);
    ExpressionReader assignment(text);
    const std::string_view name = assignment.word();
    if (!name.empty() && assignment.accept("=")) {
      statement.kind = Statement::Kind::assign;
      statement.name = name;
      if (assignment.accept("run ")) {
        sender_ = name;
      }
      if (!assignment.read(statement.expression) || !assignment.at_end()) return fail(Rule::calls, "an assignment that cannot be read");
    } else {
      ExpressionReader whole(text);
      if (!whole.read(statement.expression) || !whole.at_end() || statement.expression.kind != Expression::Kind::call) {
        return fail(Rule::calls, "a statement that cannot be read");
      }
    }
    check_calls(statement.expression);
    add(std::move(statement));
  }

  void open_function(std::string_view text, Statement statement) {
    const bool thread = text[0] == 't';
    statement.kind = thread ? Statement::Kind::thread : Statement::Kind::function;
    ExpressionReader reader(text.substr(thread ? 7 : 4));
    statement.name = reader.word();
    bool good = !statement.name.empty() && reader.accept("(");
    while (good && !reader.accept(")")) {
      statement.parameters.push_back(reader.word());
      good = !statement.parameters.back().empty();
      reader.accept(",");
    }
    expect(good && reader.accept(":") && reader.at_end(), Rule::blocks, "a definition that cannot be read");
    expect(open_.empty(), Rule::blocks, "a function inside a block");
    expect(find_builtin(statement.name) == nullptr && find_function(statement.name) == nullptr, Rule::calls, "a name defined twice");
    ++functions_open_;
    open_.push_back({std::move(statement)});
  }

  void close_block() {
    if (open_.empty()) return fail(Rule::blocks, "end without a block");
    Statement done = std::move(open_.back().statement);
    open_.pop_back();
    if (done.kind == Statement::Kind::loop) expect(passes_time(done), Rule::blocks, "a loop without sync, sleep or a move");
    if (done.kind == Statement::Kind::function || done.kind == Statement::Kind::thread) {
      --functions_open_;
      part_.functions.push_back(std::move(done));
      return;
    }
    add(std::move(done));
  }

  bool passes_time(const Statement& loop) const {
    for (const Statement& statement : loop.body) {
      if (statement.kind != Statement::Kind::call) continue;
      const std::string_view name = statement.expression.word;
      if (name == "sync" || name == "sleep" || starts_with(name, "move")) return true;
    }
    return false;
  }

  void add(Statement statement) {
    if (!open_.empty()) {
      Open& parent = open_.back();
      (parent.in_otherwise ? parent.statement.otherwise : parent.statement.body).push_back(std::move(statement));
      return;
    }
    if (statement.kind == Statement::Kind::leave) return fail(Rule::blocks, "the program leaves before its end");
    if (statement.kind == Statement::Kind::assign && statement.name == "gate") {
      add_event({RobotEvent::Kind::set_gate, place_.line, static_cast<int>(statement.expression.value), true, 0.0f});
    }
    if (statement.kind == Statement::Kind::call) execute(statement.expression);
    if (statement.kind == Statement::Kind::loop) check_connection(statement);
  }

  // The only loop of a program's own: connecting, a limited number of times.
  void check_connection(const Statement& loop) {
    const bool tested = loop.expression.kind == Expression::Kind::prefix && loop.expression.children[0].word == "socket_open";
    bool limited = false;
    for (const Statement& statement : loop.body) {
      limited |= statement.kind == Statement::Kind::branch && statement.body.size() == 1 &&
                 statement.body[0].expression.word == "lift_and_halt";
    }
    expect(tested && limited, Rule::timeouts, "a loop that may never end");
  }

  // ---- calls

  const Statement* find_function(std::string_view name) const {
    for (const Statement& function : part_.functions) {
      if (function.name == name) return &function;
    }
    return nullptr;
  }

  void check_calls(const Expression& expression) {
    for (const Expression& child : expression.children) check_calls(child);
    if (expression.kind == Expression::Kind::number) expect(expression.plain, Rule::pose_numbers, "a number that is not plain");
    if (expression.kind == Expression::Kind::text) {
      expect(expression.word.size() <= kMaxString, Rule::strings, "a string of more than 254 characters");
    }
    if (expression.kind == Expression::Kind::pose) check_pose_text(expression);
    if (expression.kind != Expression::Kind::call) return;
    const Builtin* builtin = find_builtin(expression.word);
    const int count = static_cast<int>(expression.children.size());
    if (!builtin) {
      const Statement* function = find_function(expression.word);
      if (!function) return fail(Rule::calls, "unknown function " + std::string(expression.word));
      expect(count == static_cast<int>(function->parameters.size()) || function->kind == Statement::Kind::thread, Rule::calls,
             "wrong number of arguments for " + std::string(expression.word));
      return;
    }
    expect(count >= builtin->least && count <= builtin->most, Rule::calls, "wrong number of arguments for " + std::string(expression.word));
    bool named = false;
    for (const Expression& child : expression.children) {
      if (child.kind == Expression::Kind::named) {
        named = true;
        bool known = false;
        for (const std::string_view name : builtin->names) known |= name == child.word;
        expect(known, Rule::calls, std::string(expression.word) + " takes no argument " + std::string(child.word));
      } else {
        expect(!named, Rule::calls, "an argument without name behind a named one");
      }
    }
  }

  void check_pose_text(const Expression& pose) {
    expect(pose.children.size() == 6, Rule::pose_numbers, "a pose without six numbers");
    // Inside functions poses are computed from constants.
    if (functions_open_) return;
    for (const Expression& child : pose.children) {
      const bool good = child.kind == Expression::Kind::number && child.decimals >= kPositionDecimals;
      expect(good, Rule::pose_numbers, "a pose needs numbers with six decimals");
    }
  }

  void take_pose(const double* values, RobotMove& move) {
    const Pose pose{{values[0], values[1], values[2]}, {values[3], values[4], values[5]}};
    const bool near = pose.position_m.cwiseAbs().maxCoeff() < machine_.arm.max_reach_m;
    expect(near, Rule::pose_numbers, "a coordinate beyond arm.max_reach_m: millimetres for metres");
    move.pose = pose;
  }

  // Position in `names` order or by name.
  static const Expression* argument(const Expression& call, std::size_t position, std::string_view name) {
    for (const Expression& child : call.children) {
      if (child.kind == Expression::Kind::named && child.word == name) return &child.children[0];
    }
    if (position < call.children.size() && call.children[position].kind != Expression::Kind::named) return &call.children[position];
    return nullptr;
  }
  static double number_of(const Expression& call, std::size_t position, std::string_view name, double otherwise) {
    const Expression* found = argument(call, position, name);
    return found && found->kind == Expression::Kind::number ? found->value : otherwise;
  }
  static std::optional<bool> level_of(const Expression& call, std::size_t position, std::string_view name) {
    const Expression* found = argument(call, position, name);
    if (!found || found->kind != Expression::Kind::boolean) return std::nullopt;
    return found->value != 0.0;
  }

  void execute(const Expression& call) {
    const std::string_view name = call.word;
    if (name == "movej") return move(call, RobotMove::Kind::joint, "q");
    if (name == "movel") return move(call, RobotMove::Kind::linear, "pose");
    if (name == "movep") return move(call, RobotMove::Kind::process, "pose");
    if (name == "set_standard_digital_out") return output(call);
    if (name == "wait_acknowledge") return wait(call);
    if (name == "exchange") return exchange(call);
    if (name == "sleep") return add_event({RobotEvent::Kind::sleep, place_.line, 0, false, static_cast<float>(number_of(call, 0, "t", 0.0))});
    if (name == "set_tcp") return tool_frame(call);
    if (name == "set_payload") return payload(call);
    if (name == "textmsg" || name == "socket_close") {
      finished_ |= name == "textmsg";
      return;
    }
    if (name == "set_runstate_standard_digital_output_to_value") {
      run_state_ = static_cast<int>(number_of(call, 1, "state", -1));
      return;
    }
    if (starts_with(name, "socket_")) return;
    fail(Rule::calls, std::string(name) + " has no business in the main part of a program");
  }

  void output(const Expression& call) {
    const auto level = level_of(call, 1, "b");
    const double number = number_of(call, 0, "n", -1.0);
    if (!level || number < 0.0 || number > 7.0) return fail(Rule::calls, "an output needs a number from 0 to 7 and a level");
    add_event({RobotEvent::Kind::output, place_.line, static_cast<int>(number), *level, 0.0f});
  }

  void wait(const Expression& call) {
    const auto level = level_of(call, 0, "level");
    const double seconds = number_of(call, 1, "seconds", -1.0);
    if (!level || seconds <= 0.0) return fail(Rule::timeouts, "a wait needs a level and a time");
    expect(seconds <= 3600.0, Rule::timeouts, "a wait of more than an hour");
    add_event({RobotEvent::Kind::wait, place_.line, 0, *level, static_cast<float>(seconds)});
  }

  // "set global.rc=K", "rc K": signal K and its answer; a part's number is negative.
  void exchange(const Expression& call) {
    if (call.children.size() != 3) return;
    const std::string_view command = call.children[0].word, answer = call.children[1].word;
    int number = 0, answered = 0;
    std::size_t at = 0, in_answer = 0;
    const bool part = read_literal(command, at, "set global.rpart=");
    if (!part && !read_literal(command, at, "set global.rc=")) return;
    const bool good = read_integer(command, at, number) && read_literal(answer, in_answer, part ? "part " : "rc ") &&
                      read_integer(answer, in_answer, answered) && number == answered;
    expect(good, Rule::barriers, "the answer does not belong to the command");
    add_event({RobotEvent::Kind::exchange, place_.line, part ? -number : number, true, static_cast<float>(call.children[2].value)});
  }

  void tool_frame(const Expression& call) {
    expect(++tool_frames_ == 1 && part_.moves.empty(), Rule::tool_frame, "set_tcp once, before the first move");
    double values[6];
    if (call.children.size() != 1 || !six_numbers(call.children[0], values)) return fail(Rule::tool_frame, "set_tcp without a pose");
    for (int i = 0; i < 3; ++i) {
      part_.tcp.position_m[i] = values[i];
      part_.tcp.rotation_vector[i] = values[3 + i];
    }
    expect(part_.tcp.position_m.cwiseAbs().maxCoeff() < 0.6, Rule::units, "a tool centre point beyond 0.6 m of the flange");
    const double apart = (part_.tcp.position_m - machine_.tool.tcp.position_m).norm() +
                         (part_.tcp.rotation_vector - machine_.tool.tcp.rotation_vector).norm();
    expect(apart < 5e-6, Rule::tool_frame, "the tool frame is not the one of the machine");
  }

  void payload(const Expression& call) {
    expect(++payloads_ == 1 && part_.moves.empty(), Rule::tool_frame, "set_payload once, before the first move");
    const double mass = number_of(call, 0, "m", -1.0);
    expect(mass >= 0.0 && mass <= machine_.arm.max_payload_kg, Rule::tool_frame, "the payload is beyond what the arm carries");
    expect(std::abs(mass - machine_.tool.payload_kg) < 1e-3, Rule::tool_frame, "the payload is not the one of the machine");
  }

  void move(const Expression& call, RobotMove::Kind kind, std::string_view target_name) {
    RobotMove move;
    move.kind = kind;
    move.marked = marked_ && kind == RobotMove::Kind::process;
    const Expression* target = argument(call, 0, target_name);
    const Expression* seed = nullptr;
    if (target && target->word == "get_inverse_kin" && target->kind == Expression::Kind::call) {
      seed = argument(*target, 1, "qnear");
      target = argument(*target, 0, "x");
      if (!seed || kind != RobotMove::Kind::joint) return fail(Rule::part_start, "inverse kinematics without a seed");
    }
    double values[6], seeds[6];
    const bool pose = target && target->kind == Expression::Kind::pose;
    const bool joints = target && target->kind == Expression::Kind::list;
    const bool fits = target && six_numbers(*target, values) && (kind == RobotMove::Kind::joint ? joints || seed : pose);
    if (!fits) return fail(Rule::pose_numbers, "a move whose target cannot be read");
    if (seed && !six_numbers(*seed, seeds)) return fail(Rule::part_start, "inverse kinematics without six seeds");
    if (pose) {
      move.has_pose = true;
      take_pose(values, move);
    }
    const bool process = kind == RobotMove::Kind::process;
    move.a = static_cast<float>(number_of(call, 1, "a", -1.0));
    move.v = static_cast<float>(number_of(call, 2, "v", -1.0));
    move.r = static_cast<float>(number_of(call, process ? 3 : 4, "r", process ? -1.0 : 0.0));
    expect(!argument(call, 9, "t"), Rule::calls, "a move by time");
    add_move(move, seed ? seeds : joints ? values : nullptr);
  }

  // `joints`: six, of joint moves only.
  void add_move(RobotMove move, const double* joints) {
    move.line = place_.line;
    const bool joint = move.kind == RobotMove::Kind::joint;
    const float top_v = joint ? 3.2f : 0.5f, top_a = joint ? 40.0f : 3.0f;
    expect(move.v > 0.0f && move.v <= top_v, Rule::units, "speed out of range");
    expect(move.a > 0.0f && move.a <= top_a, Rule::units, "acceleration out of range");
    expect(move.r >= 0.0f && move.r < 0.05f, Rule::units, "blend radius out of range");
    expect(tool_frames_ == 1 && payloads_ == 1, Rule::tool_frame, "a move before set_tcp and set_payload");
    if (part_.moves.empty()) expect(joint, Rule::part_start, "the first move of a part is not a movej to joints");
    add_event({RobotEvent::Kind::move, place_.line, static_cast<int>(part_.moves.size()), false, 0.0f});
    part_.moves.push_back(move);
    if (joint) std::copy(joints, joints + 6, part_.joints.emplace_back().begin());
  }

  void add_event(const RobotEvent& event) { part_.events.push_back(event); }

  void finish() {
    expect(closed_, Rule::frame, "the program has no end");
    expect(called_ == (machine_.program.form == ScriptForm::file), Rule::frame, "the call behind the program and its form do not agree");
    expect(open_.empty(), Rule::blocks, "a block without end");
    const ProgramLimits& limits = machine_.program;
    expect(static_cast<long>(part_.text.size()) <= limits.max_bytes_per_part, Rule::part_caps, "more bytes than a part may have");
    expect(static_cast<int>(part_.moves.size()) <= limits.max_moves_per_part, Rule::part_caps, "more moves than a part may have");
    expect(tool_frames_ == 1 && payloads_ == 1, Rule::tool_frame, "tool frame and payload once in each part");
    expect(finished_ && sender_.empty(), Rule::part_end, "no message at the end, or a thread that still runs");
    expect(run_state_ == 0, Rule::part_end, "the run state output is left as it is, so that the job would pause between parts");
    check_ending();
    (void)parts_;
  }

  // Nozzle lifted, outputs at 0.
  void check_ending() {
    bool lifted = false;
    bool levels[8] = {};
    bool last_set[8] = {};
    for (const RobotEvent& event : part_.events) {
      if (event.kind == RobotEvent::Kind::move) {
        lifted = part_.moves[static_cast<std::size_t>(event.number)].kind != RobotMove::Kind::process;
        for (bool& set : last_set) set = false;
      }
      if (event.kind == RobotEvent::Kind::output) {
        levels[event.number] = event.level;
        last_set[event.number] = true;
      }
    }
    expect(lifted, Rule::part_end, "the part ends on the bead");
    for (const bool level : levels) expect(!level, Rule::part_end, "an output is left at 1");
    expect(last_set[machine_.link.robot_start_output] && last_set[machine_.link.robot_gate_output], Rule::part_end,
           "the outputs are not reset at the end");
  }

  RobotPart& part_;
  int parts_;
  const Machine& machine_;
  Place place_{part_.file, 0};
  std::string_view name_, sender_;
  std::vector<Open> open_;
  int functions_open_ = 0;
  int tool_frames_ = 0, payloads_ = 0;
  int run_state_ = -1;
  bool closed_ = false, called_ = false, marked_ = false, finished_ = false;
};

}  // namespace

void read_script(RobotPart& part, int parts, const Machine& machine) { ScriptReader(part, parts, machine).read(); }

}  // namespace curvesup::emitted
