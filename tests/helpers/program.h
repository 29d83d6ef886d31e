#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

// Runs the built command line in a folder of its own.
namespace curvesup::program {

namespace fs = std::filesystem;

inline std::string read_all(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

// A temporary folder, removed at the end.
class Folder {
 public:
  Folder() {
    std::string name = (fs::path(::testing::TempDir()) / "curvesup_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }
  // Runs `curvesup <arguments>` here.
  [[nodiscard]] Outcome curvesup(const std::string& arguments, const std::string& environment = "") const {
    const std::string command = "cd '" + path_.string() + "' && " + environment + " '" CURVESUP_BINARY_DIR "/curvesup' " + arguments +
                                " > .stdout 2> .stderr";
    const int status = std::system(command.c_str());
    Outcome run{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_all(path_ / ".stdout"), read_all(path_ / ".stderr")};
    fs::remove(path_ / ".stdout");
    fs::remove(path_ / ".stderr");
    return run;
  }
  // Every file below, relative name -> bytes.
  [[nodiscard]] std::map<std::string, std::string> files(const std::string& below) const {
    std::map<std::string, std::string> all;
    if (!fs::exists(path_ / below)) return all;
    for (const auto& entry : fs::recursive_directory_iterator(path_ / below)) {
      if (entry.is_regular_file()) all[fs::relative(entry.path(), path_ / below).string()] = read_all(entry.path());
    }
    return all;
  }

 private:
  fs::path path_;
};

}  // namespace curvesup::program
