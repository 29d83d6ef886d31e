#pragma once

#include <vector>

#include "check/emitted_arm.h"
#include "check/emitted_job.h"
#include "check/emitted_script.h"

// Both programs together: their meeting points, and both run against each other on one clock.
namespace curvesup::emitted {

// A gate lies before move `move` of its chain.
struct Gate {
  int move = 0;
  int number = 0;  // level, or signal
  int line = 0;
};

enum class PairKind { part, path, change, unload };

// The arm stands before move `move` of its chain.
struct Rest {
  int move = 0;
  double seconds = 0.0;
};

// One barrier pair of one program. The moves of a chain follow each other.
struct BarrierPair {
  PairKind kind = PairKind::part;
  std::size_t part = 0;
  std::size_t first_move = 0, moves = 0;  // rows of RobotPart::moves or Job::moves
  std::vector<Gate> gates;
  std::vector<int> stops;                 // of the job: M400 before these moves of the chain
  std::vector<Rest> rests;                // of the script: between the moves of the chain
  int comment = -1;                       // row of `paths`
  int line = 0;
};

// A chain as both programs hold it.
struct Chain {
  std::size_t part = 0;
  std::size_t robot_first = 0, job_first = 0, moves = 0;
  int path = -1, section = 0, sections = 0;
  int robot_comment = -1, job_comment = -1;
  std::vector<float> robot_s, job_s;       // of each move, by the time model; gone when the clock has run
};

struct Programs {
  std::vector<RobotPart> parts;
  Job job;
  std::vector<Chain> chains;
  std::vector<double> part_s;  // simulated
};

// Rules 34 to 38, sync_overrun; fills chains, and drops what only the clocks read.
void check_sync(Programs& programs, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures);

// Runs both programs against each other on one clock, on time and with a slow board: sync_deadlock, total time; fills part_s.
void run_clocks(Programs& programs, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures);

// The largest bead of a path.
struct PathBead {
  double height_mm = 0.0;  // twice the tip offset
  double width_mm = 0.0;
};

// toolpaths.vtp: where the nozzle's tip passes.
struct SourcePaths {
  std::vector<Vec3> tips;
  std::vector<Eigen::Vector3f> normals;
  std::vector<float> volume_mm3;
  std::vector<int> first;  // of each path; one more at the end
  std::vector<int> layer, group, material, kind;
  std::vector<PathBead> beads;

  [[nodiscard]] std::size_t count() const { return layer.size(); }
  // Weighed between two points.
  [[nodiscard]] Vec3 normal(std::size_t segment, double share) const {
    return (1.0 - share) * normals[segment - 1].cast<double>() + share * normals[segment].cast<double>();
  }
};

[[nodiscard]] SourcePaths read_source(const std::filesystem::path& toolpaths_file);

// Rules 15, 19, 20, 30, 32 against toolpaths.vtp.
void check_paths(const Programs& programs, SourcePaths source, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures);

// Rule 21: head and arm at poses along chains and travels, against platform and what is laid by then.
void check_clearance(const Programs& programs, const std::vector<PathBead>& beads, const Machine& machine, const RunContext& run, Findings& findings);

// manifest_* and rule 40.
void check_manifest(const Programs& programs, const std::filesystem::path& folder, Findings& findings);

}  // namespace curvesup::emitted
