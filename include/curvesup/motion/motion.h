#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/core/run_context.h"
#include "curvesup/motion/machine.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

// A pose that the nozzle tip passes while it prints. volume, speed and duration belong to the segment that ends here;
// the first waypoint of a section has none. Waypoints of a section are at least Tolerances::min_segment_mm apart.
struct Waypoint {
  Vec3 tip_mm = Vec3::Zero();  // nozzle tip, platform frame, part placed (see Motion::part_offset_mm)
  Vec3 axis = Vec3::UnitZ();   // nozzle axis away from the part, platform frame; the TCP's Z
  Pose pose;                   // of the TCP in the base frame; rotation vectors are continuous along a section
  Joints joints{};             // radians; forward kinematics of `joints` is `pose`
  double volume_mm3 = 0.0;
  double speed_mm_s = 0.0;        // to program; above length / duration only when rotation_limited
  double duration_s = 0.0;        // intended: length over the feed
  double blend_mm = 0.0;          // 0: both machines stop here
  bool rotation_limited = false;  // speed_mm_s was raised so that the controller's rotation rule keeps duration_s
  Index point = kNone;            // of Toolpaths::points when the waypoint lies on one, else kNone
};

enum class TravelKind : std::uint8_t { joint, linear };
enum class TravelStep : std::uint8_t { lift, cross, lower, to_purge, purge, from_purge, to_home };

// The waypoints of a print, in 96 bytes each: lengths to a nanometre (up to 2 m), angles and axes to 4e-9, volume,
// speed, duration and blend to seven digits. Elements are values: what is taken out is a copy.
class WaypointList {
 public:
  WaypointList() = default;
  WaypointList(std::initializer_list<Waypoint> waypoints) {
    for (const Waypoint& waypoint : waypoints) push_back(waypoint);
  }
  [[nodiscard]] std::size_t size() const { return packed_.size(); }
  [[nodiscard]] bool empty() const { return packed_.empty(); }
  [[nodiscard]] Waypoint operator[](std::size_t i) const;
  [[nodiscard]] Waypoint back() const { return (*this)[size() - 1]; }
  void set(std::size_t i, const Waypoint& waypoint);
  void push_back(const Waypoint& waypoint);
  void resize(std::size_t count) { packed_.resize(count); }
  void reserve(std::size_t count) { packed_.reserve(count); }

 private:
  struct Packed {
    std::array<std::int32_t, 3> tip{}, position{}, rotation{}, axis{};
    std::array<std::int32_t, 6> joints{};
    float volume = 0.0f, speed = 0.0f, duration = 0.0f, blend = 0.0f;
    Index point = kNone;
    bool rotation_limited = false;
  };
  static Packed pack(const Waypoint& waypoint);
  std::vector<Packed> packed_;
};

// A move without extrusion: movej to `joints` or movel to `pose`; always ends at a stop.
struct Travel {
  TravelKind kind = TravelKind::linear;
  TravelStep step = TravelStep::cross;
  Vec3 tip_mm = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
  Pose pose;
  Joints joints{};
  double speed_mm_s = 0.0;  // linear moves
  double duration_s = 0.0;  // estimate
};

// One chain of printing moves: a whole path, or one section of a path that had to be cut (arm branch, program size).
// Sections of a path follow each other, section s + 1 starts at the tip where section s ended; lay nothing between
// them.
//   travels   first_travel .. first_travel + travel_count - 1 lead from the end of the chain before (or from home) to
//             the first waypoint; the last one ends exactly there. Retract before the first, un-retract after the last.
//   material_change_before  one of the travels has step `purge`: change filament when it has ended. True too for the
//             first path of the print, which loads its filament there.
struct PathMotion {
  Index path = 0;  // of Toolpaths::paths
  int section = 0, sections = 1;
  Material material = Material::model;
  Index layer = 0;
  int group = 0;
  Index first_waypoint = 0, waypoint_count = 0;
  Index first_travel = 0, travel_count = 0;
  bool material_change_before = false;
  double length_mm = 0.0;
  double volume_mm3 = 0.0;
  double duration_s = 0.0;              // sum over the waypoints
  double rotation_rad_per_m = 0.0;      // of the rotation vector, mean over the chain
  double max_tilt_deviation_deg = 0.0;  // nozzle axis against layer normal
};

// Everything that the arm does, in order. After the last chain come the travels final_travel .. end (lift, home).
struct Motion {
  Vec3 part_offset_mm = Vec3::Zero();  // added to every toolpath point: Placement::automatic moves the part in x and y
  double part_rotation_rad = 0.0;      // about z, before the offset
  std::vector<PathMotion> paths;
  WaypointList waypoints;
  std::vector<Travel> travels;
  Index final_travel = 0;
};

struct MotionOptions {
  int yaw_samples = 24;          // about the nozzle axis
  double key_spacing_mm = 4.0;   // at most, between poses at which yaw and arm branch are chosen
  bool avoid_collisions = true;  // tilt the nozzle within the allowed deviation where it would touch something
};

// A waypoint that the arm cannot take, and why: the first one of each path is listed.
struct UnreachableWaypoint {
  Index path = 0;
  Index point = 0;  // of Toolpaths::points
  Vec3 tip_mm = Vec3::Zero();
  Vec3 axis = Vec3::UnitZ();
  std::string reason;
};

// A contact that no allowed tilt removes: the first one of each path is listed.
struct MotionCollision {
  Index path = 0;
  Index point = 0;
  Vec3 tip_mm = Vec3::Zero();
  Vec3 contact_mm = Vec3::Zero();
  double depth_mm = 0.0;
  std::string what;  // e.g. "nozzle cone touches support of path 12"
};

// A toolpath point at which the nozzle passes higher than planned, along the layer normal.
struct RaisedPoint {
  Index point = 0;
  double raise_mm = 0.0;
};

struct MotionReport {
  std::size_t waypoints = 0;
  std::size_t source_points = 0;
  std::size_t chains = 0;
  double travel_mm = 0.0;
  double print_s = 0.0, travel_s = 0.0;
  double max_tilt_deg = 0.0;  // nozzle axis against vertical
  double tilt_deviation_median_deg = 0.0, tilt_deviation_p95_deg = 0.0, tilt_deviation_max_deg = 0.0;
  std::size_t rotation_limited = 0;
  std::size_t stops = 0;  // inside chains
  std::size_t unreachable_waypoints = 0;
  std::size_t colliding_waypoints = 0;
  std::size_t colliding_travels = 0;
  double max_raise_mm = 0.0;
  double min_singularity_metric = 0.0;
  double max_joint_speed_ratio = 0.0;  // of the joint speed limit
  double max_joint_step_rad = 0.0;
  std::vector<UnreachableWaypoint> unreachable;
  std::vector<MotionCollision> collisions;
  std::vector<Check> checks;
};

struct MotionResult {
  Motion motion;
  MotionReport report;
  // Empty, or in which order the paths have to be printed so that the head touches nothing: their indices in the
  // toolpaths that were given. `motion` and `report` count paths and points in this order; see reorder_paths().
  std::vector<Index> path_order;
  // Where the nozzle has to pass higher, in the order of points; see raise_points().
  std::vector<RaisedPoint> raised;
};

// Plans every pose of the arm for printing `toolpaths` in print order.
//   Guarantees  bead volume is conserved exactly per path; every waypoint's joints reproduce its pose to 1e-6; one arm
//               branch per chain; limits of `machine` kept, or the place listed in `unreachable` / `collisions`. Where
//               no allowed tilt keeps the head off what lies beside a path of the same piece, the path is printed before
//               that one: path_order says so. Where that does not help either, the nozzle passes up to max_raise higher.
//   Errors      none for reach or collision: those are data, and the caller decides (exit code 6). When
//               report.unreachable is not empty, motion is not complete and must not be emitted.
//   Cost        linear in the number of toolpath points; deterministic for any thread count.
[[nodiscard]] MotionResult plan_motion(const Toolpaths& toolpaths, const Machine& machine,
                                       const MotionOptions& options = {}, const RunContext& run = {});

// Puts paths and their points into an order that plan_motion() asks for; nothing happens when it is empty.
void reorder_paths(Toolpaths& toolpaths, std::span<const Index> order);

// Raises the tip at the points that plan_motion() lists, by more tip offset; beads keep their place and volume. Comes after
// reorder_paths().
void raise_points(Toolpaths& toolpaths, std::span<const RaisedPoint> raised);

}  // namespace curvesup
