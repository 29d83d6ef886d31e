#pragma once

#include <string>
#include <string_view>

#include "curvesup/core/run_context.h"

namespace curvesup::cli {

enum class ProgressMode { automatic, json, none };

// Everything that goes to stderr: the log, and progress as a live bar on a terminal, as "NN% stage" lines elsewhere, or as
// one JSON object a line.
class Terminal {
 public:
  explicit Terminal(ProgressMode mode);
  void log(LogLevel level, std::string_view message);
  void progress(double fraction, std::string_view stage);
  void finish();

 private:
  void clear_bar();
  ProgressMode mode_;
  bool live_ = false;
  bool bar_shown_ = false;
  int last_percent_ = -1;
  std::string last_stage_;
};

}  // namespace curvesup::cli
