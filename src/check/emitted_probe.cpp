#include <cmath>
#include <map>
#include <numbers>

#include "check/emitted_script.h"

// A small interpreter of the functions that a program defines, in a world in which an answer comes, or does not.
namespace curvesup::emitted {

namespace {

constexpr int kMaxSteps = 200000, kMaxDepth = 20;

// A number, a truth value or a text.
struct Value {
  double number = 0.0;
  std::string text;
  bool is_text = false;

  [[nodiscard]] bool truth() const { return is_text ? !text.empty() : number != 0.0; }
  bool operator==(const Value& other) const { return is_text == other.is_text && number == other.number && text == other.text; }
};

Value of(double number) { return {number, {}, false}; }
Value of(std::string_view text) { return {0.0, std::string(text), true}; }

// What a run saw and did.
struct World {
  double answer_at_s = 0.0;     // the answer is there from this time on; infinite: never
  bool level = false;           // of the acknowledge input from then on, the opposite before
  std::string answer;           // on a socket
  int input = 0;

  double time_s = 0.0;
  std::map<int, bool> outputs;
  bool warned = false, halted = false, lifted = false, gave_up = false;
};

class Interpreter {
 public:
  Interpreter(const std::vector<Statement>& functions, World& world) : functions_(functions), world_(world) {}

  Value call(std::string_view name, const std::vector<Value>& arguments) {
    if (++depth_ > kMaxDepth) world_.gave_up = true;
    if (over()) return {};
    for (const Statement& function : functions_) {
      if (function.name != name || function.kind != Statement::Kind::function) continue;
      std::map<std::string_view, Value> local;
      for (std::size_t i = 0; i < function.parameters.size() && i < arguments.size(); ++i) local[function.parameters[i]] = arguments[i];
      std::swap(local, variables_);
      run(function.body);
      std::swap(local, variables_);
      left_ = false;
      --depth_;
      return {};
    }
    world_.gave_up = true;
    return {};
  }

 private:
  [[nodiscard]] bool over() const { return world_.halted || world_.gave_up || left_; }

  void run(const std::vector<Statement>& body) {
    for (const Statement& statement : body) {
      if (over() || broken_) return;
      step(statement);
    }
  }

  void step(const Statement& statement) {
    if (++steps_ > kMaxSteps) world_.gave_up = true;
    switch (statement.kind) {
      case Statement::Kind::call: evaluate(statement.expression); break;
      case Statement::Kind::assign: variables_[statement.name] = evaluate(statement.expression); break;
      case Statement::Kind::branch: run(evaluate(statement.expression).truth() ? statement.body : statement.otherwise); break;
      case Statement::Kind::loop:
        while (!over() && !broken_ && evaluate(statement.expression).truth()) {
          if (++steps_ > kMaxSteps) world_.gave_up = true;
          run(statement.body);
        }
        broken_ = false;
        break;
      case Statement::Kind::leave:
        if (statement.name == "halt") world_.halted = true;
        if (statement.name == "return") left_ = true;
        if (statement.name == "break") broken_ = true;
        break;
      default: break;
    }
  }

  Value evaluate(const Expression& expression) {
    switch (expression.kind) {
      case Expression::Kind::number:
      case Expression::Kind::boolean: return of(expression.value);
      case Expression::Kind::text: return of(expression.word);
      case Expression::Kind::name: return variables_[expression.word];
      case Expression::Kind::named: return evaluate(expression.children[0]);
      case Expression::Kind::prefix: return of(!evaluate(expression.children[0]).truth());
      case Expression::Kind::infix: return infix(expression);
      case Expression::Kind::call: return builtin(expression);
      // A pose counts by its way along the tool's axis.
      case Expression::Kind::pose: return expression.children.size() == 6 ? evaluate(expression.children[2]) : Value{};
      default: return {};
    }
  }

  Value infix(const Expression& expression) {
    const Value a = evaluate(expression.children[0]), b = evaluate(expression.children[1]);
    const std::string_view op = expression.word;
    if (op == "==") return of(a == b);
    if (op == "!=") return of(!(a == b));
    if (op == "<") return of(a.number < b.number);
    if (op == ">") return of(a.number > b.number);
    if (op == "<=") return of(a.number <= b.number);
    if (op == ">=") return of(a.number >= b.number);
    if (op == "+") return of(a.number + b.number);
    if (op == "-") return of(a.number - b.number);
    if (op == "*") return of(a.number * b.number);
    if (op == "and") return of(a.truth() && b.truth());
    if (op == "or") return of(a.truth() || b.truth());
    world_.gave_up = true;
    return {};
  }

  Value builtin(const Expression& call_text) {
    std::vector<Value> arguments;
    for (const Expression& child : call_text.children) arguments.push_back(evaluate(child));
    arguments.resize(std::max<std::size_t>(arguments.size(), 5));
    const std::string_view name = call_text.word;
    const bool answered = world_.time_s >= world_.answer_at_s;
    if (name == "get_standard_digital_in") {
      return of(static_cast<int>(arguments[0].number) == world_.input && answered ? world_.level : !world_.level);
    }
    if (name == "sleep") world_.time_s += arguments[0].number;
    if (name == "sync") world_.time_s += 0.002;
    if (name == "socket_read_string") {
      world_.time_s += answered ? 0.002 : std::max(0.002, arguments[4].number);
      return of(std::string_view(answered ? world_.answer : std::string()));
    }
    if (name == "set_standard_digital_out") world_.outputs[static_cast<int>(arguments[0].number)] = arguments[1].truth();
    if (name == "get_inverse_kin_has_solution") return of(1.0);
    if (name == "pose_trans") return of(arguments[1].number);
    if (name == "movel") world_.lifted = arguments[0].number > 0.001;
    if (name == "popup") world_.warned = true;
    for (const Statement& function : functions_) {
      if (function.name == name) return call(name, arguments);
    }
    return {};
  }

  const std::vector<Statement>& functions_;
  World& world_;
  std::map<std::string_view, Value> variables_;
  bool left_ = false, broken_ = false;
  int steps_ = 0, depth_ = 0;
};

class Probe {
 public:
  Probe(RobotPart& part, const Machine& machine) : part_(part), link_(machine.link) {}

  void run() {
    if (link_.kind == DuetLink::dio) {
      for (const bool level : {false, true}) {
        probe("wait_acknowledge", {of(level ? 1.0 : 0.0), of(1.0)}, level, {}, 0.1, 1.0);
      }
    } else {
      probe("exchange", {of(std::string_view("ask")), of(std::string_view("rc 7")), of(5.0)}, false, "rc 7", 2.0, 5.0);
    }
  }

 private:
  void probe(std::string_view name, const std::vector<Value>& arguments, bool level, const std::string& answer, double answer_s, double timeout_s) {
    World answered = world(level, answer, answer_s);
    Interpreter(part_.functions, answered).call(name, arguments);
    const bool returns = !answered.halted && !answered.gave_up && answered.time_s >= answer_s && answered.time_s <= answer_s + 1.1;
    expect(returns, "a wait does not end with its answer");
    World silent = world(level, answer, 1e9);
    Interpreter(part_.functions, silent).call(name, arguments);
    const bool in_time = silent.halted && !silent.gave_up && silent.time_s >= 0.9 * timeout_s && silent.time_s <= 1.2 * timeout_s + 1.1;
    expect(in_time, "a wait without answer does not halt at its timeout");
    expect(silent.warned && silent.lifted, "a wait without answer halts without lifting and warning");
    for (const int output : {link_.robot_start_output, link_.robot_gate_output}) {
      expect(silent.outputs.contains(output) && !silent.outputs[output], "a wait without answer leaves an output on");
    }
  }

  [[nodiscard]] World world(bool level, const std::string& answer, double answer_s) const {
    World world;
    world.answer_at_s = answer_s;
    world.level = level;
    world.answer = answer;
    world.input = link_.robot_acknowledge_input;
    return world;
  }

  void expect(bool ok, std::string_view what) { part_.findings.expect(ok, Rule::timeouts, {part_.file, 0}, what); }

  RobotPart& part_;
  const Link& link_;
};

}  // namespace

void probe_waits(RobotPart& part, const Machine& machine) { Probe(part, machine).run(); }

}  // namespace curvesup::emitted
