#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/motion/kinematics.h"
#include "curvesup/pipeline/config.h"
#include "curvesup/pipeline/machine_config.h"
#include "option_table.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

using Table = OptionTable<Machine>;

void add_cell_rows(Table& table) {
  table.text("name", CURVESUP_FIELD(name), "Name of the profile, as reports and programs show it.");
  table.choice("place", CURVESUP_FIELD(place), {"as_modelled", "auto"},
               "Print the part where the model stands, or where the arm reaches it best (moved in x and y, turned about z).");
  table.numbers("platform.centre_m", 3, 1.0, CURVESUP_ELEMENT(platform.pose.position_m[static_cast<int>(i)]), -3, 3,
                "Platform centre, the origin of the toolpaths, in the robot's base frame.");
  table.numbers("platform.rotation_deg", 3, kDegree, CURVESUP_ELEMENT(platform.pose.rotation_vector[static_cast<int>(i)]), -360, 360,
                "Rotation vector of the platform frame in the robot's base frame.");
  table.number("platform.radius_mm", CURVESUP_FIELD(platform.radius_mm), 1, 2000, "Radius of the round platform.");
  table.number("platform.table_clearance_mm", CURVESUP_FIELD(platform.table_clearance_mm), 0, 100,
               "Height above the platform plane that head and arm keep; the nozzle cone near its tip is excepted.");
}

void add_arm_rows(Table& table) {
  table.text("arm.model", CURVESUP_FIELD(arm.model), "Name of the arm.");
  table.numbers("arm.dh_a_m", 6, 1.0, CURVESUP_ELEMENT(arm.dh[i].a_m), -2, 2, "Denavit-Hartenberg a of the six joints.");
  table.numbers("arm.dh_d_m", 6, 1.0, CURVESUP_ELEMENT(arm.dh[i].d_m), -2, 2, "Denavit-Hartenberg d of the six joints.");
  table.numbers("arm.dh_alpha_deg", 6, kDegree, CURVESUP_ELEMENT(arm.dh[i].alpha_rad), -180, 180,
                "Denavit-Hartenberg alpha of the six joints.");
  table.numbers("arm.joint_min_deg", 6, 1.0, CURVESUP_ELEMENT(arm.joint_min_deg[i]), -720, 720, "Lower joint limits.");
  table.numbers("arm.joint_max_deg", 6, 1.0, CURVESUP_ELEMENT(arm.joint_max_deg[i]), -720, 720, "Upper joint limits.");
  table.number("arm.joint_margin_deg", CURVESUP_FIELD(arm.joint_margin_deg), 0, 90, "Distance kept from the joint limits.");
  table.numbers("arm.max_joint_speed_deg_s", 6, 1.0, CURVESUP_ELEMENT(arm.max_joint_speed_deg_s[i]), 1, 1000, "Joint speed limits.");
  table.number("arm.joint_speed_fraction", CURVESUP_FIELD(arm.joint_speed_fraction), 0.01, 1,
               "Part of the joint speed limit that printing may use; segments that need more are printed slower.");
  table.number("arm.min_singularity_metric", CURVESUP_FIELD(arm.min_singularity_metric), 0, 1,
               "Least of |sin q5|, |sin q3| and (wrist radius - d4) / d4 that a printing pose may have.");
  table.number("arm.max_joint_step_rad", CURVESUP_FIELD(arm.max_joint_step_rad), 0.01, 1, "Most that a joint turns in one printed segment.");
  table.number("arm.max_reach_m", CURVESUP_FIELD(arm.max_reach_m), 0.1, 5, "No coordinate of a pose exceeds this.");
  table.number("arm.max_payload_kg", CURVESUP_FIELD(arm.max_payload_kg), 0.1, 100, "Payload that the arm carries at most.");
  table.number("arm.forearm_radius_mm", CURVESUP_FIELD(arm.body.forearm_radius_mm), 0, 300, "Radius of the forearm as an obstacle.");
  table.number("arm.wrist_radius_mm", CURVESUP_FIELD(arm.body.wrist_radius_mm), 0, 300, "Radius of the wrist links as an obstacle.");
}

void add_tool_rows(Table& table) {
  table.numbers("tool.tcp_mm", 3, 1e-3, CURVESUP_ELEMENT(tool.tcp.position_m[static_cast<int>(i)]), -600, 600,
                "Nozzle tip in the flange frame.");
  table.numbers("tool.tcp_rotation_deg", 3, kDegree, CURVESUP_ELEMENT(tool.tcp.rotation_vector[static_cast<int>(i)]), -360, 360,
                "Rotation vector of the tool frame in the flange frame; its z points away from the part, out of the back of the nozzle.");
  table.number("tool.payload_kg", CURVESUP_FIELD(tool.payload_kg), 0, 100, "Mass of the tool.");
  table.numbers("tool.centre_of_gravity_mm", 3, 1e-3, CURVESUP_ELEMENT(tool.centre_of_gravity_m[static_cast<int>(i)]), -600, 600,
                "Centre of gravity of the tool in the flange frame.");
  table.angle("tool.cone_half_angle_deg", CURVESUP_FIELD(tool.cone_half_angle), 0, 80, "Half angle of the cone around nozzle and heater block.");
  table.number("tool.cone_length_mm", CURVESUP_FIELD(tool.cone_length_mm), 0, 500, "Length of that cone along the nozzle axis.");
  table.number("tool.tip_radius_mm", CURVESUP_FIELD(tool.tip_radius_mm), 0, 10, "Radius of the flat face around the orifice.");
  table.number("tool.head_radius_mm", CURVESUP_FIELD(tool.head_radius_mm), 0, 500, "Radius of the head behind the cone.");
  table.number("tool.head_length_mm", CURVESUP_FIELD(tool.head_length_mm), 0, 1000, "Distance from the tip to the end of the head.");
}

void add_motion_rows(Table& table) {
  table.numbers("stations.home_deg", 6, 1.0, CURVESUP_ELEMENT(stations.home_deg[i]), -360, 360, "Joints of the home pose.");
  table.numbers("stations.purge_deg", 6, 1.0, CURVESUP_ELEMENT(stations.purge_deg[i]), -360, 360,
                "Joints of the pose in which filament is changed and purged.");
  table.number("speeds.print_acceleration_m_s2", CURVESUP_FIELD(speeds.print_acceleration_m_s2), 0.01, 3, "Acceleration of printing moves, on both machines.");
  table.number("speeds.travel_mm_s", CURVESUP_FIELD(speeds.travel_mm_s), 1, 500, "Speed of travel off the part.");
  table.number("speeds.approach_mm_s", CURVESUP_FIELD(speeds.approach_mm_s), 1, 250, "Speed of the moves that leave and reach the part.");
  table.number("speeds.travel_acceleration_m_s2", CURVESUP_FIELD(speeds.travel_acceleration_m_s2), 0.01, 3, "Acceleration of travel.");
  table.number("speeds.max_programmed_mm_s", CURVESUP_FIELD(speeds.max_programmed_mm_s), 1, 500, "Highest speed that a printing move may state.");
  table.number("speeds.joint_speed_deg_s", CURVESUP_FIELD(speeds.joint_speed_deg_s), 1, 180, "Speed of joint moves.");
  table.number("speeds.joint_acceleration_deg_s2", CURVESUP_FIELD(speeds.joint_acceleration_deg_s2), 1, 800, "Acceleration of joint moves.");
  table.number("speeds.rotation_rad_per_m", CURVESUP_FIELD(speeds.rotation_rad_per_m), 0.1, 1000,
               "Change of the rotation vector that the controller makes per metre of stated speed; faster turns raise the stated speed.");
  table.number("tolerances.chord_mm", CURVESUP_FIELD(tolerances.chord_mm), 0, 1, "Waypoints are thinned to this distance between tip polylines.");
  table.angle("tolerances.axis_deg", CURVESUP_FIELD(tolerances.axis), 0.01, 30, "Waypoints are thinned to this angle between nozzle axes.");
  table.number("tolerances.corner_mm", CURVESUP_FIELD(tolerances.corner_mm), 0, 5, "Most that a blend cuts off a corner.");
  table.number("tolerances.bead_mm3", CURVESUP_FIELD(tolerances.bead_mm3), 0, 100, "Waypoints are thinned to this difference of the volume laid so far.");
  table.number("tolerances.min_segment_mm", CURVESUP_FIELD(tolerances.min_segment_mm), 0.001, 5, "Nearer waypoints become one.");
  table.number("tolerances.min_blend_mm", CURVESUP_FIELD(tolerances.min_blend_mm), 0.1, 10, "A blend radius below this becomes a stop.");
  table.number("tolerances.blend_fraction", CURVESUP_FIELD(tolerances.blend_fraction), 0, 0.45, "Blend radius over the shorter neighbouring segment, at most.");
  table.angle("tolerances.max_blend_turn_deg", CURVESUP_FIELD(tolerances.max_blend_turn), 1, 150, "Sharper turns stop both machines.");
  table.angle("tolerances.max_tilt_deviation_deg", CURVESUP_FIELD(tolerances.max_tilt_deviation), 0, 120,
              "Most that the nozzle axis leaves the layer normal, for reach and clearance only.");
  table.number("tolerances.max_tilt_rate_deg_mm", CURVESUP_FIELD(tolerances.max_tilt_rate_deg_mm), 0.1, 360, "Turn of the nozzle axis per length of path, where the deviation allows it.");
  table.number("tolerances.max_yaw_rate_deg_mm", CURVESUP_FIELD(tolerances.max_yaw_rate_deg_mm), 0, 360, "Turn of the head about the nozzle axis per length of path.");
  table.number("tolerances.clearance_mm", CURVESUP_FIELD(tolerances.clearance_mm), 0, 20, "Kept between head and printed material while printing.");
  table.number("tolerances.max_raise_mm", CURVESUP_FIELD(tolerances.max_raise_mm), 0, 2, "By how much the nozzle may pass above its path where no allowed tilt and no order of the paths keeps the head off what is laid.");
  table.number("tolerances.travel_clearance_mm", CURVESUP_FIELD(tolerances.travel_clearance_mm), 0.1, 100, "Kept between head and printed material while travelling.");
}

void add_link_rows(Table& table) {
  table.choice("link.kind", CURVESUP_FIELD(link.kind), {"dio", "telnet", "stream"},
               "How arm and extruder board keep step: digital lines, telnet counters, or extrusion commands sent by the arm.");
  table.text("link.duet_ip", CURVESUP_FIELD(link.duet_ip), "Address of the Duet board.");
  table.integer("link.telnet_port", CURVESUP_FIELD(link.telnet_port), 1, 65535, "Telnet port of the Duet board.");
  table.integer("link.robot_start_output", CURVESUP_FIELD(link.robot_start_output), 0, 7, "Digital output of the arm for path barriers.");
  table.integer("link.robot_run_output", CURVESUP_FIELD(link.robot_run_output), 0, 7, "Digital output of the arm that is high while its program runs.");
  table.integer("link.robot_gate_output", CURVESUP_FIELD(link.robot_gate_output), 0, 7, "Digital output of the arm for gates inside a path.");
  table.integer("link.robot_acknowledge_input", CURVESUP_FIELD(link.robot_acknowledge_input), 0, 7, "Digital input of the arm for the board's acknowledge.");
  table.integer("link.duet_barrier_input", CURVESUP_FIELD(link.duet_barrier_input), 0, 15, "Input number of the board for path barriers.");
  table.integer("link.duet_run_input", CURVESUP_FIELD(link.duet_run_input), 0, 15, "Input number of the board for the arm's run state.");
  table.integer("link.duet_gate_input", CURVESUP_FIELD(link.duet_gate_input), 0, 15, "Input number of the board for gates.");
  table.integer("link.duet_acknowledge_output", CURVESUP_FIELD(link.duet_acknowledge_output), 0, 15, "Output number of the board for the acknowledge.");
  table.text("link.duet_barrier_pin", CURVESUP_FIELD(link.duet_barrier_pin), "Pin of the board behind the barrier input.");
  table.text("link.duet_run_pin", CURVESUP_FIELD(link.duet_run_pin), "Pin of the board behind the run-state input.");
  table.text("link.duet_gate_pin", CURVESUP_FIELD(link.duet_gate_pin), "Pin of the board behind the gate input.");
  table.text("link.duet_acknowledge_pin", CURVESUP_FIELD(link.duet_acknowledge_pin), "Pin of the board behind the acknowledge output.");
  table.number("link.timeout_s", CURVESUP_FIELD(link.timeout_s), 0.1, 600, "Longest wait at a barrier.");
  table.number("link.tool_change_timeout_s", CURVESUP_FIELD(link.tool_change_timeout_s), 1, 3600, "Longest wait for a filament change.");
  table.number("link.heating_timeout_s", CURVESUP_FIELD(link.heating_timeout_s), 1, 7200, "Longest wait for the first heating.");
  table.number("link.duet_lead_s", CURVESUP_FIELD(link.duet_lead_s), 0, 1, "Wait of the arm after an acknowledge.");
  table.number("link.gate_interval_s", CURVESUP_FIELD(link.gate_interval_s), 0.1, 10, "Longest print time between two gates.");
  table.integer("link.gate_moves", CURVESUP_FIELD(link.gate_moves), 1, 18, "Most moves between two gates.");
}

void add_extruder_rows(Table& table) {
  table.number("extruder.filament_diameter_mm", CURVESUP_FIELD(extruder.filament_diameter_mm), 0.5, 5, "Diameter of both filaments.");
  table.number("extruder.max_e_mm_s", CURVESUP_FIELD(extruder.max_e_mm_s), 1, 500, "Highest filament speed.");
  table.number("extruder.e_acceleration_mm_s2", CURVESUP_FIELD(extruder.e_acceleration_mm_s2), 1, 20000, "Filament acceleration.");
  table.number("extruder.e_jerk_mm_s", CURVESUP_FIELD(extruder.e_jerk_mm_s), 0, 200, "Filament speed change without ramp.");
  table.integer("extruder.heater", CURVESUP_FIELD(extruder.heater), 0, 15, "Heater number that both tools share.");
  table.integer("extruder.fan", CURVESUP_FIELD(extruder.fan), 0, 15, "Fan number of the part fan.");
  table.integer("extruder.driver", CURVESUP_FIELD(extruder.driver), 0, 15, "First extruder driver; the second material uses the next one.");
}

// A field function cannot capture which filament; a template argument does.
template <int kFilament>
void add_filament_rows(Table& table, const std::string& section) {
  const auto path = [&](const char* key) { return section + "." + key; };
  const auto number = [&](const char* key, auto field, double min, double max, const char* doc) {
    table.number(path(key).c_str(), field, min, max, doc);
  };
  table.text(path("name").c_str(), CURVESUP_FIELD(filaments[kFilament].name), "Name of the filament.");
  table.integer(path("tool").c_str(), CURVESUP_FIELD(filaments[kFilament].tool), 0, 49, "Tool number on the board.");
  number("temperature_c", CURVESUP_FIELD(filaments[kFilament].temperature_c), 20, 500, "Nozzle temperature.");
  number("min_temperature_c", CURVESUP_FIELD(filaments[kFilament].min_temperature_c), 0, 500, "Colder filament is not extruded.");
  number("flow", CURVESUP_FIELD(filaments[kFilament].flow), 0.1, 5, "Filament fed over bead volume divided by filament area.");
  number("retract_mm", CURVESUP_FIELD(filaments[kFilament].retract_mm), 0, 20, "Retraction at path ends.");
  number("retract_mm_s", CURVESUP_FIELD(filaments[kFilament].retract_mm_s), 0.5, 200, "Speed of retraction.");
  number("load_mm", CURVESUP_FIELD(filaments[kFilament].load_mm), 0, 2000, "Length from the Y-junction to the nozzle.");
  number("unload_mm", CURVESUP_FIELD(filaments[kFilament].unload_mm), 0, 2000, "Length drawn back to the Y-junction.");
  number("load_mm_s", CURVESUP_FIELD(filaments[kFilament].load_mm_s), 0.5, 100, "Speed of loading and unloading.");
  number("purge_mm", CURVESUP_FIELD(filaments[kFilament].purge_mm), 0, 500, "Length purged after loading.");
  number("fan", CURVESUP_FIELD(filaments[kFilament].fan), 0, 1, "Part fan, 0 to 1.");
  number("pressure_advance_s", CURVESUP_FIELD(filaments[kFilament].pressure_advance_s), 0, 2, "Pressure advance.");
  number("max_flow_mm3_s", CURVESUP_FIELD(filaments[kFilament].max_flow_mm3_s), 0.1, 200, "Most that the nozzle melts; faster segments are printed slower.");
}

void add_program_rows(Table& table) {
  table.integer("program.max_moves_per_part", CURVESUP_FIELD(program.max_moves_per_part), 100, 1e6, "Most moves in one robot program.");
  table.integer("program.max_bytes_per_part", CURVESUP_FIELD(program.max_bytes_per_part), 20000, 1e8, "Most bytes in one robot program.");
  table.choice("program.form", CURVESUP_FIELD(program.form), {"file", "port"},
               "Programs that end with a call of themselves (loaded as files) or not (sent to the arm's port).");
}

#undef FIELD
#undef ELEMENT

const Table& machine_table() {
  static const Table table = [] {
    Table t("machine");
    add_cell_rows(t);
    add_arm_rows(t);
    add_tool_rows(t);
    add_motion_rows(t);
    add_link_rows(t);
    add_extruder_rows(t);
    add_filament_rows<0>(t, "model_filament");
    add_filament_rows<1>(t, "support_filament");
    add_program_rows(t);
    return t;
  }();
  return table;
}

void check_consistency(const Machine& machine) {
  const auto refuse = [](const char* key, const std::string& what) { throw Error(ErrorKind::usage, key, what); };
  if (!has_closed_form(machine.arm)) {
    refuse("machine.arm.dh_alpha_deg", "the table is not that of an arm of the UR family (alpha 90, 0, 0, 90, -90, 0)");
  }
  if (machine.tool.payload_kg > machine.arm.max_payload_kg) {
    refuse("machine.tool.payload_kg", "= " + shortest(machine.tool.payload_kg) + ", must be at most machine.arm.max_payload_kg = " +
                                          shortest(machine.arm.max_payload_kg));
  }
  for (int i = 0; i < 6; ++i) {
    if (machine.arm.joint_min_deg[i] >= machine.arm.joint_max_deg[i]) {
      refuse("machine.arm.joint_min_deg", "must be below machine.arm.joint_max_deg for every joint");
    }
  }
  if (machine.tool.head_length_mm < machine.tool.cone_length_mm) {
    refuse("machine.tool.head_length_mm", "must be at least machine.tool.cone_length_mm");
  }
  if (machine.filaments[0].tool == machine.filaments[1].tool) {
    refuse("machine.support_filament.tool", "must differ from machine.model_filament.tool");
  }
}

}  // namespace

std::vector<ConfigKey> machine_keys() { return machine_table().keys(); }

Machine machine_from_config(const Json& machine_section) {
  Machine machine = machine_table().read(Json{{"machine", machine_section}});
  check_consistency(machine);
  return machine;
}

}  // namespace curvesup
