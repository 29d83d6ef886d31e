#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "check/emitted_findings.h"
#include "check/emitted_packed.h"
#include "curvesup/motion/machine.h"

// Robot programs, read from their text.
namespace curvesup::emitted {

struct Expression {
  enum class Kind { none, number, text, name, boolean, list, pose, call, prefix, infix, named };
  Kind kind = Kind::none;
  std::string_view word;  // name, operator, characters of a string
  double value = 0.0;
  bool plain = true;
  int decimals = 0;
  std::vector<Expression> children;
};

struct Statement {
  enum class Kind { call, assign, branch, loop, leave, function, thread };
  Kind kind = Kind::call;
  int line = 0;
  std::string_view name;          // assigned variable, function
  std::vector<std::string_view> parameters;
  Expression expression;
  std::vector<Statement> body, otherwise;
};

struct RobotMove {
  enum class Kind : std::uint8_t { joint, linear, process };
  Kind kind = Kind::process;
  bool has_pose = false, marked = false;
  bool solved = false;    // filled by the arm's check, with `reached`, and the pose where there is none
  int line = 0;
  PackedPose pose;
  PackedJoints reached;
  float a = 0.0f, v = 0.0f, r = 0.0f;
};

struct RobotEvent {
  enum class Kind : std::uint8_t { output, wait, move, sleep, path, barrier, set_gate, exchange };
  Kind kind = Kind::move;
  int line = 0;
  int number = 0;         // output; move; row of `paths`; signal; of a barrier comment: 0 part, 1 path, 2 change, 3 unload
  bool level = false;
  float seconds = 0.0f;   // of a wait or a sleep
};

struct PathComment {
  int path = -1, section = 0, sections = 0, layer = 0, group = 0;
  int material = -1;
  int line = 0;
};

struct RobotPart {
  std::string file;  // "robot/part_0001.script"
  std::string text;  // gone, with the functions, once it is read
  std::string sha256;
  std::size_t bytes = 0;
  int number = 0;
  std::vector<RobotEvent> events;
  std::vector<RobotMove> moves;
  std::vector<Joints> joints;  // of the joint moves in order: targets, or seeds of the inverse kinematics where there is a pose
  std::vector<PathComment> paths;
  std::vector<Statement> functions;
  Pose tcp;
  Findings findings;
};

// Reads part.text; fills all but `reached` and `solved`. Rules 1 to 8, 18 in part, 22 to 24.
void read_script(RobotPart& part, int parts, const Machine& machine);

// Runs the functions that wait, with and without an answer: rule 22.
void probe_waits(RobotPart& part, const Machine& machine);

}  // namespace curvesup::emitted
