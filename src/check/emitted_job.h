#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "check/emitted_findings.h"
#include "curvesup/motion/machine.h"

// The job of the extruder board, read from its text.
namespace curvesup::emitted {

struct JobMove {
  Vec3 from_mm = Vec3::Zero(), tip_mm = Vec3::Zero();
  double e_mm = 0.0;
  double feed_mm_s = 0.0;
  bool has_xyz = false, has_e = false, rapid = false;
  int tool = -1;
  int line = 0;

  [[nodiscard]] double length_mm() const { return (tip_mm - from_mm).norm(); }
};

struct JobEvent {
  enum class Kind : std::uint8_t {
    move,         // number: row of `moves`
    stop,         // M400
    wait_input,   // M577, number: input
    output,       // M42
    wait_signal,  // while global.rc < number; level: with G4, so at standstill; number < 0: part -number
    answer,       // M118 of a signal; negative: part
    tool,         // T
    heat_wait,    // M116
    part,         // comments
    change,
    path,         // number: row of `paths`
    end,
    other
  };
  Kind kind = Kind::other;
  bool level = false;
  int number = 0;
  int line = 0;
};

struct JobPath {
  int path = -1, section = 0, sections = 0, group = -1, layer = -1;
  std::string_view type;
  int line = 0;
};

struct JobHeader {
  double layer_height_mm = -1.0;
  std::vector<double> filament_mm;
  long time_s = -1, end_time_s = -1;
  long written_time_s = -1;  // of "1h 2m 3s"
  int layers = -1;
};

struct Job {
  std::string file = "duet/print.g";
  std::string text;
  std::vector<JobEvent> events;
  std::vector<JobMove> moves;
  std::vector<JobPath> paths;
  std::vector<std::size_t> part_offsets;  // of the lines ";PART:n"
  std::vector<int> part_numbers;
  JobHeader header;
  Findings findings;
};

// Reads job.text. Rules 25 to 29, 31 in part, 32 in part, 33, 39.
void read_job(Job& job, const Machine& machine);

// The board's settings and macros: rules 25 and 26.
void read_settings(std::string_view file, std::string_view text, Findings& findings);

}  // namespace curvesup::emitted
