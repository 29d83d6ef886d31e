#include "curvesup/core/error.h"

namespace curvesup {

std::string_view name(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return "usage";
    case ErrorKind::input: return "input";
    case ErrorKind::geometry: return "geometry";
    case ErrorKind::solver: return "solver";
    case ErrorKind::robot: return "robot";
    case ErrorKind::output: return "output";
    case ErrorKind::internal: return "internal";
    case ErrorKind::interrupted: return "interrupted";
  }
  return "internal";
}

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return 2;
    case ErrorKind::input: return 3;
    case ErrorKind::geometry: return 4;
    case ErrorKind::solver: return 5;
    case ErrorKind::robot: return 6;
    case ErrorKind::output: return 7;
    case ErrorKind::internal: return 70;
    case ErrorKind::interrupted: return 130;
  }
  return 70;
}

namespace {
std::string one_line(ErrorKind kind, const std::string& where, const std::string& what, const std::string& remedy) {
  std::string line = "[" + std::string(name(kind)) + "] " + where + ": " + what;
  if (!remedy.empty()) line += " (" + remedy + ")";
  return line;
}
}  // namespace

Error::Error(ErrorKind kind, std::string where, std::string what, std::string remedy)
    : std::runtime_error(one_line(kind, where, what, remedy)),
      kind_(kind),
      where_(std::move(where)),
      problem_(std::move(what)),
      remedy_(std::move(remedy)) {}

}  // namespace curvesup
