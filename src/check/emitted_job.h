#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "check/emitted_findings.h"
#include "check/emitted_packed.h"
#include "curvesup/motion/machine.h"

// The job of the extruder board, read from its text.
namespace curvesup::emitted {

struct JobMove {
  PackedVec<4> tip_mm;
  float e_mm = 0.0f, feed_mm_s = 0.0f;
  bool has_xyz = false, has_e = false, rapid = false;
  std::int8_t tool = -1;
  int line = 0;
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
  std::string type;
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
  std::string sha256;
  std::uint64_t bytes = 0;
  std::vector<JobEvent> events;
  std::vector<JobMove> moves;
  std::vector<JobPath> paths;
  std::vector<std::uint64_t> part_offsets;  // of the lines ";PART:n"
  std::vector<int> part_numbers;
  JobHeader header;
  Findings findings;
  Vec3 start_mm = Vec3::Zero();  // where the first move begins

  [[nodiscard]] Vec3 from_mm(std::size_t move) const { return move == 0 ? start_mm : moves[move - 1].tip_mm.vec(); }
  [[nodiscard]] double length_mm(std::size_t move) const { return (moves[move].tip_mm.vec() - from_mm(move)).norm(); }
};

// Reads job.file below `folder`. Rules 25 to 29, 31 in part, 32 in part, 33, 39.
void read_job(Job& job, const std::filesystem::path& folder, const Machine& machine);

// The board's settings and macros: rules 25 and 26.
void read_settings(std::string_view file, std::string_view text, Findings& findings);

}  // namespace curvesup::emitted
