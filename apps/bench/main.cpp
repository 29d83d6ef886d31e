// Times every stage of `slice` on the shipped models: bench [--benchmark_filter=dome/.*] [any option of Google Benchmark].
#include <benchmark/benchmark.h>

#include <filesystem>
#include <memory>

#include "curvesup/io/output_folder.h"
#include "pipeline/slice_state.h"
#include "pipeline/stages.h"
#include "pipeline/write_output.h"

namespace curvesup {

namespace {

namespace fs = std::filesystem;

const fs::path kData = CURVESUP_SOURCE_DATA;

RunContext two_threads() {
  RunContext run;
  run.threads = 2;
  return run;
}

// A shipped model on its way through the stages. Benchmarks come in the order of the stages, so one state is enough.
class Runner {
 public:
  explicit Runner(const std::string& model) : model_(model) {
    request_.model_file = kData / model / "model.tet";
    request_.config = read_config(kData / model / "config.json", {{kData / "machines"}});
    state_ = std::make_unique<SliceState>(request_);
  }

  [[nodiscard]] const std::string& model() const { return model_; }

  // What stage `index` starts from.
  const SliceState& before(std::size_t index) {
    const auto stages = slice_stages();
    for (; state_->stages_done < index; ++state_->stages_done) stages[state_->stages_done].run(*state_, two_threads());
    return *state_;
  }

 private:
  std::string model_;
  SliceRequest request_;
  std::unique_ptr<SliceState> state_;
};

Runner& runner_of(const std::string& model) {
  static std::unique_ptr<Runner> last;
  if (!last || last->model() != model) last = std::make_unique<Runner>(model);
  return *last;
}

void time_stage(benchmark::State& bench, const std::string& model, std::size_t index) {
  const SliceState& before = runner_of(model).before(index);
  for (auto _ : bench) {
    bench.PauseTiming();
    auto state = std::make_unique<SliceState>(before);
    bench.ResumeTiming();
    slice_stages()[index].run(*state, two_threads());
    bench.PauseTiming();
    state.reset();
    bench.ResumeTiming();
  }
}

void time_writing(benchmark::State& bench, const std::string& model) {
  const SliceState& before = runner_of(model).before(slice_stages().size());
  const fs::path out = fs::temp_directory_path() / ("curvesup_bench_" + model);
  for (auto _ : bench) {
    bench.PauseTiming();
    auto state = std::make_unique<SliceState>(before);
    OutputFolder folder(out);  // never committed: nothing stays
    bench.ResumeTiming();
    const std::vector<Plot> plots = write_artifacts(folder, *state, two_threads());
    write_pictures(folder, *state, plots, {{"program", {}}}, two_threads());
    bench.PauseTiming();
    state.reset();
    bench.ResumeTiming();
  }
}

void add_benchmarks() {
  const auto stages = slice_stages();
  for (const std::string model : {"block", "arches", "dome", "frame"}) {
    for (std::size_t i = 0; i < stages.size(); ++i) {
      benchmark::RegisterBenchmark((model + "/" + stages[i].name).c_str(), time_stage, model, i)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
    }
    benchmark::RegisterBenchmark((model + "/write").c_str(), time_writing, model)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
  }
}

}  // namespace

}  // namespace curvesup

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  curvesup::add_benchmarks();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
