#include "terminal.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>

namespace curvesup::cli {

namespace {
spdlog::level::level_enum spdlog_level(LogLevel level) {
  switch (level) {
    case LogLevel::debug: return spdlog::level::debug;
    case LogLevel::info: return spdlog::level::info;
    case LogLevel::warning: return spdlog::level::warn;
    case LogLevel::error: return spdlog::level::err;
  }
  return spdlog::level::info;
}

spdlog::logger& logger() {
  static const auto instance = [] {
    auto made = std::make_shared<spdlog::logger>("curvesup", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made->set_pattern("curvesup: %l: %v");
    made->set_level(spdlog::level::info);
    return made;
  }();
  return *instance;
}
}  // namespace

Terminal::Terminal(ProgressMode mode) : mode_(mode), live_(mode == ProgressMode::automatic && isatty(STDERR_FILENO) == 1) {}

void Terminal::clear_bar() {
  if (bar_shown_) std::fputs("\r\033[K", stderr);
  bar_shown_ = false;
}

void Terminal::log(LogLevel level, std::string_view message) {
  clear_bar();
  logger().log(spdlog_level(level), "{}", message);
}

void Terminal::progress(double fraction, std::string_view stage) {
  if (mode_ == ProgressMode::none) return;
  const int percent = static_cast<int>(100.0 * fraction);
  if (percent == last_percent_ && stage == last_stage_) return;
  const bool new_stage = stage != last_stage_;
  last_percent_ = percent;
  last_stage_ = stage;
  if (mode_ == ProgressMode::json) {
    std::fprintf(stderr, "{\"percent\": %d, \"stage\": \"%.*s\"}\n", percent, static_cast<int>(stage.size()), stage.data());
  } else if (live_) {
    std::string bar(static_cast<std::size_t>(percent) * 30 / 100, '=');
    bar.resize(30, ' ');
    std::fprintf(stderr, "\r\033[K[%s] %3d%% %.*s", bar.c_str(), percent, static_cast<int>(stage.size()), stage.data());
    std::fflush(stderr);
    bar_shown_ = true;
  } else if (new_stage) {
    std::fprintf(stderr, "%d%% %.*s\n", percent, static_cast<int>(stage.size()), stage.data());
  }
}

void Terminal::finish() { clear_bar(); }

}  // namespace curvesup::cli
