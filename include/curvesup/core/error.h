#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace curvesup {

// What went wrong, in the terms of the exit codes: the command line maps each kind to one documented code.
enum class ErrorKind {
  usage,        // 2: command line or config
  input,        // 3: input file or mesh
  geometry,     // 4: geometry or meshing
  solver,       // 5: linear solver
  robot,        // 6: unreachable pose or collision
  output,       // 7: a file could not be written
  internal,     // 70: a bug in the program
  interrupted,  // 130
};

[[nodiscard]] std::string_view name(ErrorKind kind);
[[nodiscard]] int exit_code(ErrorKind kind);

// The one exception type of the library.
//   where   file with line, stage with element id: the place
//   what    what is wrong there
//   remedy  what the user can do about it; may be empty
// what() is "[kind] where: what (remedy)".
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, std::string where, std::string what, std::string remedy = {});

  [[nodiscard]] ErrorKind kind() const { return kind_; }
  [[nodiscard]] const std::string& where() const { return where_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] const std::string& remedy() const { return remedy_; }

 private:
  ErrorKind kind_;
  std::string where_, problem_, remedy_;
};

}  // namespace curvesup
