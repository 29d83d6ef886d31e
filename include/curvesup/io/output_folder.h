#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/io/text_file.h"

namespace curvesup {

// An output folder that appears whole or not at all. Files go into a hidden sibling folder; commit() moves that into
// place. Destroyed without commit, it leaves nothing behind, parent folders it made included, and an older output stays
// as it was. What a killed program left beside the same output is removed by the next one.
//
// An older output is replaced only by commit(), and only when it is empty or an earlier output of this program (it
// holds manifest.json and report.json); everything else is refused by the constructor. All failures are Error{output}.
class OutputFolder {
 public:
  explicit OutputFolder(const std::filesystem::path& final_path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  struct File {
    std::string path;  // relative, with '/'
    std::uint64_t bytes = 0;
    std::string sha256;
  };

  // Writes one file, e.g. write("robot/part_0001.script", text); folders on the way are made.
  void write(std::string_view relative, std::string_view bytes);
  // The same for a file that comes in pieces: nothing but the piece at hand is held.
  void write(std::string_view relative, const std::function<void(const ByteSink&)>& produce);

  struct Task {
    std::string relative;
    std::function<void(const ByteSink&)> produce;
  };
  // Writes files that do not depend on each other, on run.threads threads; they are listed in the order of the tasks.
  void write_all(std::span<const Task> tasks, const RunContext& run);

  // What was written so far, in order.
  [[nodiscard]] std::span<const File> files() const { return files_; }

  void commit();

  [[nodiscard]] const std::filesystem::path& final_path() const { return final_; }
  // Where files are until commit().
  [[nodiscard]] const std::filesystem::path& working_path() const { return working_; }

 private:
  void make_parents();
  void make_working_folder();
  void clean_up() noexcept;
  [[nodiscard]] File write_one(std::string_view relative, const std::function<void(const ByteSink&)>& produce) const;

  std::filesystem::path final_, working_;
  std::vector<std::filesystem::path> made_parents_;  // outermost first
  std::vector<File> files_;
  bool committed_ = false;
};

}  // namespace curvesup
