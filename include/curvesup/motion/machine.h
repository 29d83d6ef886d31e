#pragma once

#include <array>
#include <numbers>
#include <string>

#include "curvesup/core/angle.h"
#include "curvesup/core/types.h"

namespace curvesup {

// Six joint angles in radians, base to wrist.
using Joints = std::array<double, 6>;

// A frame in another one: metres, and a rotation vector (axis times angle) in radians.
struct Pose {
  Vec3 position_m = Vec3::Zero();
  Vec3 rotation_vector = Vec3::Zero();
};

// Where the platform stands and how large it is. The platform frame (millimetres, z up, z = 0 on the platform) is the
// frame of the toolpaths; `pose` is that frame in the robot's base frame.
struct Platform {
  Pose pose{Vec3(0.50, 0.0, -0.05), Vec3::Zero()};
  double radius_mm = 140.0;
  double table_clearance_mm =
      0.0;  // height above the platform plane that head and arm must keep, inside and outside the radius
};

// One row of the standard (distal) Denavit-Hartenberg table of an arm of the UR family.
struct DhRow {
  double a_m = 0.0, d_m = 0.0, alpha_rad = 0.0;
};

// A link's body for collision: the capsule of this radius around the bone between two joint frames.
struct ArmBody {
  double forearm_radius_mm = 60.0;  // elbow to wrist 1
  double wrist_radius_mm = 48.0;    // wrist 1 to flange
};

struct Arm {
  std::string model = "UR5e";
  std::array<DhRow, 6> dh = {{{0.0, 0.1625, std::numbers::pi / 2},
                              {-0.425, 0.0, 0.0},
                              {-0.3922, 0.0, 0.0},
                              {0.0, 0.1333, std::numbers::pi / 2},
                              {0.0, 0.0997, -std::numbers::pi / 2},
                              {0.0, 0.0996, 0.0}}};
  Joints joint_min_deg = {-360, -360, -180, -360, -360, -360};
  Joints joint_max_deg = {360, 360, 180, 360, 360, 360};
  double joint_margin_deg = 5.0;
  Joints max_joint_speed_deg_s = {180, 180, 180, 180, 180, 180};
  double joint_speed_fraction = 0.5;    // of the maximum that printing may use
  double min_singularity_metric = 0.1;  // min(|sin q5|, |sin q3|, (hypot(wrist xy) - d4) / d4)
  double max_joint_step_rad = 0.2;      // per printed segment
  double max_reach_m = 1.3;             // no coordinate of a pose may exceed it: catches millimetres for metres
  double max_payload_kg = 5.0;
  ArmBody body;
};

// The tool: TCP frame in the flange frame, its Z along the print direction, that is away from the part; the nozzle
// points along -Z. Default: nozzle axis at 45 degrees to the flange axis.
struct Tool {
  Pose tcp{Vec3(0.060, 0.0, 0.120), Vec3(0.0, -0.75 * std::numbers::pi, 0.0)};
  double payload_kg = 1.2;
  Vec3 centre_of_gravity_m = Vec3(0.0, 0.0, 0.06);
  Angle cone_half_angle = Angle::degrees(30);  // the nozzle: a cone with its apex region at the tip
  double cone_length_mm = 60.0;
  double tip_radius_mm = 0.6;     // of the flat face around the orifice
  double head_radius_mm = 40.0;   // a cylinder around the nozzle axis from the cone's end ...
  double head_length_mm = 250.0;  // ... to this distance from the tip
};

// Joint poses outside the print volume.
struct Stations {
  Joints home_deg = {152, -98, 101, 46, 71, -110};   // above and behind the platform
  Joints purge_deg = {109, -71, 103, 22, 61, -123};  // beside it, nozzle upright
};

struct Speeds {
  double print_acceleration_m_s2 = 0.5;
  double travel_mm_s = 60.0;    // off the part
  double approach_mm_s = 20.0;  // last stretch down to the part and first stretch up from it
  double travel_acceleration_m_s2 = 0.8;
  double max_programmed_mm_s = 250.0;  // of any move, rotation-limited ones included
  double joint_speed_deg_s = 40.0;     // movej
  double joint_acceleration_deg_s2 = 60.0;
  double rotation_rad_per_m = 4.0;  // the controller turns at most this much per metre of programmed travel
};

// How the planned path may differ from the toolpath, and what programs look like.
struct Tolerances {
  double chord_mm = 0.03;          // tip of the emitted polyline against that of the toolpath
  Angle axis = Angle::degrees(1);  // nozzle axis against its linear interpolation
  double corner_mm = 0.05;         // cut by a blend
  double bead_mm3 = 0.05;          // volume laid up to a waypoint against even laying between waypoints
  double min_segment_mm = 0.05;    // nearer points are one
  double min_blend_mm = 0.1;       // a smaller radius becomes 0: both machines stop
  double blend_fraction = 0.4;     // of the shorter neighbouring segment
  Angle max_blend_turn = Angle::degrees(150);
  Angle max_tilt_deviation = Angle::degrees(30);  // nozzle axis against layer normal
  double max_tilt_rate_deg_mm = 8.0;              // of the nozzle axis along the path, where the deviation allows it
  double max_yaw_rate_deg_mm = 6.0;               // about the nozzle axis
  double clearance_mm = 0.2;                      // between head and what is printed; the nozzle's own bead excepted
  double max_raise_mm = 0.2;                      // of the nozzle off its path, where no tilt and no order keeps the head off
  double travel_clearance_mm = 5.0;               // above everything printed so far
};

enum class DuetLink { dio, telnet, stream };
enum class ScriptForm { file, port };  // with or without the trailing call

// Wiring and protocol between arm and extruder board.
struct Link {
  DuetLink kind = DuetLink::dio;
  std::string duet_ip = "192.168.4.2";
  int telnet_port = 23;
  int robot_start_output = 0;       // DO0: level 1 at the start barrier, 0 at the end barrier
  int robot_run_output = 1;         // DO1: high while the program runs
  int robot_gate_output = 2;        // DO2: gates inside a path
  int robot_acknowledge_input = 0;  // DI0
  int duet_barrier_input = 0;       // GpIn numbers of the Duet (M577 P)
  int duet_run_input = 1;
  int duet_gate_input = 2;
  int duet_acknowledge_output = 0;  // GpOut number of the Duet (M42 P)
  std::string duet_barrier_pin = "io1.in", duet_run_pin = "io2.in", duet_gate_pin = "io3.in",
              duet_acknowledge_pin = "out5";
  double timeout_s = 5.0;
  double tool_change_timeout_s = 120.0;
  double heating_timeout_s = 600.0;
  double duet_lead_s = 0.0;  // the robot waits this long after an acknowledge
  double gate_interval_s = 1.0;
  int gate_moves = 18;
};

// One filament. Index 0 of Machine::filaments prints the model, index 1 the support.
struct Filament {
  std::string name = "PLA";
  int tool = 0;
  double temperature_c = 205.0;
  double min_temperature_c = 170.0;  // cold extrusion limit
  double flow = 1.0;                 // E over bead volume divided by filament area
  double retract_mm = 0.8;
  double retract_mm_s = 25.0;
  double load_mm = 20.0;    // from the Y-junction to the nozzle
  double unload_mm = 20.0;  // back to the Y-junction
  double load_mm_s = 1.0;
  double purge_mm = 6.0;
  double fan = 0.5;  // 0..1
  double pressure_advance_s = 0.05;
  double max_flow_mm3_s = 12.0;
};

struct Extruder {
  double filament_diameter_mm = 1.75;
  double max_e_mm_s = 60.0;
  double e_acceleration_mm_s2 = 500.0;
  double e_jerk_mm_s = 5.0;
  int heater = 1;
  int fan = 0;
  int driver = 0;
};

struct ProgramLimits {
  int max_moves_per_part = 2000;
  long max_bytes_per_part = 900000;
  ScriptForm form = ScriptForm::file;
};

enum class Placement { as_modelled, automatic };

// A cell: arm, tool, platform, extruder board, filaments. Nothing of a machine is a constant elsewhere.
struct Machine {
  std::string name = "ur5e_duet";
  Placement place = Placement::as_modelled;
  Platform platform;
  Arm arm;
  Tool tool;
  Stations stations;
  Speeds speeds;
  Tolerances tolerances;
  Link link;
  Extruder extruder;
  std::array<Filament, kMaterialCount> filaments = {
      Filament{}, Filament{.name = "PVA", .tool = 1, .temperature_c = 215.0, .min_temperature_c = 180.0}};
  ProgramLimits program;
};

}  // namespace curvesup
