#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/motion/kinematics.h"
#include "curvesup/pipeline/config.h"
#include "curvesup/pipeline/machine_config.h"

namespace curvesup {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// A key together with the place in Machine that it sets: defaults, schema and mapping come from this one table.
struct Row {
  ConfigKey key;
  std::function<void(Machine&, const Json&)> set;
};

class Table {
 public:
  template <class Field>
  void number(const char* path, Field field, double min, double max, const char* doc) {
    ConfigKey key = make(path, KeyType::number, field(defaults_), doc);
    key.min = min, key.max = max;
    add(std::move(key), [field](Machine& machine, const Json& value) { field(machine) = value.get<double>(); });
  }
  template <class Field>
  void angle(const char* path, Field field, double min, double max, const char* doc) {
    ConfigKey key = make(path, KeyType::number, rounded(field(defaults_).degrees()), doc);
    key.min = min, key.max = max;
    add(std::move(key),
        [field](Machine& machine, const Json& value) { field(machine) = Angle::degrees(value.get<double>()); });
  }
  template <class Field>
  void integer(const char* path, Field field, double min, double max, const char* doc) {
    using Number = std::remove_reference_t<decltype(field(defaults_))>;
    ConfigKey key = make(path, KeyType::integer, field(defaults_), doc);
    key.min = min, key.max = max;
    add(std::move(key), [field](Machine& machine, const Json& value) { field(machine) = value.get<Number>(); });
  }
  template <class Field>
  void text(const char* path, Field field, const char* doc) {
    add(make(path, KeyType::text, field(defaults_), doc),
        [field](Machine& machine, const Json& value) { field(machine) = value.get<std::string>(); });
  }
  template <class Field>
  void choice(const char* path, Field field, std::vector<std::string> names, const char* doc) {
    using Enum = std::remove_reference_t<decltype(field(defaults_))>;
    ConfigKey key = make(path, KeyType::choice, names[static_cast<std::size_t>(field(defaults_))], doc);
    key.choices = names;
    add(std::move(key), [field, names](Machine& machine, const Json& value) {
      const std::string text = value.get<std::string>();
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (names[i] == text) field(machine) = static_cast<Enum>(i);
      }
    });
  }
  // `size` numbers; element(machine, i) is the place of the i-th, which holds the number times `scale`.
  template <class Element>
  void numbers(const char* path, std::size_t size, double scale, Element element, double min, double max, const char* doc) {
    Json values = Json::array();
    for (std::size_t i = 0; i < size; ++i) values.push_back(rounded(element(defaults_, i) / scale));
    ConfigKey key = make(path, KeyType::numbers, values, doc);
    key.min = min, key.max = max, key.size = size;
    add(std::move(key), [element, size, scale](Machine& machine, const Json& value) {
      for (std::size_t i = 0; i < size; ++i) element(machine, i) = value[i].get<double>() * scale;
    });
  }

  std::vector<Row> rows;

 private:
  static ConfigKey make(const std::string& path, KeyType type, Json value, const char* doc) {
    ConfigKey key;
    key.path = "machine." + path;
    key.type = type;
    key.default_value = std::move(value);
    key.doc = doc;
    return key;
  }
  // Degrees and millimetres that went through radians and metres read as they were meant.
  static double rounded(double value) { return std::round(value * 1e9) / 1e9; }
  void add(ConfigKey key, std::function<void(Machine&, const Json&)> set) {
    rows.push_back({std::move(key), std::move(set)});
  }

  Machine defaults_;
};

#define FIELD(expression) [](Machine& m) -> auto& { return m.expression; }
#define ELEMENT(expression) [](Machine& m, std::size_t i) -> double& { return m.expression; }

void add_cell_rows(Table& table) {
  table.text("name", FIELD(name), "Name of the profile, as reports and programs show it.");
  table.choice("place", FIELD(place), {"as_modelled", "auto"},
               "Print the part where the model stands, or where the arm reaches it best (moved in x and y, turned about z).");
  table.numbers("platform.centre_m", 3, 1.0, ELEMENT(platform.pose.position_m[static_cast<int>(i)]), -3, 3,
                "Platform centre, the origin of the toolpaths, in the robot's base frame.");
  table.numbers("platform.rotation_deg", 3, kDegree, ELEMENT(platform.pose.rotation_vector[static_cast<int>(i)]), -360, 360,
                "Rotation vector of the platform frame in the robot's base frame.");
  table.number("platform.radius_mm", FIELD(platform.radius_mm), 1, 2000, "Radius of the round platform.");
  table.number("platform.table_clearance_mm", FIELD(platform.table_clearance_mm), 0, 100,
               "Height above the platform plane that head and arm keep; the nozzle cone near its tip is excepted.");
}

void add_arm_rows(Table& table) {
  table.text("arm.model", FIELD(arm.model), "Name of the arm.");
  table.numbers("arm.dh_a_m", 6, 1.0, ELEMENT(arm.dh[i].a_m), -2, 2, "Denavit-Hartenberg a of the six joints.");
  table.numbers("arm.dh_d_m", 6, 1.0, ELEMENT(arm.dh[i].d_m), -2, 2, "Denavit-Hartenberg d of the six joints.");
  table.numbers("arm.dh_alpha_deg", 6, kDegree, ELEMENT(arm.dh[i].alpha_rad), -180, 180,
                "Denavit-Hartenberg alpha of the six joints.");
  table.numbers("arm.joint_min_deg", 6, 1.0, ELEMENT(arm.joint_min_deg[i]), -720, 720, "Lower joint limits.");
  table.numbers("arm.joint_max_deg", 6, 1.0, ELEMENT(arm.joint_max_deg[i]), -720, 720, "Upper joint limits.");
  table.number("arm.joint_margin_deg", FIELD(arm.joint_margin_deg), 0, 90, "Distance kept from the joint limits.");
  table.numbers("arm.max_joint_speed_deg_s", 6, 1.0, ELEMENT(arm.max_joint_speed_deg_s[i]), 1, 1000, "Joint speed limits.");
  table.number("arm.joint_speed_fraction", FIELD(arm.joint_speed_fraction), 0.01, 1,
               "Part of the joint speed limit that printing may use; segments that need more are printed slower.");
  table.number("arm.min_singularity_metric", FIELD(arm.min_singularity_metric), 0, 1,
               "Least of |sin q5|, |sin q3| and (wrist radius - d4) / d4 that a printing pose may have.");
  table.number("arm.max_joint_step_rad", FIELD(arm.max_joint_step_rad), 0.01, 1, "Most that a joint turns in one printed segment.");
  table.number("arm.max_reach_m", FIELD(arm.max_reach_m), 0.1, 5, "No coordinate of a pose exceeds this.");
  table.number("arm.max_payload_kg", FIELD(arm.max_payload_kg), 0.1, 100, "Payload that the arm carries at most.");
  table.number("arm.forearm_radius_mm", FIELD(arm.body.forearm_radius_mm), 0, 300, "Radius of the forearm as an obstacle.");
  table.number("arm.wrist_radius_mm", FIELD(arm.body.wrist_radius_mm), 0, 300, "Radius of the wrist links as an obstacle.");
}

void add_tool_rows(Table& table) {
  table.numbers("tool.tcp_mm", 3, 1e-3, ELEMENT(tool.tcp.position_m[static_cast<int>(i)]), -600, 600,
                "Nozzle tip in the flange frame.");
  table.numbers("tool.tcp_rotation_deg", 3, kDegree, ELEMENT(tool.tcp.rotation_vector[static_cast<int>(i)]), -360, 360,
                "Rotation vector of the tool frame in the flange frame; its z points away from the part, out of the back of the nozzle.");
  table.number("tool.payload_kg", FIELD(tool.payload_kg), 0, 100, "Mass of the tool.");
  table.numbers("tool.centre_of_gravity_mm", 3, 1e-3, ELEMENT(tool.centre_of_gravity_m[static_cast<int>(i)]), -600, 600,
                "Centre of gravity of the tool in the flange frame.");
  table.angle("tool.cone_half_angle_deg", FIELD(tool.cone_half_angle), 0, 80, "Half angle of the cone around nozzle and heater block.");
  table.number("tool.cone_length_mm", FIELD(tool.cone_length_mm), 0, 500, "Length of that cone along the nozzle axis.");
  table.number("tool.tip_radius_mm", FIELD(tool.tip_radius_mm), 0, 10, "Radius of the flat face around the orifice.");
  table.number("tool.head_radius_mm", FIELD(tool.head_radius_mm), 0, 500, "Radius of the head behind the cone.");
  table.number("tool.head_length_mm", FIELD(tool.head_length_mm), 0, 1000, "Distance from the tip to the end of the head.");
}

void add_motion_rows(Table& table) {
  table.numbers("stations.home_deg", 6, 1.0, ELEMENT(stations.home_deg[i]), -360, 360, "Joints of the home pose.");
  table.numbers("stations.purge_deg", 6, 1.0, ELEMENT(stations.purge_deg[i]), -360, 360,
                "Joints of the pose in which filament is changed and purged.");
  table.number("speeds.print_acceleration_m_s2", FIELD(speeds.print_acceleration_m_s2), 0.01, 3, "Acceleration of printing moves, on both machines.");
  table.number("speeds.travel_mm_s", FIELD(speeds.travel_mm_s), 1, 500, "Speed of travel off the part.");
  table.number("speeds.approach_mm_s", FIELD(speeds.approach_mm_s), 1, 250, "Speed of the moves that leave and reach the part.");
  table.number("speeds.travel_acceleration_m_s2", FIELD(speeds.travel_acceleration_m_s2), 0.01, 3, "Acceleration of travel.");
  table.number("speeds.max_programmed_mm_s", FIELD(speeds.max_programmed_mm_s), 1, 500, "Highest speed that a printing move may state.");
  table.number("speeds.joint_speed_deg_s", FIELD(speeds.joint_speed_deg_s), 1, 180, "Speed of joint moves.");
  table.number("speeds.joint_acceleration_deg_s2", FIELD(speeds.joint_acceleration_deg_s2), 1, 800, "Acceleration of joint moves.");
  table.number("speeds.rotation_rad_per_m", FIELD(speeds.rotation_rad_per_m), 0.1, 1000,
               "Change of the rotation vector that the controller makes per metre of stated speed; faster turns raise the stated speed.");
  table.number("tolerances.chord_mm", FIELD(tolerances.chord_mm), 0, 1, "Waypoints are thinned to this distance between tip polylines.");
  table.angle("tolerances.axis_deg", FIELD(tolerances.axis), 0.01, 30, "Waypoints are thinned to this angle between nozzle axes.");
  table.number("tolerances.corner_mm", FIELD(tolerances.corner_mm), 0, 5, "Most that a blend cuts off a corner.");
  table.number("tolerances.bead_mm3", FIELD(tolerances.bead_mm3), 0, 100, "Waypoints are thinned to this difference of the volume laid so far.");
  table.number("tolerances.min_segment_mm", FIELD(tolerances.min_segment_mm), 0.001, 5, "Nearer waypoints become one.");
  table.number("tolerances.min_blend_mm", FIELD(tolerances.min_blend_mm), 0.1, 10, "A blend radius below this becomes a stop.");
  table.number("tolerances.blend_fraction", FIELD(tolerances.blend_fraction), 0, 0.45, "Blend radius over the shorter neighbouring segment, at most.");
  table.angle("tolerances.max_blend_turn_deg", FIELD(tolerances.max_blend_turn), 1, 150, "Sharper turns stop both machines.");
  table.angle("tolerances.max_tilt_deviation_deg", FIELD(tolerances.max_tilt_deviation), 0, 120,
              "Most that the nozzle axis leaves the layer normal, for reach and clearance only.");
  table.number("tolerances.max_tilt_rate_deg_mm", FIELD(tolerances.max_tilt_rate_deg_mm), 0.1, 360, "Turn of the nozzle axis per length of path, where the deviation allows it.");
  table.number("tolerances.max_yaw_rate_deg_mm", FIELD(tolerances.max_yaw_rate_deg_mm), 0, 360, "Turn of the head about the nozzle axis per length of path.");
  table.number("tolerances.clearance_mm", FIELD(tolerances.clearance_mm), 0, 20, "Kept between head and printed material while printing.");
  table.number("tolerances.travel_clearance_mm", FIELD(tolerances.travel_clearance_mm), 0.1, 100, "Kept between head and printed material while travelling.");
}

void add_link_rows(Table& table) {
  table.choice("link.kind", FIELD(link.kind), {"dio", "telnet", "stream"},
               "How arm and extruder board keep step: digital lines, telnet counters, or extrusion commands sent by the arm.");
  table.text("link.duet_ip", FIELD(link.duet_ip), "Address of the Duet board.");
  table.integer("link.telnet_port", FIELD(link.telnet_port), 1, 65535, "Telnet port of the Duet board.");
  table.integer("link.robot_start_output", FIELD(link.robot_start_output), 0, 7, "Digital output of the arm for path barriers.");
  table.integer("link.robot_run_output", FIELD(link.robot_run_output), 0, 7, "Digital output of the arm that is high while its program runs.");
  table.integer("link.robot_gate_output", FIELD(link.robot_gate_output), 0, 7, "Digital output of the arm for gates inside a path.");
  table.integer("link.robot_acknowledge_input", FIELD(link.robot_acknowledge_input), 0, 7, "Digital input of the arm for the board's acknowledge.");
  table.integer("link.duet_barrier_input", FIELD(link.duet_barrier_input), 0, 15, "Input number of the board for path barriers.");
  table.integer("link.duet_run_input", FIELD(link.duet_run_input), 0, 15, "Input number of the board for the arm's run state.");
  table.integer("link.duet_gate_input", FIELD(link.duet_gate_input), 0, 15, "Input number of the board for gates.");
  table.integer("link.duet_acknowledge_output", FIELD(link.duet_acknowledge_output), 0, 15, "Output number of the board for the acknowledge.");
  table.text("link.duet_barrier_pin", FIELD(link.duet_barrier_pin), "Pin of the board behind the barrier input.");
  table.text("link.duet_run_pin", FIELD(link.duet_run_pin), "Pin of the board behind the run-state input.");
  table.text("link.duet_gate_pin", FIELD(link.duet_gate_pin), "Pin of the board behind the gate input.");
  table.text("link.duet_acknowledge_pin", FIELD(link.duet_acknowledge_pin), "Pin of the board behind the acknowledge output.");
  table.number("link.timeout_s", FIELD(link.timeout_s), 0.1, 600, "Longest wait at a barrier.");
  table.number("link.tool_change_timeout_s", FIELD(link.tool_change_timeout_s), 1, 3600, "Longest wait for a filament change.");
  table.number("link.heating_timeout_s", FIELD(link.heating_timeout_s), 1, 7200, "Longest wait for the first heating.");
  table.number("link.duet_lead_s", FIELD(link.duet_lead_s), 0, 1, "Wait of the arm after an acknowledge.");
  table.number("link.gate_interval_s", FIELD(link.gate_interval_s), 0.1, 10, "Longest print time between two gates.");
  table.integer("link.gate_moves", FIELD(link.gate_moves), 1, 18, "Most moves between two gates.");
}

void add_extruder_rows(Table& table) {
  table.number("extruder.filament_diameter_mm", FIELD(extruder.filament_diameter_mm), 0.5, 5, "Diameter of both filaments.");
  table.number("extruder.max_e_mm_s", FIELD(extruder.max_e_mm_s), 1, 500, "Highest filament speed.");
  table.number("extruder.e_acceleration_mm_s2", FIELD(extruder.e_acceleration_mm_s2), 1, 20000, "Filament acceleration.");
  table.number("extruder.e_jerk_mm_s", FIELD(extruder.e_jerk_mm_s), 0, 200, "Filament speed change without ramp.");
  table.integer("extruder.heater", FIELD(extruder.heater), 0, 15, "Heater number that both tools share.");
  table.integer("extruder.fan", FIELD(extruder.fan), 0, 15, "Fan number of the part fan.");
  table.integer("extruder.driver", FIELD(extruder.driver), 0, 15, "First extruder driver; the second material uses the next one.");
}

// FIELD cannot capture which filament; these rows can.
template <int kFilament>
void add_filament_rows(Table& table, const std::string& section) {
  const auto path = [&](const char* key) { return section + "." + key; };
  const auto number = [&](const char* key, auto field, double min, double max, const char* doc) {
    table.number(path(key).c_str(), field, min, max, doc);
  };
  table.text(path("name").c_str(), FIELD(filaments[kFilament].name), "Name of the filament.");
  table.integer(path("tool").c_str(), FIELD(filaments[kFilament].tool), 0, 49, "Tool number on the board.");
  number("temperature_c", FIELD(filaments[kFilament].temperature_c), 20, 500, "Nozzle temperature.");
  number("min_temperature_c", FIELD(filaments[kFilament].min_temperature_c), 0, 500, "Colder filament is not extruded.");
  number("flow", FIELD(filaments[kFilament].flow), 0.1, 5, "Filament fed over bead volume divided by filament area.");
  number("retract_mm", FIELD(filaments[kFilament].retract_mm), 0, 20, "Retraction at path ends.");
  number("retract_mm_s", FIELD(filaments[kFilament].retract_mm_s), 0.5, 200, "Speed of retraction.");
  number("load_mm", FIELD(filaments[kFilament].load_mm), 0, 2000, "Length from the Y-junction to the nozzle.");
  number("unload_mm", FIELD(filaments[kFilament].unload_mm), 0, 2000, "Length drawn back to the Y-junction.");
  number("load_mm_s", FIELD(filaments[kFilament].load_mm_s), 0.5, 100, "Speed of loading and unloading.");
  number("purge_mm", FIELD(filaments[kFilament].purge_mm), 0, 500, "Length purged after loading.");
  number("fan", FIELD(filaments[kFilament].fan), 0, 1, "Part fan, 0 to 1.");
  number("pressure_advance_s", FIELD(filaments[kFilament].pressure_advance_s), 0, 2, "Pressure advance.");
  number("max_flow_mm3_s", FIELD(filaments[kFilament].max_flow_mm3_s), 0.1, 200, "Most that the nozzle melts; faster segments are printed slower.");
}

void add_program_rows(Table& table) {
  table.integer("program.max_moves_per_part", FIELD(program.max_moves_per_part), 100, 1e6, "Most moves in one robot program.");
  table.integer("program.max_bytes_per_part", FIELD(program.max_bytes_per_part), 20000, 1e8, "Most bytes in one robot program.");
  table.choice("program.form", FIELD(program.form), {"file", "port"},
               "Programs that end with a call of themselves (loaded as files) or not (sent to the arm's port).");
}

#undef FIELD
#undef ELEMENT

std::vector<Row> machine_rows() {
  Table table;
  add_cell_rows(table);
  add_arm_rows(table);
  add_tool_rows(table);
  add_motion_rows(table);
  add_link_rows(table);
  add_extruder_rows(table);
  add_filament_rows<0>(table, "model_filament");
  add_filament_rows<1>(table, "support_filament");
  add_program_rows(table);
  return std::move(table.rows);
}

const Json& at_path(const Json& section, const std::string& path) {
  const Json* node = &section;
  std::size_t begin = std::string("machine.").size();
  while (begin < path.size()) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    const auto found = node->find(path.substr(begin, end - begin));
    if (found == node->end()) throw Error(ErrorKind::usage, path, "is missing from the resolved machine section");
    node = &*found;
    begin = end + 1;
  }
  return *node;
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

std::vector<ConfigKey> machine_keys() {
  std::vector<ConfigKey> keys;
  for (Row& row : machine_rows()) keys.push_back(std::move(row.key));
  return keys;
}

Machine machine_from_config(const Json& machine_section) {
  Machine machine;
  for (const Row& row : machine_rows()) {
    const Json& value = at_path(machine_section, row.key.path);
    try {
      row.set(machine, value);
    } catch (const nlohmann::json::exception&) {
      throw Error(ErrorKind::usage, row.key.path, "has a value of the wrong type");
    }
  }
  check_consistency(machine);
  return machine;
}

}  // namespace curvesup
