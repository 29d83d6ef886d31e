#include "curvesup/pipeline/machine_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "curvesup/core/error.h"
#include "curvesup/motion/kinematics.h"

namespace curvesup {
namespace {

Json read_profile(const std::string& name) {
  std::ifstream file(std::string(CURVESUP_DATA) + "/machines/" + name);
  return Json::parse(file);
}

// Objects key by key, anything else replaced.
void merge(Json& base, const Json& over) {
  for (const auto& [key, value] : over.items()) {
    if (value.is_object() && base.contains(key)) {
      merge(base[key], value);
    } else {
      base[key] = value;
    }
  }
}

Json default_section() {
  Json section = Json::object();
  for (const ConfigKey& key : machine_keys()) {
    Json* node = &section;
    std::string rest = key.path.substr(std::string("machine.").size());
    for (std::size_t dot; (dot = rest.find('.')) != std::string::npos; rest = rest.substr(dot + 1)) {
      node = &(*node)[rest.substr(0, dot)];
    }
    (*node)[rest] = key.default_value;
  }
  return section;
}

TEST(MachineKeys, AreUniqueDocumentedAndWithinTheirOwnRange) {
  std::set<std::string> paths;
  for (const ConfigKey& key : machine_keys()) {
    EXPECT_TRUE(paths.insert(key.path).second) << key.path;
    EXPECT_EQ(key.path.rfind("machine.", 0), 0u);
    EXPECT_GE(key.doc.size(), 10u) << key.path;
    EXPECT_EQ(key.doc.back(), '.') << key.path;
    const auto in_range = [&](const Json& value) { return value.get<double>() >= key.min && value.get<double>() <= key.max; };
    if (key.type == KeyType::number || key.type == KeyType::integer) {
      EXPECT_TRUE(in_range(key.default_value)) << key.path;
    }
    if (key.type == KeyType::numbers) {
      EXPECT_EQ(key.default_value.size(), key.size);
      for (const Json& value : key.default_value) EXPECT_TRUE(in_range(value)) << key.path;
    }
  }
}

TEST(MachineKeys, ShippedProfileStatesTheDefaults) { EXPECT_EQ(read_profile("ur5e_duet.json"), default_section()); }

TEST(MachineConfig, EveryKeyReachesTheMachine) {
  const Machine machine = machine_from_config(default_section());
  const Machine defaults;
  EXPECT_LT((machine.tool.tcp.rotation_vector - defaults.tool.tcp.rotation_vector).norm(), 1e-9);
  EXPECT_LT((machine.tool.tcp.position_m - defaults.tool.tcp.position_m).norm(), 1e-12);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(machine.arm.dh[i].alpha_rad, defaults.arm.dh[i].alpha_rad, 1e-11);

  Json changed = default_section();
  changed["link"]["kind"] = "telnet";
  changed["support_filament"]["retract_mm"] = 1.25;
  changed["tolerances"]["max_tilt_deviation_deg"] = 12.0;
  changed["program"]["max_bytes_per_part"] = 400000;
  const Machine other = machine_from_config(changed);
  EXPECT_EQ(other.link.kind, DuetLink::telnet);
  EXPECT_EQ(other.filaments[1].retract_mm, 1.25);
  EXPECT_EQ(other.filaments[0].retract_mm, defaults.filaments[0].retract_mm);
  EXPECT_NEAR(other.tolerances.max_tilt_deviation.degrees(), 12.0, 1e-12);
  EXPECT_EQ(other.program.max_bytes_per_part, 400000);
}

TEST(MachineConfig, SecondArmOverridesTheFirst) {
  Json section = read_profile("ur5e_duet.json");
  Json over = read_profile("ur10e_duet.json");
  EXPECT_EQ(over["extends"], "ur5e_duet.json");
  over.erase("extends");
  merge(section, over);
  const Machine machine = machine_from_config(section);
  EXPECT_TRUE(has_closed_form(machine.arm));
  EXPECT_EQ(machine.arm.dh[1].a_m, -0.6127);
  EXPECT_EQ(machine.tool.head_length_mm, Machine{}.tool.head_length_mm);
}

TEST(MachineConfig, RefusesMissingKeysAndContradictions) {
  Json missing = default_section();
  missing["arm"].erase("dh_a_m");
  EXPECT_THROW((void)machine_from_config(missing), Error);
  Json heavy = default_section();
  heavy["tool"]["payload_kg"] = 9.0;
  EXPECT_THROW((void)machine_from_config(heavy), Error);
  Json same_tool = default_section();
  same_tool["support_filament"]["tool"] = 0;
  EXPECT_THROW((void)machine_from_config(same_tool), Error);
}

// The tool's z points away from the part: with the nozzle upright at home it points up.
TEST(MachineDefaults, StationsHoldTheNozzleUprightOutsideThePart) {
  const Machine machine;
  for (const Joints& degrees : {machine.stations.home_deg, machine.stations.purge_deg}) {
    Joints joints;
    for (int i = 0; i < 6; ++i) joints[i] = degrees[i] * std::numbers::pi / 180.0;
    const Frame tip = forward_kinematics(machine.arm, joints) * to_frame(machine.tool.tcp);
    EXPECT_GT(tip.linear().col(2).z(), 0.98);
    const Vec3 from_centre = 1e3 * (tip.translation() - machine.platform.pose.position_m);
    EXPECT_GT(from_centre.z(), 50.0);
    EXPECT_TRUE(from_centre.head<2>().norm() > machine.platform.radius_mm || from_centre.z() > 300.0);
    EXPECT_GT(singularity_metric(machine.arm, joints), 0.5);
  }
}

}  // namespace
}  // namespace curvesup
