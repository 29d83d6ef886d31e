#pragma once

#include <functional>
#include <stop_token>
#include <string_view>

namespace curvesup {

enum class LogLevel { debug, info, warning, error };

// What a stage may use of the program around it. Passed in, never global; a default one is silent and single-threaded.
struct RunContext {
  int threads = 1;
  std::stop_token stop;
  std::function<void(LogLevel, std::string_view)> log_sink;
  std::function<void(double fraction)> progress_sink;  // of the running stage, 0..1

  void log(LogLevel level, std::string_view message) const {
    if (log_sink) log_sink(level, message);
  }
  void progress(double fraction) const {
    if (progress_sink) progress_sink(fraction);
  }
  // Throws Error{interrupted} when a stop was asked for. Call it in loops that can take longer than a tenth of a second.
  void check_stop() const;
};

}  // namespace curvesup
