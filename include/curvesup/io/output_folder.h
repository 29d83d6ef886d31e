#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

  std::filesystem::path final_, working_;
  std::vector<std::filesystem::path> made_parents_;  // outermost first
  std::vector<File> files_;
  bool committed_ = false;
};

}  // namespace curvesup
