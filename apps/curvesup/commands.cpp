#include "commands.h"

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <optional>
#include <thread>

#include "curvesup/check/check_output.h"
#include "curvesup/core/error.h"
#include "curvesup/core/words.h"
#include "curvesup/io/output_folder.h"
#include "curvesup/pipeline/compare.h"
#include "curvesup/pipeline/config.h"
#include "curvesup/pipeline/machine_config.h"
#include "curvesup/pipeline/inspect.h"
#include "curvesup/io/surface_file.h"
#include "curvesup/io/tet_file.h"
#include "curvesup/io/text_file.h"
#include "curvesup/model/fill_surface.h"
#include "curvesup/pipeline/slice.h"
#include "curvesup/preview/inspect.h"
#include "terminal.h"

namespace curvesup::cli {

namespace fs = std::filesystem;

namespace {

constexpr int kUsageExit = 2;

volatile std::sig_atomic_t interrupt_seen = 0;

// Turns SIGINT and SIGTERM into a stop request. The handler only notes the signal, a thread of its own passes it on: signals
// cannot simply be blocked, since libraries start threads before main() that would take them.
class InterruptWatch {
 public:
  InterruptWatch() {
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { interrupt_seen = 1; });
    watcher_ = std::jthread([this](const std::stop_token& ended) {
      while (!ended.stop_requested()) {
        if (interrupt_seen != 0) source_.request_stop();
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    });
  }
  [[nodiscard]] std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread watcher_;
};

ConfigSearch shipped_profiles() {
  std::error_code ignored;
  const fs::path program = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  return {{program / ".." / "share" / "curvesup" / "machines", program / ".." / "data" / "machines",
           fs::path(CURVESUP_SOURCE_DATA) / "machines"}};
}

struct Arguments {
  std::string model, config, out, stop_after, key, progress = "auto";
  std::vector<std::string> overrides;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
};

ConfigSource config_of(const Arguments& arguments) {
  ConfigSource config = arguments.config.empty() ? ConfigSource{} : read_config(arguments.config, shipped_profiles());
  for (const std::string& assignment : arguments.overrides) apply_override(config, assignment);
  return config;
}

fs::path out_of(const Arguments& arguments) {
  if (!arguments.out.empty()) return arguments.out;
  return fs::path(arguments.model).stem().string() + "_out";
}

ProgressMode progress_mode(const std::string& name) {
  if (name == "json") return ProgressMode::json;
  return name == "none" ? ProgressMode::none : ProgressMode::automatic;
}

// The context every long command runs in.
class Session {
 public:
  explicit Session(const Arguments& arguments) : terminal_(progress_mode(arguments.progress)) {
    context.threads = arguments.threads;
    context.stop = watch_.token();
    context.log_sink = [this](LogLevel level, std::string_view message) { terminal_.log(level, message); };
  }
  ~Session() { terminal_.finish(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void progress(double fraction, std::string_view stage) { terminal_.progress(fraction, stage); }

  RunContext context;

 private:
  InterruptWatch watch_;
  Terminal terminal_;
};

int run_slice(const Arguments& arguments) {
  SliceRequest request{arguments.model, config_of(arguments), out_of(arguments), arguments.stop_after, {}};
  SliceOutcome outcome;
  {
    Session session(arguments);
    request.on_progress = [&](double fraction, std::string_view stage) { session.progress(fraction, stage); };
    outcome = slice(request, session.context);
  }
  std::cout << summary_text(outcome, request.out);
  return outcome.exit_code;
}

void write_table_files(const CompareResult& result, OutputFolder& output) {
  const std::string json = compare_json(result).dump(2) + "\n";
  output.write("compare.json", json);
  output.write("compare.csv", compare_csv(result));
  output.write("manifest.json", Json{{"files", {"compare.json", "compare.csv"}}}.dump(2) + "\n");
  output.write("report.json", json);
  output.commit();
}

int run_compare(const Arguments& arguments) {
  const SliceRequest request{arguments.model, config_of(arguments), {}, {}, {}};
  std::optional<OutputFolder> output;  // one that cannot be written is refused before the work
  if (!arguments.out.empty()) output.emplace(arguments.out);
  CompareResult result;
  {
    Session session(arguments);
    result = compare(request, session.context);
  }
  std::cout << compare_table(result);
  if (output) write_table_files(result, *output);
  return 0;
}

// A surface that looks sound may still be more than the mesher can do: that too is a finding.
void try_to_fill(const TriangleMesh& surface, const std::string& name, MeshDiagnosis& diagnosis) {
  if (!diagnosis.usable()) return;
  try {
    (void)fill_surface(surface, name);
  } catch (const Error& error) {
    diagnosis.problems.push_back({"cannot_be_filled", MeshProblem::Severity::refused, "mesh", 1, {0}, error.problem(), error.remedy()});
  }
}

template <class Mesh>
int report_diagnosis(const Arguments& arguments, const std::string& name, const MeshDiagnosis& diagnosis, const Mesh& mesh) {
  std::cout << diagnosis_text(name, diagnosis);
  if (!arguments.out.empty()) write_file(arguments.out, inspect_html(diagnosis, mesh, name));
  return diagnosis.supportable() ? 0 : exit_code(ErrorKind::input);
}

int run_inspect(const Arguments& arguments) {
  const std::string name = fs::path(arguments.model).filename().string();
  if (!is_surface_file(arguments.model)) {
    const TetMesh mesh = read_tet_file(arguments.model);
    return report_diagnosis(arguments, name, diagnose_mesh(mesh), mesh);
  }
  const TriangleMesh surface = read_surface_file(arguments.model);
  MeshDiagnosis diagnosis = diagnose_surface(surface);
  try_to_fill(surface, name, diagnosis);
  return report_diagnosis(arguments, name, diagnosis, surface);
}

int run_check(const Arguments& arguments) {
  const fs::path folder(arguments.out);
  if (!fs::exists(folder)) throw Error(ErrorKind::usage, folder.string(), "is not there", "name the folder that slice wrote");
  if (!fs::exists(folder / "config.resolved.json")) {
    throw Error(ErrorKind::usage, folder.string(), "is no output folder of slice", "name the folder that slice wrote");
  }
  const Json config = read_config(folder / "config.resolved.json").values;
  CheckOutputResult result;
  {
    Session session(arguments);
    result = check_output(folder, machine_from_config(config_value(config, "machine")), session.context);
  }
  std::cout << check_summary(result);
  return result.ok ? 0 : 1;
}

int run_config_check(const Arguments& arguments) {
  ConfigSource config = read_config(arguments.config, shipped_profiles());
  const Json resolved = resolve_config(config);
  std::cout << arguments.config << ": ok, " << config_keys().size() << " keys resolved\n";
  return 0;
}

void add_run_options(CLI::App& command, Arguments& arguments) {
  command.add_option("-s,--set", arguments.overrides, "Override one config key: key.path=value")->take_all()->allow_extra_args(false);
  command.add_option("--threads", arguments.threads, "Worker threads; the result does not depend on them")->check(CLI::Range(1, 256));
  command.add_option("--progress", arguments.progress, "Progress on stderr")->check(CLI::IsMember({"auto", "json", "none"}));
}

// A first word that is no command: what it may have been meant to be, and all there are.
std::string unknown_command(const CLI::App& app, const std::string& word) {
  std::string all, nearest;
  std::size_t least = 3;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string& name = command->get_name();
    if (name == word) return {};
    all += (all.empty() ? "" : ", ") + name;
    if (const std::size_t distance = edit_distance(word, name); distance < least) {
      least = distance;
      nearest = name;
    }
  }
  return "there is no command '" + word + "'" + (nearest.empty() ? "" : "; did you mean " + nearest + "?") + " (commands: " + all + ")";
}

}  // namespace

int run(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Curved layers, tree supports and robot programs from a tetrahedral mesh and a field."};
  app.set_version_flag("--version", "curvesup " CURVESUP_VERSION);
  app.require_subcommand(1);

  auto* slice_command = app.add_subcommand("slice", "Slice a model into layers, supports, toolpaths and robot files");
  slice_command->add_option("MODEL", arguments.model, "model.tet, or a surface .stl or .obj")->required();
  slice_command->add_option("CONFIG", arguments.config, "config.json")->required();
  slice_command->add_option("-o,--out", arguments.out, "Output folder; default <model name>_out");
  slice_command->add_option("--stop-after", arguments.stop_after, "Stop after this stage")->check(CLI::IsMember(slice_stage_names()));
  slice_command->footer("Example: curvesup slice model.tet config.json -o out -s layers.count=80");
  add_run_options(*slice_command, arguments);

  auto* compare_command = app.add_subcommand("compare", "Tree support against the envelope baseline, one table");
  compare_command->add_option("MODEL", arguments.model, "model.tet, or a surface .stl or .obj")->required();
  compare_command->add_option("CONFIG", arguments.config, "config.json")->required();
  compare_command->add_option("-o,--out", arguments.out, "Folder for compare.json and compare.csv");
  compare_command->footer("Example: curvesup compare model.tet config.json -o comparison");
  add_run_options(*compare_command, arguments);

  auto* inspect_command = app.add_subcommand("inspect", "What is wrong with this mesh, with element ids");
  inspect_command->add_option("MODEL", arguments.model, "model.tet, or a surface .stl or .obj")->required();
  inspect_command->add_option("-o,--out", arguments.out, "Page to write, with the bad elements marked");
  inspect_command->footer("Example: curvesup inspect model.tet -o diagnosis.html");

  auto* check_command = app.add_subcommand("check", "Re-read the robot and Duet programs of an output folder and prove them");
  check_command->add_option("OUT", arguments.out, "output folder of slice")->required();
  check_command->add_option("--threads", arguments.threads, "Worker threads")->check(CLI::Range(1, 256));
  check_command->footer("Example: curvesup check model_out");

  auto* config_command = app.add_subcommand("config", "Print, explain and check the config");
  config_command->require_subcommand(1);
  auto* init = config_command->add_subcommand("init", "Print a config with every key at its default");
  auto* schema = config_command->add_subcommand("schema", "Print the JSON Schema");
  auto* explain = config_command->add_subcommand("explain", "Explain one key or a whole section");
  explain->add_option("KEY", arguments.key, "key.path")->required();
  explain->footer("Example: curvesup config explain support.leaf_radius_mm");
  auto* check_config = config_command->add_subcommand("check", "Check a config file");
  check_config->add_option("FILE", arguments.config, "config.json")->required();
  check_config->footer("Example: curvesup config check config.json");
  init->footer("Example: curvesup config init > config.json");
  schema->footer("Example: curvesup config schema > curvesup.schema.json");

  if (argc > 1 && argv[1][0] != '-') {
    if (const std::string problem = unknown_command(app, argv[1]); !problem.empty()) {
      std::cerr << "curvesup: error [usage] command line: " << problem << "\n";
      return kUsageExit;
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "curvesup: error [usage] command line: " << error.what() << " (see curvesup --help)\n";
    return kUsageExit;
  }

  try {
    if (slice_command->parsed()) return run_slice(arguments);
    if (compare_command->parsed()) return run_compare(arguments);
    if (inspect_command->parsed()) return run_inspect(arguments);
    if (check_command->parsed()) return run_check(arguments);
    if (init->parsed()) std::cout << default_config().dump(2) << "\n";
    if (schema->parsed()) std::cout << config_schema().dump(2) << "\n";
    if (explain->parsed()) std::cout << explain_key(arguments.key);
    if (check_config->parsed()) return run_config_check(arguments);
    return 0;
  } catch (const Error& error) {
    std::cerr << "curvesup: error " << error.what() << "\n";
    // TetGen's thread may still be at work, and cannot be told to end.
    if (error.kind() == ErrorKind::interrupted) std::_Exit(exit_code(error.kind()));
    return exit_code(error.kind());
  } catch (const std::bad_alloc&) {
    std::cerr << "curvesup: error [geometry] memory: not enough memory (use fewer layers, larger domain.max_tet_volume_mm3, or a smaller "
                 "model.scale)\n";
    return exit_code(ErrorKind::geometry);
  } catch (const std::exception& error) {
    std::cerr << "curvesup: error [internal] program: " << error.what() << " (please report this)\n";
    return exit_code(ErrorKind::internal);
  }
}

}  // namespace curvesup::cli
