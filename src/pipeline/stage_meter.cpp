#include "stage_meter.h"

#include <sys/resource.h>
#include <time.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

namespace curvesup {

namespace {

double seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The kernel keeps one high-water mark for the process; writing 5 to clear_refs starts it anew.
void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    long kilobytes = 0;
    if (std::sscanf(line.c_str(), "VmHWM: %ld kB", &kilobytes) == 1) return static_cast<double>(kilobytes) / 1024.0;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace

StageMeter::StageMeter() : wall_start_(seconds(CLOCK_MONOTONIC)), cpu_start_(seconds(CLOCK_PROCESS_CPUTIME_ID)) {
  reset_peak_memory();
}

StageTime StageMeter::stop(std::string name) const {
  return {std::move(name), seconds(CLOCK_MONOTONIC) - wall_start_, seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu_start_, peak_memory_mb()};
}

}  // namespace curvesup
