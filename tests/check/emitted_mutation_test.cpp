#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>

#include "check/emitted_print.h"

// Each mutation breaks one thing in a copy of a sound print; the check of that name must find it.
namespace curvesup {
namespace {

using Files = std::map<std::string, std::string>;

const WrittenPrint& sound_print() {
  static const WrittenPrint print = [] {
    Machine machine;
    machine.program.max_moves_per_part = 150;
    return write_print(three_layers(), machine);
  }();
  return print;
}

constexpr char kJob[] = "duet/print.g";
constexpr char kPart1[] = "robot/part_0001.script", kPart2[] = "robot/part_0002.script", kPart3[] = "robot/part_0003.script";

struct Mutation {
  const char* name;
  const char* check;  // without "emitted."
  std::function<void(WrittenPrint&)> apply;
};

// The n-th place of `what` in a file; the test itself fails when it is not there.
std::size_t place_of(const std::string& text, const std::string& what, int n = 1) {
  std::size_t at = std::string::npos;
  for (int i = 0; i < n; ++i) {
    at = text.find(what, at == std::string::npos ? 0 : at + 1);
    if (at == std::string::npos) throw std::runtime_error("no " + what + " to break");
  }
  return at;
}

Mutation replace(const char* name, const char* check, const char* file, const std::string& from, const std::string& to, int n = 1) {
  return {name, check, [=](WrittenPrint& print) {
            std::string& text = print.files.at(file);
            text.replace(place_of(text, from, n), from.size(), to);
          }};
}

Mutation erase_line(const char* name, const char* check, const char* file, const std::string& start, int n = 1) {
  return {name, check, [=](WrittenPrint& print) {
            std::string& text = print.files.at(file);
            const std::size_t begin = place_of(text, "\n" + start, n) + 1;
            text.erase(begin, text.find('\n', begin) + 1 - begin);
          }};
}

// Changes the k-th number (counted from 0) of the n-th line that starts so.
Mutation number(const char* name, const char* check, const char* file, const std::string& start, int k,
                const std::function<std::string(const std::string&)>& change, int n = 1) {
  return {name, check, [=](WrittenPrint& print) {
            std::string& text = print.files.at(file);
            std::size_t at = place_of(text, "\n" + start, n) + 1 + start.size();
            const char* digits = "-0123456789.";
            std::size_t end = at;
            for (int i = 0; i <= k; ++i) {
              at = text.find_first_of(digits, i == 0 ? at : end);
              end = text.find_first_not_of(digits, at);
            }
            text.replace(at, end - at, change(text.substr(at, end - at)));
          }};
}

std::function<std::string(const std::string&)> plus(double add) {
  return [add](const std::string& old) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.7f", std::stod(old) + add);
    return std::string(buffer);
  };
}
std::function<std::string(const std::string&)> times(double factor) {
  return [factor](const std::string& old) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.7f", std::stod(old) * factor);
    return std::string(buffer);
  };
}
std::function<std::string(const std::string&)> becomes(const std::string& text) {
  return [text](const std::string&) { return text; };
}

Mutation custom(const char* name, const char* check, const std::function<void(WrittenPrint&)>& apply) { return {name, check, apply}; }

// Multiplies every E of printing moves.
void scale_filament(std::string& job, double factor) {
  std::string out;
  std::size_t begin = 0;
  while (begin < job.size()) {
    const std::size_t end = job.find('\n', begin);
    std::string line = job.substr(begin, end - begin);
    const std::size_t e = line.find(" E");
    if (line.starts_with("G1 X") && e != std::string::npos) {
      char buffer[40];
      std::snprintf(buffer, sizeof buffer, "%.6f", std::stod(line.substr(e + 2)) * factor);
      line.replace(e + 2, line.find_first_of(" \n", e + 2) - e - 2, buffer);
    }
    out += line + "\n";
    begin = end + 1;
  }
  job = out;
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) text.replace(at, from.size(), to);
}

const std::vector<Mutation>& mutations() {
  static const std::vector<Mutation> list = {
      // ---- robot, text
      replace("FirstLine", "rule_01_program_frame", kPart1, "def part_0001():", "def part_0001() :"),
      replace("NoCall", "rule_01_program_frame", kPart1, "\npart_0001()\n", "\n"),
      replace("SecondProgram", "rule_01_program_frame", kPart1, "\npart_0001()\n", "\ndef more():\nend\npart_0001()\n"),
      replace("TabIndentation", "rule_02_bytes_and_indentation", kPart1, "\n movep(", "\n\tmovep("),
      replace("NoIndentation", "rule_02_bytes_and_indentation", kPart2, "\n movep(", "\nmovep("),
      replace("CarriageReturn", "rule_02_bytes_and_indentation", kPart1, "r=0.000376)\n", "r=0.000376)\r\n"),
      replace("ForeignLetter", "rule_02_bytes_and_indentation", kPart1, " # barrier", " # barri\xc3\xa8re"),
      erase_line("LostEnd", "rule_03_blocks", kPart1, "   end"),
      replace("BusyLoop", "rule_03_blocks", kPart1, "   sleep(0.004)\n", ""),
      replace("UnknownFunction", "rule_04_calls", kPart1, "set_payload(", "set_load("),
      replace("MoveByTime", "rule_04_calls", kPart1, "r=0.000376)", "t=0.1)"),
      replace("FifthArgument", "rule_04_calls", kPart1, "r=0.000376)", "r=0.000376, 0.1)"),
      custom("PartAboveCap", "rule_05_part_caps", [](WrittenPrint& print) { print.machine.program.max_moves_per_part = 100; }),
      custom("Millimetres", "rule_06_pose_numbers", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart1);
        text.replace(place_of(text, "movep(p[0.4"), 11, "movep(p[490.4");
      }),
      number("Exponent", "rule_06_pose_numbers", kPart1, " movep(p[", 1, [](const std::string& old) { return old + "e-05"; }, 3),
      number("NotANumber", "rule_06_pose_numbers", kPart1, " movep(p[", 1, becomes("nan"), 3),
      number("FewDecimals", "rule_06_pose_numbers", kPart1, " movep(p[", 0, becomes("0.491"), 3),
      number("SpeedInMillimetres", "rule_07_units", kPart1, " movep(p[", 7, becomes("9.9923"), 3),
      custom("RadiusAndSpeedSwapped", "rule_37_same_speed", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart1);
        const std::size_t at = place_of(text, "v=0.0099923, r=0.000376");
        text.replace(at, 23, "v=0.000376, r=0.0099923");
      }),
      erase_line("NoToolFrame", "rule_08_tool_frame", kPart2, " set_tcp("),
      replace("OtherToolFrame", "rule_08_tool_frame", kPart2, "set_tcp(p[0.060000", "set_tcp(p[0.050000"),
      replace("Payload", "rule_08_tool_frame", kPart2, "set_payload(1.200", "set_payload(6.200"),
      // ---- robot, moves
      number("OverlappingBlends", "rule_09_blend_overlap", kPart1, " movep(p[", 8, becomes("0.000600"), 4),
      custom("BlendAtChainEnd", "rule_10_stops", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart1);
        text.replace(place_of(text, "r=0.000000)"), 11, "r=0.000300)");
      }),
      custom("DoubledWaypoint", "rule_11_spacing", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart1);
        const std::size_t at = place_of(text, " movep(", 4);
        const std::string line = text.substr(at, text.find('\n', at) + 1 - at);
        text.insert(at, line);
      }),
      custom("BlendAtReversal", "rule_11_turns", [](WrittenPrint& print) {
        // The strokes of layer 1 stop at each turn.
        std::string& text = print.files.at(kPart2);
        const std::size_t zigzag = place_of(text, "# barrier path 4");
        const std::size_t move = text.find(" movep(", zigzag);
        text.replace(text.find("r=0.000000", move), 10, "r=0.000250");
      }),
      custom("CornerCut", "rule_12_corner_cut", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart2);
        const std::size_t move = text.find(" movep(", place_of(text, "# barrier path 4"));
        text.replace(text.find("r=0.000000", move), 10, "r=0.000250");
      }),
      custom("AliasOfRotation", "rule_13_rotation_alias", [](WrittenPrint& print) {
        std::string& text = print.files.at(kPart2);
        std::size_t at = place_of(text, "# rotation", 5);
        at = text.rfind("movep(p[", at) + 8;
        std::size_t end = text.find(']', at);
        double v[6];
        std::sscanf(text.c_str() + at, "%lf,%lf,%lf,%lf,%lf,%lf", v, v + 1, v + 2, v + 3, v + 4, v + 5);
        const double angle = std::sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5]), f = 1.0 - 2.0 * std::numbers::pi / angle;
        char buffer[120];
        std::snprintf(buffer, sizeof buffer, "%.7f,%.7f,%.7f,%.6f,%.6f,%.6f", v[0], v[1], v[2], f * v[3], f * v[4], f * v[5]);
        text.replace(at, end - at, buffer);
      }),
      replace("LostRotationMark", "rule_14_rotation_marks", kPart2, " # rotation\n", "\n", 7),
      number("NozzleTilted", "rule_15_tilt_deviation", kPart1, " movep(p[", 4, becomes("0.700000"), 5),
      number("OutOfReach", "rule_16_inverse_kinematics", kPart1, " movep(p[", 0, becomes("1.1909261"), 5),
      number("JointJump", "rule_16_joint_step", kPart1, " movep(p[", 5, becomes("1.500000"), 5),
      custom("JointLimit", "rule_17_joint_limits", [](WrittenPrint& print) { print.machine.arm.joint_max_deg[0] = 100.0; }),
      custom("JointSpeed", "rule_17_joint_speed", [](WrittenPrint& print) { print.machine.arm.joint_speed_fraction = 0.01; }),
      custom("Singularity", "rule_17_singularity", [](WrittenPrint& print) { print.machine.arm.min_singularity_metric = 0.9; }),
      number("PartStartsElsewhere", "rule_18_part_start", kPart2, " movej([", 0, plus(0.01)),
      number("WaypointAside", "rule_19_polyline", kJob, "G1 X", 0, plus(0.2), 6),
      number("WaypointAsideInScript", "rule_37_same_polyline", kPart1, " movep(p[", 0, plus(0.0002), 6),
      erase_line("LostWaypoint", "rule_37_same_polyline", kPart1, " movep(p[", 6),
      custom("LostWaypointInBoth", "rule_19_source_points", [](WrittenPrint& print) {
        // Two waypoints of the first ring vanish from both programs.
        for (const auto& [file, start] : {std::pair{kPart1, "\n movep("}, std::pair{kJob, "\nG1 X"}}) {
          std::string& text = print.files.at(file);
          for (int i = 0; i < 3; ++i) {
            const std::size_t at = place_of(text, start, 5);
            text.erase(at, text.find('\n', at + 1) - at);
          }
        }
      }),
      custom("LostPath", "rule_19_path_order", [](WrittenPrint& print) {
        std::string& script = print.files.at(kPart3);
        const std::size_t from = place_of(script, " # barrier path 6"), to = script.find(" set_standard_digital_out(2, False)\n", script.find("wait_acknowledge(False, 5.1)", from));
        script.erase(from, to - from);
        std::string& job = print.files.at(kJob);
        const std::size_t begin = place_of(job, ";PATH:6"), end = place_of(job, ";END");
        job.erase(begin, end - begin);
      }),
      custom("SwappedPathNames", "rule_19_path_order", [](WrittenPrint& print) {
        replace_all(print.files.at(kPart1), "# path 0 ", "# path 1 ");
        replace_all(print.files.at(kJob), ";PATH:0 ", ";PATH:1 ");
      }),
      custom("LoweredTravel", "rule_20_travel_lift", [](WrittenPrint& print) {
        // The lift behind the first chain ends where it begins.
        std::string& text = print.files.at(kPart1);
        const std::size_t last = text.rfind("p[", text.find("# path 1 ")), end = text.find(']', last);
        const std::size_t chain_end = text.rfind("movep(p[", last) + 6;
        text.replace(last, end - last, text.substr(chain_end, text.find(']', chain_end) - chain_end));
      }),
      replace("WaitForever", "rule_22_timeouts", kPart1, "   waited = waited + 0.004\n", ""),
      replace("WaitOfWrongLevel", "rule_22_timeouts", kPart1, "get_standard_digital_in(0) != level", "get_standard_digital_in(0) == level"),
      replace("WrongInput", "rule_22_timeouts", kPart1, "get_standard_digital_in(0)", "get_standard_digital_in(1)"),
      replace("StopWithoutHalt", "rule_22_timeouts", kPart1, "  halt\n", ""),
      replace("StopWithoutLift", "rule_22_timeouts", kPart1, "0,0,0.030000", "0,0,-0.030000"),
      replace("OpenString", "rule_23_strings", kPart1, "finished\")", "finished)"),
      replace("LongString", "rule_23_strings", kPart1, "finished\")", std::string(300, 'x') + "\")"),
      replace("OutputLeftOn", "rule_24_part_end", kPart1, " set_standard_digital_out(0, False)\n set_standard_digital_out(2, False)\n set_runstate",
              " set_standard_digital_out(0, False)\n set_standard_digital_out(2, True)\n set_runstate", 2),
      replace("RunStateDrops", "rule_24_part_end", kPart1, "output_to_value(1, 0)", "output_to_value(1, 3)"),
      // ---- duet, text
      replace("LongLine", "rule_25_job_lines", kJob, "G1 X-9.0739", "G1" + std::string(300, ' ') + "X-9.0739"),
      replace("LeadingSpace", "rule_25_job_lines", kJob, "\nG1 X-9.0739", "\n  G1 X-9.0739"),
      replace("CarriageReturnInJob", "rule_25_job_lines", kJob, "\nM400\n", "\nM400\r\n"),
      replace("UnknownCommand", "rule_26_job_commands", kJob, "\nM564 H0 S0\n", "\nM999 H0 S0\n"),
      replace("UnknownParameter", "rule_26_job_commands", kJob, " Y0.9386", " V0.9386"),
      replace("Homing", "rule_26_job_commands", kJob, "\nG21\n", "\nG28\nG21\n"),
      replace("ExponentInJob", "rule_26_job_commands", kJob, " Y0.9386", " Y9.386e-1"),
      custom("NoRelativeExtruder", "rule_27_prelude", [](WrittenPrint& print) { replace_all(print.files.at(kJob), "\nM83\n", "\n"); }),
      replace("AbsoluteExtruder", "rule_26_job_commands", kJob, "\nM83\n", "\nM82\n"),
      number("ShiftedAxes", "rule_27_prelude", kJob, "G92 X", 0, plus(1.0), 2),
      replace("OtherAcceleration", "rule_27_prelude", kJob, "M204 P500.0", "M204 P900.0"),
      replace("NoTool", "rule_28_tool_and_heat", kJob, "\nT1\n", "\n"),
      replace("WrongTool", "rule_28_tool_and_heat", kJob, "\nT1\nM116 P1\n", "\nT0\nM116 P0\n"),
      custom("ColdTool", "rule_28_tool_and_heat", [](WrittenPrint& print) { replace_all(print.files.at(kJob), "G10 P0 S205.0", "G10 P0 S120.0"); }),
      replace("NoHeatWait", "rule_28_tool_and_heat", kJob, "\nM116 P1\n", "\n"),
      replace("ExtruderTooSlow", "rule_29_feeds", kJob, "G1 E0.80000 F1500.00", "G1 E0.80000 F15.00"),
      replace("ExtruderTooFast", "rule_29_feeds", kJob, "G1 E0.80000 F1500.00", "G1 E0.80000 F15000.00"),
      replace("TooMuchMelt", "rule_29_flow", kJob, "E0.188033", "E1.880330"),
      replace("FewDecimalsOfE", "rule_30_volume", kJob, "E0.188033", "E0.188"),
      custom("FilamentScaled", "rule_30_volume", [](WrittenPrint& print) { scale_filament(print.files.at(kJob), 1.01); }),
      replace("FilamentOfOnePath", "rule_30_path_volume", kJob, "E0.188033", "E0.228033"),
      replace("LayersInHeader", "rule_31_header", kJob, "; num_layers = 3", "; num_layers = 4"),
      replace("FilamentInHeader", "rule_31_header", kJob, "; filament used [mm] = 9", "; filament used [mm] = 8"),
      erase_line("LostLayer", "rule_32_layers", kJob, ";LAYER:1"),
      replace("WrongK", "rule_32_layers", kJob, ";K:1", ";K:2"),
      replace("LostRetract", "rule_33_retraction", kJob, "M577 P0 S0\nG1 E-0.80000 F1500.00\n", "M577 P0 S0\n"),
      replace("LongRetract", "rule_33_retraction", kJob, "G1 E-0.80000 F1500.00\n", "G1 E-1.80000 F1500.00\n"),
      replace("NoUnload", "rule_33_retraction", kJob, "G1 E-20.00000 F60.00\n", ""),
      custom("ChangeElsewhere", "rule_34_tool_change", [](WrittenPrint& print) { print.machine.stations.purge_deg[0] += 5.0; }),
      // ---- both
      erase_line("LostAcknowledge", "rule_35_barriers", kPart1, " wait_acknowledge(True, 5.1)"),
      erase_line("LostAcknowledgeOfBoard", "rule_35_barriers", kJob, "M42 P0 S1", 3),
      replace("LostStopAtBarrier", "rule_35_barriers", kJob, "\nM400\nM577 P0 S0\nG1 E-0.8", "\nM577 P0 S0\nG1 E-0.8"),
      erase_line("LostBarrier", "rule_35_barriers", kJob, "M577 P0 S1", 4),
      replace("BarrierLevel", "rule_35_barriers", kJob, "M577 P0 S0", "M577 P0 S1", 3),
      replace("WrongOutput", "rule_35_barriers", kPart1, "set_standard_digital_out(0, True)", "set_standard_digital_out(3, True)", 3),
      erase_line("LostGate", "rule_35_gates", kJob, "M577 P2 S1", 2),
      replace("GateParity", "rule_35_gates", kJob, "M577 P2 S1", "M577 P2 S0", 2),
      custom("GatesLostInBoth", "rule_36_chunk_size", [](WrittenPrint& print) {
        for (auto& [name, text] : print.files) {
          if (name == kJob) replace_all(text, "M577 P2 S1\n", ""), replace_all(text, "M577 P2 S0\n", "");
          if (name.ends_with(".script")) replace_all(text, "2, True)\n movep", "0, True)\n movep");
        }
        for (const char* part : {kPart1, kPart2, kPart3}) {
          std::string& text = print.files.at(part);
          replace_all(text, " set_standard_digital_out(0, True)\n movep", " movep");
          replace_all(text, " set_standard_digital_out(2, False)\n movep", " movep");
        }
      }),
      number("SpeedOfOneMove", "rule_37_same_speed", kPart1, " movep(p[", 7, becomes("0.0080000"), 5),
      replace("FeedOfOneMove", "rule_37_same_speed", kJob, " F599.54", " F899.54"),
      number("RotationLimitedSpeed", "rule_37_same_speed", kPart2, " movep(p[0.5285663", 6, times(0.9)),
      erase_line("LostStopOfBoard", "rule_37_same_speed", kJob, "M400\nG1 X"),
      custom("SlowChain", "rule_38_chain_time", [](WrittenPrint& print) {
        // The job alone is slower.
        std::string& job = print.files.at(kJob);
        replace_all(job, " F599.54", " F499.54");
      }),
      custom("HeaderTime", "rule_38_total_time", [](WrittenPrint& print) {
        std::string& job = print.files.at(kJob);
        const std::size_t at = place_of(job, ";TIME:") + 6;
        const int seconds = std::stoi(job.substr(at)), more = seconds + seconds / 10;
        const auto words = [](int s) { return "= " + std::to_string(s / 60) + "m " + std::to_string(s % 60) + "s"; };
        place_of(job, words(seconds));
        replace_all(job, ";TIME:" + std::to_string(seconds), ";TIME:" + std::to_string(more));
        replace_all(job, words(seconds), words(more));
      }),
      replace("FanOfBytes", "rule_39_final_state", kJob, "M106 P0 S0.50", "M106 P0 S128"),
      replace("HeaterStaysOn", "rule_39_final_state", kJob, "G10 P1 S0 R0\n", ""),
      replace("ToolStays", "rule_39_final_state", kJob, "T-1 P0\n", ""),
      custom("FileName", "rule_40_file_names", [](WrittenPrint& print) {
        print.files["duet/more tools.g"] = "M83\n";
      }),
      custom("PartNumbers", "rule_40_file_names", [](WrittenPrint& print) {
        auto moved = print.files.extract(kPart3);
        moved.key() = "robot/part_0004.script";
        print.files.insert(std::move(moved));
      }),
      erase_line("WaitsForEachOther", "sync_deadlock", kPart1, " set_standard_digital_out(0, True)", 3),
      number("HeadInThePlatform", "rule_21_clearance", kPart1, " movep(p[", 3, plus(1.4), 3),
      // ---- manifest
      custom("SwappedParts", "manifest_parts", [](WrittenPrint& print) { std::swap(print.parts[0], print.parts[1]); }),
      custom("WrongOffset", "manifest_offsets", [](WrittenPrint& print) { print.parts[1]["duet_offset"] = print.parts[1]["duet_offset"].get<int>() + 1; }),
      custom("WrongPaths", "manifest_parts", [](WrittenPrint& print) { print.parts[1]["paths"].erase(0); }),
      custom("WrongSeconds", "manifest_parts", [](WrittenPrint& print) { print.parts[1]["expected_s"] = 1.0; }),
  };
  return list;
}

class Mutations : public testing::TestWithParam<Mutation> {};

TEST_P(Mutations, IsCaught) {
  WrittenPrint print = sound_print();
  GetParam().apply(print);
  const CheckOutputResult result = check_written(print);
  EXPECT_FALSE(result.ok);
  const std::string wanted = std::string("emitted.") + GetParam().check;
  for (const Check& check : result.checks) {
    if (check.name != wanted) continue;
    EXPECT_FALSE(check.ok) << check_summary(result);
    return;
  }
  ADD_FAILURE() << "no check " << wanted;
}

INSTANTIATE_TEST_SUITE_P(CheckOutput, Mutations, testing::ValuesIn(mutations()),
                         [](const testing::TestParamInfo<Mutation>& info) { return std::string(info.param.name); });

TEST(CheckOutputMutations, ByteChangedBehindTheManifest) {
  WrittenPrint print = sound_print();
  std::string& text = print.files.at(kPart1);
  text[text.find("machine ur5e") + 8] = 'U';
  const CheckOutputResult result = check_written(print, false, &sound_print());
  EXPECT_FALSE(result.ok);
  for (const Check& check : result.checks) EXPECT_EQ(check.ok, check.name != "emitted.manifest_hashes") << check.name;
}

}  // namespace
}  // namespace curvesup
